//! The stages, and the steps of `locate`, that the user can select. They have the names and order of the record of each
//! tracker. A commanded drive adds visual odometry before them and its own stages after `update`.

use sightline_session::records;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate;
use sightline_track::records::stages_of;
use sightline_track::settings::TrackerKind;

/// A stage or a step of `locate`, identified by its name in the record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Stage(&'static str);

/// The stages that the stage bar has in addition to the tracker's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StageBarExtent {
    /// None: a recording without odometry.
    Tracker,
    /// Visual odometry: a recording whose stops have it.
    Odometry,
    /// Visual odometry, and the stages of a commanded drive.
    Drive,
}

/// The stages that the page refers to by name.
impl Stage {
    /// Stage 0, only with visual odometry.
    pub const VISUAL_ODOMETRY: Self = Self("visual_odometry");
    /// Stage 1.
    pub const PREDICT: Self = Self("predict");
    /// Stage 2.
    pub const POINT_MAST: Self = Self("point_mast");
    /// Stage 3.
    pub const CAPTURE: Self = Self("capture");
    /// Stage 4.
    pub const LOCATE: Self = Self("locate");
    /// First step of the template tracker.
    pub const SCALE_ROLL: Self = Self("scale_roll");
    /// Second step of the template tracker.
    pub const MATCH_TEMPLATE: Self = Self("match_template");
    /// Third step of the template tracker.
    pub const POINT_STEREO: Self = Self("point_stereo");
    /// First step of the feature tracker.
    pub const DETECT: Self = Self("detect");
    /// Second step of the feature tracker: matches between left and right image, and between stops.
    pub const MATCH_FEATURES: Self = Self("match_features");
    /// Last step of the template tracker, third one of the feature tracker.
    pub const TRIANGULATE: Self = Self("triangulate");
    /// Fourth step of the feature tracker.
    pub const FIT_MOTION: Self = Self("fit_motion");
    /// Last step of the feature tracker.
    pub const BOOTSTRAP: Self = Self("bootstrap");
    /// First step of the shape tracker: dense stereo.
    pub const SURFACE: Self = Self("surface");
    /// Second step of the shape tracker: the search over all shifts.
    pub const COARSE_REGISTER: Self = Self("coarse_register");
    /// Third step of the shape tracker.
    pub const REFINE_REGISTER: Self = Self("refine_register");
    /// Last step of the shape tracker: the designation's line of sight, transformed and intersected with the current mesh.
    pub const CARRIED_RAY: Self = Self("carried_ray");
    /// Stage 5.
    pub const JUDGE: Self = Self("judge");
    /// Stage 6.
    pub const UPDATE: Self = Self("update");
    /// Stage 7, of a commanded drive.
    pub const SET_GOAL: Self = Self("set_goal");
    /// Stage 9, of a commanded drive.
    pub const SELECT_PATH: Self = Self("select_path");
    /// Stage 10, of a commanded drive.
    pub const DRIVE: Self = Self("drive");
    /// The stages that only a commanded drive has.
    pub const OF_DRIVE: [Self; 3] = [Self::SET_GOAL, Self::SELECT_PATH, Self::DRIVE];
}

impl Stage {
    /// The stages of a tracker, in running order.
    pub fn of(tracker: TrackerKind) -> impl Iterator<Item = Self> {
        stages_of(tracker).map(Self)
    }

    /// The stage with this name in any tracker; `None` if the name is unknown.
    pub fn named(name: &str) -> Option<Self> {
        let of_trackers = TrackerKind::ALL.into_iter().flat_map(Self::of);
        let further = Self::OF_DRIVE.into_iter().chain([Self::VISUAL_ODOMETRY]);
        of_trackers.chain(further).find(|stage| stage.0 == name)
    }

    /// The stages of the stage bar: the tracker's, and those that `extent` adds.
    pub fn bar(tracker: TrackerKind, extent: StageBarExtent) -> impl Iterator<Item = Self> {
        let odometry = [Self::VISUAL_ODOMETRY].into_iter().filter(move |_| extent != StageBarExtent::Tracker);
        let of_drive = Self::OF_DRIVE.into_iter().filter(move |_| extent == StageBarExtent::Drive);
        odometry.chain(Self::of(tracker)).chain(of_drive)
    }

