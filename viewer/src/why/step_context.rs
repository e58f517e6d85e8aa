//! The record of the cursor's step with its context, as the explanations need it, and the poses of the open traverse.

use sightline_api::wire::TraverseView;
use sightline_geometry::frames::{Pose, PoseRecord};
use sightline_geometry::odometry_error::OdometryError;
use sightline_session::why::pose_change::PoseChange;
use sightline_session::why::{Book, Sources, pose_change};

use crate::state::State;

/// The poses of a traverse.
pub(crate) struct Poses<'a>(&'a TraverseView);

impl Sources for Poses<'_> {
    fn site_from_rover(&self, step: usize) -> Pose {
        self.0.stops.get(step).map_or_else(Pose::identity, |stop| stop.site_from_rover.to_pose())
    }

    fn pose_error(&self) -> OdometryError {
        self.0.odometry_error
    }

    fn image_file(&self, _step: usize, _eye: usize) -> Option<String> {
        None
    }
}

impl State {
    /// The poses of the open traverse.
    pub(crate) fn poses(&self) -> Option<Poses<'_>> {
        self.traverse.as_ref().map(Poses)
    }

    /// The cursor's step with the previous step.
    pub(crate) fn step_context<'a>(&'a self, poses: &'a Poses<'a>) -> Option<Book<'a>> {
        let step = self.cursor.step;
        let run = self.run()?;
        let before = step.checked_sub(1).and_then(|before| self.trace_at(before).ready());
        let prediction_px =
            run.fork.filter(|fork| fork.from_step == step).and_then(|fork| fork.prediction_px);
        Some(Book { trace: self.trace()?, before, settings: &run.settings, prediction_px, sources: poses })
    }

    /// Whether the record of the cursor's step is loaded and contains this value.
    pub(crate) fn has_value(&self, name: &str) -> bool {
        let poses = self.poses();
        poses
            .as_ref()
            .and_then(|poses| self.step_context(poses))
            .is_some_and(|context| context.ask(name).is_ok())
    }

    /// The change of the estimated pose to the cursor's stop, and its error if the ground truth is known.
    pub(crate) fn pose_change(&self) -> Option<(PoseChange, Option<[f64; 6]>)> {
        let traverse = self.traverse.as_ref()?;
        let step = self.cursor.step;
        let [before, now] = [traverse.stops.get(step.checked_sub(1)?)?, traverse.stops.get(step)?];
        let poses = [before, now].map(|stop| stop.site_from_rover.to_pose());
        let measured = self.measured_motion(step);
        let found = PoseChange::between(&poses[0], &poses[1], &traverse.odometry_error, measured);
        let truths = [before, now].map(|stop| stop.true_site_from_rover.map(PoseRecord::to_pose));
        let error = truths[0].zip(truths[1]).map(|(before, now)| {
            let truth = pose_change::components(&(before.inverse() * now));
            std::array::from_fn(|k| found.change[k] - truth[k])
        });
        Some((found, error))
    }
}
