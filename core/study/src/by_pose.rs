//! What became of a target in a drive whose poses may be corrected by vision: driven to the end or not, and why it was lost.
//!
//! A target is lost because of the pose in two ways, judged at the step from which it is not tracked any more:
//!
//! * *window*: its true pixel lies farther from the predicted one, along x or y, than the match can reach,
//!   `(search_window_px − template_size_px) / 2`, because the whole template lies in the window;
//! * *correction*: it was found where it is (R116), and refused by nothing but the gates that limit how far the result may lie
//!   from what the poses predict (`distance_correction_m`, `position_correction_m`).
//!
//! The truth that the image does not show is *hidden*. Everything else is a matter of the match.

use serde::{Deserialize, Serialize};

use sightline_geometry::frames::Pixel;
use sightline_session::step::RunStep;
use sightline_track::settings::Settings;

use super::run::Fate;

/// The gates that compare the result with what the poses predict.
const CORRECTION_GATES: [&str; 2] = ["distance_correction_m", "position_correction_m"];

/// What became of a target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ByPose {
    /// Whether it was tracked at the stop at which slip ended the drive; the stops after it were not driven.
    pub not_driven: bool,
    /// From where on it was not tracked; `None` where it was at the last step.
    pub loss: Option<Loss>,
}

/// The step from which a target was not tracked any more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Loss {
    /// The step.
    pub step: usize,
    /// What the tracker said there, lost or false.
    pub fate: Fate,
    /// Distance of the true pixel from the predicted one, px; `None` where either is in no image.
    pub off_px: Option<f64>,
    /// Why.
    pub cause: LossCause,
}

/// Why a target was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LossCause {
    /// The pose: the prediction was so far off that the match could not reach the target.
    Window,
    /// The pose: the target was found, and refused because it lay too far from what the poses predict.
    Correction,
    /// The target was hidden or out of the image.
    Hidden,
    /// The target was in reach; it was not found, or something else was taken for it.
    Match,
}

impl ByPose {
    /// Takes in a step with what became of the target there.
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

/// Whether a right result was refused by nothing but the gates of its distance from the prediction.
fn is_too_far(trace: &RunStep) -> bool {
    let gates = trace.verdict().map_or(&[][..], |verdict| &verdict.gates);
    let mut failed = gates.iter().filter(|gate| !gate.passed);
    trace.is_false_loss() && failed.all(|gate| CORRECTION_GATES.iter().any(|name| gate.name == *name))
}
