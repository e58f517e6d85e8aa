//! Outcome of a target in a drive whose poses may be corrected by vision: tracked to the end or not, and the cause of
//! its loss.
//!
//! The pose causes a loss in two ways, judged at the first step from which the target is not tracked:
//!
//! * *window*: the true pixel is farther from the predicted one, along x or y, than the match can reach,
//!   `(search_window_px − template_size_px) / 2`, because the whole template must be inside the window;
//! * *correction*: the target was located correctly (R116), and rejected only by the gates on the distance between the
//!   result and the prediction (`distance_correction_m`, `position_correction_m`).
//!
//! A target that is not visible in the image is *hidden*. All other losses are attributed to the match.

use serde::{Deserialize, Serialize};

use sightline_geometry::frames::Pixel;
use sightline_session::step::RunStep;
use sightline_track::settings::Settings;

use super::run::Fate;

/// Gates on the distance between the result and the prediction from the poses.
const CORRECTION_GATES: [&str; 2] = ["distance_correction_m", "position_correction_m"];

/// Outcome of a target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ByPose {
    /// Whether it was tracked at the stop at which slip ended the drive; the later stops were not driven.
    pub not_driven: bool,
    /// The loss; `None` if the target was tracked at the last step.
    pub loss: Option<Loss>,
}

/// The first step from which a target was not tracked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Loss {
    /// Index of the step.
    pub step: usize,
    /// State at that step: lost or false.
    pub fate: Fate,
    /// Distance between the true and the predicted pixel, px; `None` if either is outside the image.
    pub off_px: Option<f64>,
    /// Cause of the loss.
    pub cause: LossCause,
}

/// Cause of a loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LossCause {
    /// Pose: the prediction was missing or so far off that the match could not reach the target.
    Window,
    /// Pose: the target was located, but rejected as too far from the prediction.
    Correction,
    /// The target was hidden or outside the image.
    Hidden,
    /// The target was within reach, but was not found or was confused with something else.
    Match,
}

impl ByPose {
    /// Adds a step with its fate.
    pub(super) fn add(&mut self, trace: &RunStep, fate: Option<Fate>, settings: &Settings) {
        match fate {
            Some(Fate::Tracked) => self.loss = None,
            Some(fate) if self.loss.is_none() => self.loss = Some(Loss::at(trace, fate, settings)),
            _ => {}
        }
    }
}

impl Loss {
    fn at(trace: &RunStep, fate: Fate, settings: &Settings) -> Self {
        let predicted = trace.pointing().and_then(|pointing| pointing.predicted_left);
        let truth = trace.truth.as_ref().and_then(|truth| truth.left_pixel);
        let window = &settings.template;
        let reach_px = f64::from(window.search_window_px - window.template_size_px) / 2.0;
        let is_in_reach = |a: Pixel, b: Pixel| (a.x - b.x).abs().max((a.y - b.y).abs()) <= reach_px;
        let cause = match (truth, predicted) {
            (None, _) => LossCause::Hidden,
            (Some(truth), Some(predicted)) if is_in_reach(truth, predicted) => match is_too_far(trace) {
                true => LossCause::Correction,
                false => LossCause::Match,
            },
            _ => LossCause::Window,
        };
        let off_px = truth.zip(predicted).map(|(truth, predicted)| truth.distance(predicted));
        Self { step: trace.step, fate, off_px, cause }
    }
}

/// Returns whether a correct result was rejected only by the gates on its distance from the prediction.
fn is_too_far(trace: &RunStep) -> bool {
    let gates = trace.verdict().map_or(&[][..], |verdict| &verdict.gates);
    let mut failed = gates.iter().filter(|gate| !gate.passed);
    trace.is_false_loss() && failed.all(|gate| CORRECTION_GATES.iter().any(|name| gate.name == *name))
}
