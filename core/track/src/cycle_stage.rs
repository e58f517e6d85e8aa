//! The nine stages of one stop of a commanded drive, by name and in running order.
//!
//! Stages 1 to 6 are those of this crate; the last three (`core/rover/src/driving/`) decide the next motion and drive
//! it. A pause of a drive and the record of a stop at which it is paused ([`crate::trace::StepKind::Begun`]) name the
//! first stage that is not computed.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A stage of a stop of a commanded drive; earlier stages are less than later ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CycleStage {
    /// Stage 1: carries the target by dead reckoning.
    Predict,
    /// Stage 2: points the mast at the prediction.
    PointMast,
    /// Stage 3: takes the stereo pair.
    Capture,
    /// Stage 4: finds the target in the pair.
    Locate,
    /// Stage 5: accepts or rejects the located target.
    Judge,
    /// Stage 6: updates the target for the next stop.
    Update,
    /// Stage 7: computes the goal from the target.
    SetGoal,
    /// Stage 9: selects the next motion.
    SelectPath,
    /// Stage 10: drives the motion.
    Drive,
}

impl CycleStage {
    /// All stages in running order.
    pub const ALL: [Self; 9] = [
        Self::Predict,
        Self::PointMast,
        Self::Capture,
        Self::Locate,
        Self::Judge,
        Self::Update,
        Self::SetGoal,
        Self::SelectPath,
        Self::Drive,
    ];

    /// The name, as in records and requests.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Predict => "predict",
            Self::PointMast => "point_mast",
            Self::Capture => "capture",
            Self::Locate => "locate",
            Self::Judge => "judge",
            Self::Update => "update",
            Self::SetGoal => "set_goal",
            Self::SelectPath => "select_path",
            Self::Drive => "drive",
        }
    }

    /// Returns the stage with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.word() == name)
    }

    /// The next stage of the same stop; `None` after `drive`.
    pub fn next(self) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| *stage > self)
    }

    /// The previous stage of the same stop; `None` before `predict`.
    pub fn previous(self) -> Option<Self> {
        Self::ALL.into_iter().rev().find(|stage| *stage < self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_have_the_names_of_their_wire_form_and_an_order() {
        for pair in CycleStage::ALL.windows(2) {
            assert!(pair[0] < pair[1]);
            assert_eq!((pair[0].next(), pair[1].previous()), (Some(pair[1]), Some(pair[0])));
        }
        for stage in CycleStage::ALL {
            assert_eq!(serde_json::to_value(stage).unwrap(), stage.word());
            assert_eq!(CycleStage::named(stage.word()), Some(stage));
        }
        assert_eq!(CycleStage::named("no such stage"), None);
    }
}