    /// The stage `by` positions further in the stage bar, clamped to its ends.
    pub fn neighbour(self, tracker: TrackerKind, extent: StageBarExtent, by: isize) -> Self {
        let stages: Vec<Self> = Self::bar(tracker, extent).collect();
        let at = stages.iter().position(|&stage| stage == self.of_tracker(tracker)).unwrap_or(0);
        stages[at.saturating_add_signed(by).min(stages.len() - 1)]
    }

    /// Returns the stage itself, or its counterpart if `tracker` lacks it. The first and the second step of `locate`
    /// prepare and match in every tracker; the counterpart of any later step is the last step.
    pub fn of_tracker(self, tracker: TrackerKind) -> Self {
        if Self::bar(tracker, StageBarExtent::Drive).any(|stage| stage == self) {
            return self;
        }
        let place = |tracker| locate::steps(tracker).iter().position(|step| *step == self.0);
        let place = TrackerKind::ALL.into_iter().find_map(place).unwrap_or(0);
        let steps = locate::steps(tracker);
        let step = if place < 2 { steps.get(place).or(steps.last()) } else { steps.last() };
        step.map_or(Self::LOCATE, |step| Self(step))
    }

    /// Its name in the record.
    pub const fn word(self) -> &'static str {
        self.0
    }

    /// The question that the stage answers; empty for a stage without one.
    pub fn question(self) -> &'static str {
        match self {
            Self::SET_GOAL => "Where is the rover to stop?",
            Self::SELECT_PATH => "Which motion brings the rover nearer to the goal?",
            Self::DRIVE => "How far did the rover come?",
            _ => records::stage(self.0).map_or("", |stage| &stage.schema().question),
        }
    }

    /// The stage of a stop that contains it: the stage itself, or `locate` for its steps.
    pub(crate) fn in_cycle(self) -> CycleStage {
        // Odometry is measured in the pair that `capture` takes; it corrects the prediction afterwards.
        let other = if self == Self::VISUAL_ODOMETRY { CycleStage::Capture } else { CycleStage::Locate };
        CycleStage::named(self.0).unwrap_or(other)
    }

    /// Whether only a commanded drive has the stage.
    pub(crate) fn is_of_drive(self) -> bool {
        Self::OF_DRIVE.contains(&self)
    }

    /// Whether the stage is a step of `locate`.
    pub(crate) fn is_step_of_locate(self) -> bool {
        TrackerKind::ALL.into_iter().any(|tracker| locate::steps(tracker).contains(&self.0))
    }

    /// Whether the stage is the tracker's first step of `locate`.
    pub(crate) fn is_first_step(self, tracker: TrackerKind) -> bool {
        locate::steps(tracker).first() == Some(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_end_at_the_first_and_the_last() {
        let from =
            |stage: Stage, by: isize| stage.neighbour(TrackerKind::Template, StageBarExtent::Tracker, by);
        assert_eq!(from(Stage::PREDICT, -1), Stage::PREDICT);
        assert_eq!(from(Stage::PREDICT, 1), Stage::POINT_MAST);
        assert_eq!(from(Stage::UPDATE, 1), Stage::UPDATE);
        assert_eq!(from(Stage::PREDICT, 99), Stage::UPDATE);
        // A stage of another tracker counts as its counterpart.
        assert_eq!(from(Stage::FIT_MOTION, 1), Stage::JUDGE);
        // A commanded drive starts with odometry and continues after the update.
        let in_drive =
            |stage: Stage, by: isize| stage.neighbour(TrackerKind::Shape, StageBarExtent::Drive, by);
        assert_eq!(in_drive(Stage::UPDATE, 1), Stage::SET_GOAL);
        assert_eq!(in_drive(Stage::DRIVE, 1), Stage::DRIVE);
        assert_eq!(in_drive(Stage::PREDICT, -1), Stage::VISUAL_ODOMETRY);
        let replayed = Stage::bar(TrackerKind::Template, StageBarExtent::Odometry).next();
        assert_eq!(replayed, Some(Stage::VISUAL_ODOMETRY));
    }

    #[test]
    fn every_stage_has_a_question_and_is_found_by_its_name() {
        for stage in
            TrackerKind::ALL.into_iter().flat_map(|tracker| Stage::bar(tracker, StageBarExtent::Drive))
        {
            assert!(stage.question().ends_with('?'), "{}", stage.word());
            assert_eq!(Stage::named(stage.word()), Some(stage));
        }
        assert_eq!(Stage::MATCH_TEMPLATE.in_cycle(), CycleStage::Locate);
        assert_eq!(Stage::JUDGE.in_cycle(), CycleStage::Judge);
        assert_eq!(Stage::named("no such stage"), None);
    }
}
