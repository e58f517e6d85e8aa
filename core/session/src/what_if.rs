//! What-if: recomputes one step of a run from the state after its previous step, with changed settings or a displaced
//! prediction. Nothing is stored; to continue with the change, fork the run (R97).
//!
//! [`sightline_track::stages::predict::displaced`] converts the displaced prediction to the rover frame: on the line of
//! sight of the pixel, with unchanged range and covariance.

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::removal::NO_PREDICTION;
use crate::step::{RunStep, StepRow};
use crate::track::{self, Drive, NextStep};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_track::settings::{Changes, Settings};
use sightline_track::stages::judge::Verdict;
use sightline_track::trace::{ArrayName, ArrayView};
use sightline_vision::image::PixelRect;
use sightline_world::target_truth::StepTruth;

/// Changes to try at a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WhatIf {
    /// The settings that differ from those of the run, by name.
    #[serde(default)]
    #[schema(value_type = Object)]
    pub settings: Changes,
    /// The displaced prediction in the left image, px; default: that of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction_px: Option<Pixel>,
    /// The arrays to return, by name.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub arrays: Vec<ArrayName>,
}

impl WhatIf {
    /// Whether it changes anything.
    pub fn is_empty(&self) -> bool {
        self.settings.is_empty() && self.prediction_px.is_none()
    }
}

/// The recorded data from which a step is recomputed.
#[derive(Clone, Copy, Debug)]
pub struct Base<'a> {
    /// The run's designation.
    pub first: &'a RunStep,
    /// The previous step, with the image of its template; `None` at the designation.
    pub last: Option<&'a RunStep>,
    /// The step as it was recorded.
    pub recorded: &'a RunStep,
    /// The run's configuration.
    pub settings: &'a Settings,
    /// The displaced prediction of this step in the run, left image, px; `None`: by dead reckoning.
    pub prediction_px: Option<Pixel>,
}

/// Recomputes the step with the changes.
///
/// # Errors
/// [`Error::Setting`] for an invalid change; [`Error::Request`] for a displaced designation or a pixel that is not finite;
/// at a designation as [`track::designate`]; [`Error::Cancelled`] soon after `cancel` is requested.
pub fn try_step<D: Drive>(
    drive: &D,
    base: Base<'_>,
    what_if: &WhatIf,
    cancel: Cancel<'_>,
) -> Result<RunStep> {
    let settings = base.settings.with(&what_if.settings)?;
    let is_pixel = what_if.prediction_px.is_none_or(|pixel| pixel.x.is_finite() && pixel.y.is_finite());
    match (base.last, what_if.prediction_px) {
        (_, Some(_)) if !is_pixel => {
            Err(Error::Request("prediction_px: x and y must be numbers, px".to_owned()))
        }
        (None, Some(_)) => Err(Error::Request(NO_PREDICTION.to_owned())),
        (None, None) => {
            track::designate_until(drive, base.first.update.target.designation, &settings, cancel)
        }
        (Some(last), prediction_px) => {
            let prediction_px = prediction_px.or(base.prediction_px);
            // A step of a paused drive is computed up to the pause.
            let before = base.recorded.paused_before();
            NextStep {
                first: base.first,
                last,
                settings: &settings,
                prediction_px,
                before,
                ended: None,
                cancel,
            }
            .compute(drive)
        }
    }
}

/// The data of a tried step that are drawn over the recorded one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Ghost {
    /// The changes.
    pub what_if: WhatIf,
    /// The row of the step.
    pub row: StepRow,
    /// Its gates with values and limits; null at a designation or a stop with damaged files.
    pub verdict: Option<Verdict>,
    /// Why the target was not located, as one sentence; null if it was.
    pub missing: Option<String>,
    /// The prediction in the left image, px; null at a designation or outside the view.
    pub predicted_left: Option<Pixel>,
    /// Its covariance, px².
    #[schema(value_type = Option<Vec<f64>>)]
    pub predicted_covariance_px2: Option<Matrix2<f64>>,
    /// The template match: peak, second peak and region; null without a match.
    #[serde(default)]
    pub matched: Option<TemplateMatch>,
    /// The searched region, clipped to the image.
    pub search_window: Option<PixelRect>,
    /// Side of the template, px.
    pub template_size_px: u32,
    /// The preparation of the template: scale and roll, or the warp by the surface's slope, px per px.
    #[schema(value_type = Option<Vec<f64>>)]
    pub prepared_from_template: Option<Matrix2<f64>>,
    /// The located position in the left image, px.
    pub left_pixel: Option<Pixel>,
    /// Mean square error of that position relative to the designated point, px².
    #[schema(value_type = Option<Vec<f64>>)]
    pub left_covariance_px2: Option<Matrix2<f64>>,
    /// The comparison with the truth; null if the truth is unknown.
    pub truth: Option<StepTruth>,
    /// The differences from the recorded step.
    pub deltas: Deltas,
    /// The requested arrays that exist at this step.
    pub arrays: Vec<GhostArray>,
}

