//! The stages and the steps of `locate`: their words, their order in each tracker, and what they answer.

use sightline_track::settings::TrackerKind;

/// A stage or a step of `locate`, in running order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Stage 1.
    Predict,
    /// Stage 2.
    PointMast,
    /// Stage 3.
    Capture,
    /// Stage 4.
    Locate,
    /// First step of `locate` by the template tracker.
    ScaleRoll,
    /// Its second step.
    MatchTemplate,
    /// Its third step.
    PointStereo,
    /// First step of `locate` by the feature tracker.
    Detect,
    /// Its second step, between the eyes and between the stops.
    MatchFeatures,
    /// Last step of `locate` by the template tracker, third one of the feature tracker.
    Triangulate,
    /// Fourth step of the feature tracker.
    FitMotion,
    /// Its last step.
    Bootstrap,
    /// First step of `locate` by the shape tracker: dense stereo.
    Surface,
    /// Its second step, over all shifts.
    CoarseRegister,
    /// Its third step.
    RefineRegister,
    /// Its last step: the first line of sight on the near surface.
    CarriedRay,
    /// Stage 5.
    Judge,
    /// Stage 6.
    Update,
}

impl Stage {
    /// All of them.
    pub const ALL: [Self; 18] = [
        Self::Predict,
        Self::PointMast,
        Self::Capture,
        Self::Locate,
        Self::ScaleRoll,
        Self::MatchTemplate,
        Self::PointStereo,
        Self::Detect,
        Self::MatchFeatures,
        Self::Triangulate,
        Self::FitMotion,
        Self::Bootstrap,
        Self::Surface,
        Self::CoarseRegister,
        Self::RefineRegister,
        Self::CarriedRay,
        Self::Judge,
        Self::Update,
    ];

    /// Those of a tracker, in running order.
    pub const fn of(tracker: TrackerKind) -> &'static [Self] {
        use Stage::*;
        match tracker {
            TrackerKind::Template => &[
                Predict,
                PointMast,
                Capture,
                Locate,
                ScaleRoll,
                MatchTemplate,
                PointStereo,
                Triangulate,
                Judge,
                Update,
            ],
            TrackerKind::Features => &[
                Predict,
                PointMast,
                Capture,
                Locate,
                Detect,
                MatchFeatures,
                Triangulate,
                FitMotion,
                Bootstrap,
                Judge,
                Update,
            ],
            TrackerKind::Shape => &[
                Predict,
                PointMast,
                Capture,
                Locate,
                Surface,
                CoarseRegister,
                RefineRegister,
                CarriedRay,
                Judge,
                Update,
            ],
            TrackerKind::Combined => &[
                Predict,
                PointMast,
                Capture,
                Locate,
                Detect,
                MatchFeatures,
                Triangulate,
                FitMotion,
                Bootstrap,
                Surface,
                CoarseRegister,
                RefineRegister,
                CarriedRay,
                Judge,
                Update,
            ],
        }
    }

    /// The stage so many places on in the tracker's order; the first and the last are where it ends.
    pub fn neighbour(self, tracker: TrackerKind, by: isize) -> Self {
        let stages = Self::of(tracker);
        let at = stages.iter().position(|&stage| stage == self.of_tracker(tracker)).unwrap_or(0);
        stages[at.saturating_add_signed(by).min(stages.len() - 1)]
    }

    /// The stage itself, or the one that stands in its place where `tracker` does not have it.
    pub fn of_tracker(self, tracker: TrackerKind) -> Self {
        if Self::of(tracker).contains(&self) {
            return self;
        }
        // The step of the other tracker that answers the most similar question.
        match (self, tracker) {
            (step, _) if !step.is_step_of_locate() => step,
            (Self::ScaleRoll, TrackerKind::Features | TrackerKind::Combined) => Self::Detect,
            (_, TrackerKind::Features | TrackerKind::Combined) => Self::MatchFeatures,
            (Self::Detect | Self::Surface, TrackerKind::Template) => Self::ScaleRoll,
            (Self::MatchFeatures | Self::CoarseRegister | Self::RefineRegister, TrackerKind::Template) => {
                Self::MatchTemplate
            }
            (_, TrackerKind::Template) => Self::Triangulate,
            (Self::ScaleRoll | Self::Detect, TrackerKind::Shape) => Self::Surface,
            (Self::MatchTemplate | Self::MatchFeatures, TrackerKind::Shape) => Self::CoarseRegister,
            (_, TrackerKind::Shape) => Self::RefineRegister,
        }
    }

    /// The word of the house.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Predict => "predict",
            Self::PointMast => "point_mast",
            Self::Capture => "capture",
            Self::Locate => "locate",
            Self::ScaleRoll => "scale_roll",
            Self::MatchTemplate => "match_template",
            Self::PointStereo => "point_stereo",
            Self::Detect => "detect",
            Self::MatchFeatures => "match_features",
            Self::Triangulate => "triangulate",
            Self::FitMotion => "fit_motion",
            Self::Bootstrap => "bootstrap",
            Self::Surface => "surface",
            Self::CoarseRegister => "coarse_register",
            Self::RefineRegister => "refine_register",
            Self::CarriedRay => "carried_ray",
            Self::Judge => "judge",
            Self::Update => "update",
        }
    }

    /// What it answers.
    pub const fn question(self) -> &'static str {
        match self {
            Self::Predict => "Where should the target be now, by dead reckoning?",
            Self::PointMast => "Which pointing centres the prediction, and where does it appear?",
            Self::Capture => "What was photographed, and how well is it exposed?",
            Self::Locate => "Where is the target now?",
            Self::ScaleRoll => "How should the template look from here?",
            Self::MatchTemplate => "Where does the template fit best in the left image?",
            Self::PointStereo => "Which point of the right image is it?",
            Self::Detect => "Which features do the two images have?",
            Self::MatchFeatures => "Which features are the same, in the other eye and at an earlier stop?",
            Self::Triangulate => "Which point in space do both pixels see?",
            Self::FitMotion => "Which rigid motion do most matches agree with?",
            Self::Bootstrap => "How certain is that motion?",
            Self::Surface => "Which surface does the pair show?",
            Self::CoarseRegister => "By which shift does it fit the earlier surface, roughly?",
            Self::RefineRegister => "By which motion does it fit best, and how certain is that?",
            Self::CarriedRay => "Where does the first line of sight meet the surface?",
            Self::Judge => "Can the match be trusted?",
            Self::Update => "What does this stop leave to the next?",
        }
    }

    /// Whether it is a step of `locate`.
    pub(crate) const fn is_step_of_locate(self) -> bool {
        !matches!(
            self,
            Self::Predict | Self::PointMast | Self::Capture | Self::Locate | Self::Judge | Self::Update
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_end_at_the_first_and_the_last() {
        let from = |stage: Stage, by: isize| stage.neighbour(TrackerKind::Template, by);
        assert_eq!(from(Stage::Predict, -1), Stage::Predict);
        assert_eq!(from(Stage::Predict, 1), Stage::PointMast);
        assert_eq!(from(Stage::Update, 1), Stage::Update);
        assert_eq!(from(Stage::Predict, 99), Stage::Update);
        // A stage of the other tracker counts as the one in its place.
        assert_eq!(from(Stage::FitMotion, 1), Stage::Judge);
    }
}
