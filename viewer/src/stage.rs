//! The stages and the steps of `locate` that can be selected: names of stages of the record, in the order of each tracker. A
//! commanded drive adds visual odometry before them and its own stages after `update`.

use sightline_session::records;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate;
use sightline_track::records::stages_of;
use sightline_track::settings::TrackerKind;

/// A stage or a step of `locate`, by its name in the record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Stage(&'static str);

/// Which stages the bar has beside those of the tracker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// None: a recording without odometry.
    Tracker,
    /// Visual odometry: a recording whose stops have it.
    Odometry,
    /// Visual odometry, and the stages of a commanded drive.
    Drive,
}

/// Those that the page names.
impl Stage {
    /// Stage 0, of a drive with visual odometry.
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
    /// Second step of the feature tracker, between the eyes and between the stops.
    pub const MATCH_FEATURES: Self = Self("match_features");
    /// Last step of the template tracker, third one of the feature tracker.
    pub const TRIANGULATE: Self = Self("triangulate");
    /// Fourth step of the feature tracker.
    pub const FIT_MOTION: Self = Self("fit_motion");
    /// Last step of the feature tracker.
    pub const BOOTSTRAP: Self = Self("bootstrap");
    /// First step of the shape tracker: dense stereo.
    pub const SURFACE: Self = Self("surface");
    /// Second step of the shape tracker, over all shifts.
    pub const COARSE_REGISTER: Self = Self("coarse_register");
    /// Third step of the shape tracker.
    pub const REFINE_REGISTER: Self = Self("refine_register");
    /// Last step of the shape tracker: the first line of sight on the near surface.
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
    /// Those of a tracker, in running order.
    pub fn of(tracker: TrackerKind) -> impl Iterator<Item = Self> {
        stages_of(tracker).map(Self)
    }

    /// The stage of this name, whichever tracker has it.
    pub fn named(name: &str) -> Option<Self> {
        let of_trackers = TrackerKind::ALL.into_iter().flat_map(Self::of);
        let further = Self::OF_DRIVE.into_iter().chain([Self::VISUAL_ODOMETRY]);
        of_trackers.chain(further).find(|stage| stage.0 == name)
    }

    /// Those of the stage bar: of a tracker, and those of the extent around them.
    pub fn bar(tracker: TrackerKind, extent: Extent) -> impl Iterator<Item = Self> {
        let odometry = [Self::VISUAL_ODOMETRY].into_iter().filter(move |_| extent != Extent::Tracker);
        let of_drive = Self::OF_DRIVE.into_iter().filter(move |_| extent == Extent::Drive);
        odometry.chain(Self::of(tracker)).chain(of_drive)
    }

    /// The stage so many places on in the stage bar; the first and the last are where it ends.
    pub fn neighbour(self, tracker: TrackerKind, extent: Extent, by: isize) -> Self {
        let stages: Vec<Self> = Self::bar(tracker, extent).collect();
        let at = stages.iter().position(|&stage| stage == self.of_tracker(tracker)).unwrap_or(0);
        stages[at.saturating_add_signed(by).min(stages.len() - 1)]
    }

    /// The stage itself, or the one that stands in its place where `tracker` does not have it: the first and the second step
    /// of `locate` prepare and match in every tracker, and what follows counts as the last step.
    pub fn of_tracker(self, tracker: TrackerKind) -> Self {
        if Self::bar(tracker, Extent::Drive).any(|stage| stage == self) {
            return self;
        }
        let place = |tracker| locate::steps(tracker).iter().position(|step| *step == self.0);
        let place = TrackerKind::ALL.into_iter().find_map(place).unwrap_or(0);
        let steps = locate::steps(tracker);
        let step = if place < 2 { steps.get(place).or(steps.last()) } else { steps.last() };
        step.map_or(Self::LOCATE, |step| Self(step))
    }

    /// Its name.
    pub const fn word(self) -> &'static str {
        self.0
    }

    /// What it answers.
    pub fn question(self) -> &'static str {
        match self {
            Self::SET_GOAL => "Where is the rover to stop?",
            Self::SELECT_PATH => "Which motion brings the rover nearer to the goal?",
            Self::DRIVE => "How far did the rover come?",
            _ => records::stage(self.0).map_or("", |stage| &stage.schema().question),
        }
    }

    /// The stage of a stop that it is, or that it is a step of.
    pub(crate) fn in_cycle(self) -> CycleStage {
        // Odometry is measured in the pair that `capture` takes; it corrects the prediction afterwards.
        let other = if self == Self::VISUAL_ODOMETRY { CycleStage::Capture } else { CycleStage::Locate };
        CycleStage::named(self.0).unwrap_or(other)
    }

    /// Whether only a commanded drive has it.
    pub(crate) fn is_of_drive(self) -> bool {
        Self::OF_DRIVE.contains(&self)
    }

    /// Whether it is a step of `locate`.
    pub(crate) fn is_step_of_locate(self) -> bool {
        TrackerKind::ALL.into_iter().any(|tracker| locate::steps(tracker).contains(&self.0))
    }

    /// Whether it is the first step of `locate` of a tracker.
    pub(crate) fn is_first_step(self, tracker: TrackerKind) -> bool {
        locate::steps(tracker).first() == Some(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_end_at_the_first_and_the_last() {
        let from = |stage: Stage, by: isize| stage.neighbour(TrackerKind::Template, Extent::Tracker, by);
        assert_eq!(from(Stage::PREDICT, -1), Stage::PREDICT);
        assert_eq!(from(Stage::PREDICT, 1), Stage::POINT_MAST);
        assert_eq!(from(Stage::UPDATE, 1), Stage::UPDATE);
        assert_eq!(from(Stage::PREDICT, 99), Stage::UPDATE);
        // A stage of the other tracker counts as the one in its place.
        assert_eq!(from(Stage::FIT_MOTION, 1), Stage::JUDGE);
        // A commanded drive begins with odometry and goes on after the update.
        let in_drive = |stage: Stage, by: isize| stage.neighbour(TrackerKind::Shape, Extent::Drive, by);
        assert_eq!(in_drive(Stage::UPDATE, 1), Stage::SET_GOAL);
        assert_eq!(in_drive(Stage::DRIVE, 1), Stage::DRIVE);
        assert_eq!(in_drive(Stage::PREDICT, -1), Stage::VISUAL_ODOMETRY);
        let replayed = Stage::bar(TrackerKind::Template, Extent::Odometry).next();
        assert_eq!(replayed, Some(Stage::VISUAL_ODOMETRY));
    }

    #[test]
    fn every_stage_has_a_question_and_is_found_by_its_name() {
        for stage in TrackerKind::ALL.into_iter().flat_map(|tracker| Stage::bar(tracker, Extent::Drive)) {
            assert!(stage.question().ends_with('?'), "{}", stage.word());
            assert_eq!(Stage::named(stage.word()), Some(stage));
        }
        assert_eq!(Stage::MATCH_TEMPLATE.in_cycle(), CycleStage::Locate);
        assert_eq!(Stage::JUDGE.in_cycle(), CycleStage::Judge);
        assert_eq!(Stage::named("no such stage"), None);
    }
}