/// Values of a tried step minus those of the recorded one; null if either is missing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Deltas {
    /// State of the recorded step.
    pub state_recorded: String,
    /// Score of the match.
    pub ncc: Option<f64>,
    /// Score of point stereo.
    pub stereo_score: Option<f64>,
    /// Confidence of the locator.
    pub confidence: Option<f64>,
    /// Distance between the located positions in the left image, px.
    pub moved_px: Option<f64>,
    /// Distance between the located positions in the rover frame, m.
    pub moved_m: Option<f64>,
    /// Error against the truth in the left image, px.
    pub err_px: Option<f64>,
    /// Largest 1σ axis of the position covariance, m.
    pub sigma_m: Option<f64>,
}

/// An array of a tried step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct GhostArray {
    /// Its name.
    pub name: ArrayName,
    /// Width and height.
    pub size: [u32; 2],
    /// Row-major values; null if invalid.
    pub values: Vec<Option<f32>>,
}

impl Ghost {
    /// The data to draw of `tried` over `recorded`; `settings` are those of `tried`.
    pub fn new(what_if: WhatIf, tried: &RunStep, recorded: &RunStep, settings: &Settings) -> Self {
        let pointing = tried.prediction().map(|_| &tried.point_mast);
        let evidence = tried.template();
        let matched = evidence.and_then(|e| e.match_template.as_ref());
        let located = tried.located();
        let arrays = what_if.arrays.iter().filter_map(|&name| Some(ghost_array(name, tried.array(name)?)));
        Self {
            arrays: arrays.collect(),
            row: tried.row(),
            verdict: tried.verdict().cloned(),
            missing: tried.fault().or_else(|| located?.missing.as_deref()).map(str::to_owned),
            predicted_left: pointing.and_then(|p| p.predicted_left),
            predicted_covariance_px2: pointing.and_then(|p| p.predicted_covariance_px2),
            matched: matched.cloned(),
            search_window: matched.map(|m| m.search_window),
            template_size_px: settings.template.template_size_px,
            prepared_from_template: evidence
                .and_then(|e| e.scale_roll.as_ref())
                .map(sightline_track::locate::template::scale_roll::ScaleRoll::prepared_from_template),
            left_pixel: located.and_then(|l| l.left_pixel),
            left_covariance_px2: located
                .filter(|_| matched.is_some())
                .map(|l| l.left_error.mean_square_px2()),
            truth: tried.truth.clone(),
            deltas: Deltas::between(tried, recorded),
            what_if,
        }
    }

    /// Whether the tried step is tracked; `None` without truth.
    pub fn is_right(&self) -> Option<bool> {
        self.truth.as_ref().and_then(|truth| truth.tracked)
    }
}

impl Deltas {
    fn between(tried: &RunStep, recorded: &RunStep) -> Self {
        let (now, then) = (tried.row(), recorded.row());
        let more = |of: fn(&StepRow) -> Option<f64>| Some(of(&now)? - of(&then)?);
        let position = |trace: &RunStep| trace.located().and_then(|l| l.position_in_rover);
        Self {
            state_recorded: then.state.clone(),
            ncc: more(|row| row.ncc),
            stereo_score: more(|row| row.stereo_score),
            confidence: more(|row| row.confidence),
            moved_px: now.left_pixel.zip(then.left_pixel).map(|(a, b)| a.distance(b)),
            moved_m: position(tried).zip(position(recorded)).map(|(a, b)| (a - b).norm()),
            err_px: more(|row| row.err_px),
            sigma_m: more(|row| row.sigma_m),
        }
    }
}

