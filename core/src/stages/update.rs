//! Stage 6, `update`: the next target (K§4.1 step 5, R28, R70, R78, R92).
//!
//! An accepted update renews the position and its covariance, and the template where the setting
//! `template_update` asks for it: taken anew around the sub-pixel match, the template chains the errors of all
//! matches so far, so that by default it stays as long as it need not be magnified much and still matches well. In
//! flight it was renewed at every update (R70). What a renewal replaces is remembered, so that it can be looked for again
//! (`reference_templates`, `template_update = drift_corrected`). Otherwise the position is carried by the prediction alone and the
//! template stays. The feature tracker has no template: it remembers the stop with its features instead (R186), the shape tracker its first and its last view (R189, R205).

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::frames::{Pixel, Pose};
use crate::locate::Located;
use crate::locate::features::anchor::Anchor;
use crate::locate::template::TemplateSettings;
use crate::locate::template::settings::TemplateUpdate;
use crate::settings::Settings;
use crate::stages::capture::Capture;
use crate::stages::judge::Verdict;
use crate::stages::point_mast::Pointing;
use crate::stages::predict::Prediction;
use crate::target::{Appearance, Kept, Target, TrackingState};

/// What this stop leaves to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Updated {
    /// The target.
    pub target: Target,
    /// The tracking state.
    pub state: TrackingState,
    /// Whether the template was taken anew.
    pub template_renewed: bool,
    /// How far the located position lies from the predicted one, m (R30).
    pub correction_m: Option<f64>,
    /// How far the match lies from the predicted pixel, px (R32).
    pub correction_px: Option<f64>,
}

/// The next target from an update that was judged; `carried` is the target as [`carry`] brought it to this stop.
pub fn update(
    carried: Target,
    pointing: &Pointing,
    capture: &Capture,
    located: &Located,
    verdict: &Verdict,
    site_from_rover: &Pose,
    settings: &Settings,
) -> Updated {
    let correction_m = located.position_in_rover.map(|p| (p - carried.position_in_rover).norm());
    let correction_px =
        located.left_pixel.zip(pointing.predicted_left).map(|(a, b): (Pixel, Pixel)| a.distance(b));
    let found = verdict.accepted.then(|| found_again(&carried, pointing, located)).flatten();
    let appearance = found
        .as_ref()
        .filter(|_| asks_for_a_new_template(located, &settings.template))
        .and_then(|target| new_appearance(target, pointing, capture, located, site_from_rover));
    let template_renewed = appearance.is_some();
    let anchor = found.as_ref().and_then(|target| anchor(target, located, site_from_rover));
    let view =
        located.evidence.shape().and_then(|evidence| evidence.view.clone()).filter(|_| found.is_some());
    let mut target = found.unwrap_or(carried);
    if let Some(view) = view {
        target.views = target.views.with(view);
    }
    if let Some(anchor) = anchor {
        target.anchors = target.anchors.with(anchor, settings.features.feature_memory as usize);
    }
    if let Some(appearance) = appearance {
        let old = Kept { appearance: target.appearance, drift: target.drift };
        let others = settings.template.reference_templates.saturating_sub(1) as usize;
        target.memory = target.memory.with(old, others);
        (target.appearance, target.drift) = (appearance, located.left_error);
    }
    Updated { target, state: verdict.state, template_renewed, correction_m, correction_px }
}

/// Whether an accepted update renews the template.
fn asks_for_a_new_template(located: &Located, settings: &TemplateSettings) -> bool {
    let Some(evidence) = located.evidence.template() else { return false };
    let scale = evidence.scale_roll.as_ref().map_or(f64::INFINITY, |s| s.scale);
    let score = evidence.match_template.as_ref().map_or(-1.0, |m| m.score);
    match settings.template_update {
        TemplateUpdate::EveryUpdate | TemplateUpdate::DriftCorrected => true,
        TemplateUpdate::Never => false,
        TemplateUpdate::OnCondition => {
            scale.max(1.0 / scale) >= settings.renew_scale || score < settings.renew_ncc
        }
    }
}

/// The target carried to this stop by the prediction alone.
pub fn carry(target: &Target, step: usize, prediction: &Prediction) -> Target {
    Target {
        step,
        position_in_rover: prediction.position_in_rover,
        covariance_in_rover: prediction.covariance_in_rover,
        travelled_m: prediction.travelled_m,
        travelled_since_update_m: prediction.travelled_since_update_m,
        ..target.clone()
    }
}

/// The carried target with the position as located.
fn found_again(carried: &Target, pointing: &Pointing, located: &Located) -> Option<Target> {
    let position_in_rover = located.position_in_rover?;
    Some(Target {
        position_in_rover,
        covariance_in_rover: located.covariance_in_rover?,
        last_distance_m: (position_in_rover - pointing.left.model.centre()).norm(),
        travelled_since_update_m: 0.0,
        ..carried.clone()
    })
}

/// This stop with its features and where the target is, for the tracker that follows those.
pub fn anchor(target: &Target, located: &Located, site_from_rover: &Pose) -> Option<Anchor> {
    let evidence = located.evidence.features()?;
    Some(Anchor {
        step: target.step,
        stop: evidence.stop,
        features: Arc::clone(evidence.features.as_ref()?),
        site_from_rover: *site_from_rover,
        carried: evidence.carried?,
    })
}

/// How the target looks now, around the sub-pixel match.
fn new_appearance(
    target: &Target,
    pointing: &Pointing,
    capture: &Capture,
    located: &Located,
    site_from_rover: &Pose,
) -> Option<Appearance> {
    Some(Appearance {
        step: target.step,
        pixel: located.left_pixel?,
        position_in_rover: target.position_in_rover,
        surface_by_pixel: located.surface_by_pixel,
        relief: located.evidence.template().and_then(|e| e.relief.clone()),
        camera: pointing.left.clone(),
        site_from_rover: *site_from_rover,
        image: Arc::clone(&capture.pair.left),
    })
}
