//! Stage 6, `update`: the next target (K§4.1 step 5, R28, R70, R78, R92).
//!
//! An accepted update replaces the position and its covariance, to which that of the mast angles' error is added. It
//! also lets the tracker renew its memory: the template tracker its template, as the setting `template_update`
//! requires (R70, R71), the feature tracker the stops from which it measures motions (R186), the shape tracker its
//! last view (R189, R205). Otherwise the position is carried by the prediction alone and the memory is unchanged.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::locate::{Accepted, Located};
use crate::settings::Settings;
use crate::stages::capture::Capture;
use crate::stages::point_mast::Pointing;
use crate::stages::prediction::Prediction;
use crate::target::{Target, TrackingState};
use crate::verdict::Verdict;
use sightline_geometry::frames::{Pixel, Pose};
use sightline_record::{Declaration, Record, Unit};

/// The state that this stop passes to the next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Updated {
    /// The target.
    pub target: Target,
    /// The tracking state.
    pub state: TrackingState,
    /// Whether the template was renewed.
    pub template_renewed: bool,
    /// Distance of the located position from the predicted one, m (Kim09 §4.1).
    pub correction_m: Option<f64>,
    /// Distance of the match from the predicted pixel, px (Kim09 §7.2).
    pub correction_px: Option<f64>,
}

/// Returns the next target after a judged update; `carried` is the target moved to this stop by [`carry`].
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
    let target = match found {
        None => carried,
        Some(target) => {
            let update = Accepted {
                step: target.step,
                left: &pointing.left,
                capture,
                site_from_rover,
                left_pixel: located.left_pixel,
                left_error: located.left_error,
                position_in_rover: target.position_in_rover,
                surface_by_pixel: located.surface_by_pixel,
                settings,
            };
            let memory = target.memory.remember(&located.evidence, &update);
            Target { memory, ..target }
        }
    };
    let template_renewed = target.memory.template_step() == Some(target.step);
    Updated { target, state: verdict.state, template_renewed, correction_m, correction_px }
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

/// The carried target with the located position.
fn found_again(carried: &Target, pointing: &Pointing, located: &Located) -> Option<Target> {
    let (position_in_rover, covariance) = located.position_in_rover.zip(located.covariance_in_rover)?;
    Some(Target {
        position_in_rover,
        covariance_in_rover: pointing
            .error_covariance_in_rover
            .map_or(covariance, |error| covariance + error),
        last_distance_m: (position_in_rover - pointing.left.model.centre()).norm(),
        travelled_since_update_m: 0.0,
        ..carried.clone()
    })
}
impl Record for Updated {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("state", Unit::One, |u| u.state.word()).describe("The tracking state.");
        r.quantity("template_renewed", Unit::One, |u| u.template_renewed)
            .describe("Whether the template was taken anew.");
        r.quantity("correction_m", Unit::Metre, |u| u.correction_m)
            .describe("Distance between the located and the predicted position.")
            .formula("│p_located − p_predicted│", &["locate.position_in_rover", "predict.position_in_rover"]);
        r.quantity("correction_px", Unit::Pixel, |u| u.correction_px)
            .describe("Distance between the match and the predicted pixel.")
            .formula("│pixel − predicted│", &["locate.left_pixel", "point_mast.predicted_left"]);
        r.quantity("target.position_in_rover", Unit::Metre, |u| u.target.position_in_rover)
            .describe("Estimated position in the rover frame.");
        r.quantity("target.covariance_in_rover", Unit::SquareMetre, |u| u.target.covariance_in_rover)
            .describe("Covariance of the estimated position in the rover frame, pointing error included.");
        r.quantity("target.initial_position_in_site", Unit::Metre, |u| u.target.initial_position_in_site)
            .describe("Position at the designation in the site frame.");
        r.quantity("target.initial_distance_m", Unit::Metre, |u| u.target.initial_distance_m)
            .describe("Distance from the left camera at the designation.");
        r.quantity("target.last_distance_m", Unit::Metre, |u| u.target.last_distance_m)
            .describe("Distance from the left camera at the last accepted update.");
        r.quantity("target.travelled_m", Unit::Metre, |u| u.target.travelled_m)
            .describe("Distance driven since the designation.");
        r.quantity("target.travelled_since_update_m", Unit::Metre, |u| u.target.travelled_since_update_m)
            .describe("Distance driven since the last accepted update.");
    }
}