fn ghost_array(name: ArrayName, array: ArrayView<'_>) -> GhostArray {
    let values = array.values().iter().map(|value| Some(*value).filter(|v| v.is_finite()));
    GhostArray { name, size: array.size(), values: values.collect() }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use sightline_geometry::frames::Pose;
    use sightline_testing::PlaneWorld;
    use sightline_track::target::{Designation, TrackingState};

    fn world() -> PlaneWorld {
        PlaneWorld::new([0.0, 0.7, 1.4].map(|x| Pose::translation(x, 0.0, 0.0)).to_vec())
    }

    fn steps(world: &PlaneWorld) -> Vec<RunStep> {
        let designation = Designation::new(0, Pixel::new(118.3, 131.6));
        track::run(world, designation, &Settings::default()).unwrap()
    }

    fn base<'a>(steps: &'a [RunStep], step: usize, settings: &'a Settings) -> Base<'a> {
        let last = step.checked_sub(1).map(|last| &steps[last]);
        Base { first: &steps[0], last, recorded: &steps[step], settings, prediction_px: None }
    }

    #[test]
    fn without_a_change_the_tried_step_is_the_recorded_one() {
        let (world, settings) = (world(), Settings::default());
        let steps = steps(&world);
        for step in 0..3 {
            let tried =
                try_step(&world, base(&steps, step, &settings), &WhatIf::default(), Cancel::default())
                    .unwrap();
            assert_eq!(tried, steps[step]);
        }
    }

    #[test]
    fn a_displaced_prediction_moves_the_search_and_not_the_match() {
        let (world, settings) = (world(), Settings::default());
        let steps = steps(&world);
        let predicted = steps[1].point_mast.predicted_left.unwrap();
        let put = predicted.offset(20.0, -9.0);
        let what_if =
            WhatIf { prediction_px: Some(put), arrays: vec![ArrayName::SURFACE], ..WhatIf::default() };
        let tried = try_step(&world, base(&steps, 1, &settings), &what_if, Cancel::default()).unwrap();
        let ghost = Ghost::new(what_if, &tried, &steps[1], &settings);
        assert!(ghost.predicted_left.unwrap().distance(put) < 1e-9);
        assert_eq!(ghost.search_window, Some(PixelRect::centred(put, 143)));
        assert!(ghost.deltas.moved_px.unwrap() < 0.01, "{:?}", ghost.deltas);
        assert_eq!(tried.update.state, TrackingState::Tracking);
        let (recorded, matched) =
            (steps[1].template().unwrap().match_template.as_ref().unwrap(), ghost.matched.unwrap());
        assert!(matched.peak.pixel.distance(recorded.peak.pixel) < 0.01, "{:?}", matched.peak);
        assert_eq!((ghost.arrays[0].size, ghost.arrays[0].values.len()), ([123, 123], 123 * 123));
        // With a larger displacement the target is outside the window, and the step is lost.
        let away = WhatIf { prediction_px: Some(predicted.offset(-75.0, 60.0)), ..WhatIf::default() };
        let tried = try_step(&world, base(&steps, 1, &settings), &away, Cancel::default()).unwrap();
        assert_ne!(tried.update.state, TrackingState::Tracking);
    }

    #[test]
    fn what_cannot_be_tried_is_refused_in_one_sentence_that_names_the_field() {
        let (world, settings) = (world(), Settings::default());
        let steps = steps(&world);
        let refuse = |step: usize, what_if: &WhatIf| {
            try_step(&world, base(&steps, step, &settings), what_if, Cancel::default())
                .unwrap_err()
                .to_string()
        };
        let put = |x: f64| WhatIf { prediction_px: Some(Pixel::new(x, 10.0)), ..WhatIf::default() };
        assert!(refuse(0, &put(10.0)).starts_with("prediction_px: the target is designated"));
        assert!(refuse(1, &put(f64::NAN)).starts_with("prediction_px: x and y"));
        let wrong =
            WhatIf { settings: Changes::from([("ncc_min".to_owned(), json!(7))]), ..WhatIf::default() };
        assert!(refuse(1, &wrong).contains("ncc_min"));
    }
}
