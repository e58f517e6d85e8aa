//! One step of one run on its way into a recording: where its rows go, and what the `log_*` functions read.

use std::sync::Arc;

use rerun::components::AggregationPolicy;
use rerun::{AsComponents, Clear, RecordingStream, SeriesLines};
use sightline_core::frames::{Point3, Pose};
use sightline_core::image::GrayImage;
use sightline_core::locate::features::FeatureEvidence;
use sightline_core::locate::template::TemplateEvidence;
use sightline_core::locate::template::match_template::TemplateMatch;
use sightline_core::stages::point_mast::Pointing;
use sightline_core::trace::StepTrace;

use super::Logged;

/// One step of one run.
pub(super) struct Step<'a> {
    /// Where the rows go.
    pub(super) stream: &'a RecordingStream,
    /// The run's name in entity paths.
    pub(super) root: &'a str,
    /// What the person calls the run.
    pub(super) label: &'a str,
    /// What the stages saw and decided.
    pub(super) trace: &'a StepTrace,
    /// The left and the right image of the stop, where they could be read and are still to be logged.
    pub(super) images: Option<[Arc<GrayImage>; 2]>,
    /// The estimated pose of the stop.
    pub(super) site_from_rover: Pose,
}

impl Step<'_> {
    /// Logs `value` at this step. Without a value the entity is cleared, because a viewer would go on showing
    /// the last step's.
    pub(super) fn log<A: AsComponents>(&self, entity: &str, value: Option<A>) -> Logged {
        let path = path(entity, self.root);
        match value {
            Some(value) => self.stream.log(path, &value),
            None => self.stream.log(path, &Clear::flat()),
        }
    }

    /// The pointing of a step that had a prediction: at the designation there is none.
    pub(super) fn predicted(&self) -> Option<&Pointing> {
        self.trace.predict.as_ref().and(self.trace.point_mast.as_ref())
    }

    /// The evidence of the template locator.
    pub(super) fn template(&self) -> Option<&TemplateEvidence> {
        self.trace.template()
    }

    /// The evidence of the feature locator.
    pub(super) fn features(&self) -> Option<&FeatureEvidence> {
        self.trace.features()
    }

    /// The match of the template.
    pub(super) fn matched(&self) -> Option<&TemplateMatch> {
        self.template().and_then(|evidence| evidence.match_template.as_ref())
    }

    /// A point of the present rover frame in the site frame of the estimated pose.
    pub(super) fn in_site(&self, point_in_rover: &Point3) -> Point3 {
        self.site_from_rover * point_in_rover
    }
}

/// The path of an entity for the run called `root`.
pub(super) fn path(entity: &str, root: &str) -> String {
    entity.replace("{target}", root)
}

/// Logs how a scalar is drawn, once and for all steps: every step by itself, because the viewer would otherwise
/// draw the mean of neighbours where a plot is small, and a lost step between good ones would look half good.
pub(super) fn log_series(
    stream: &RecordingStream,
    path: &str,
    name: &str,
    color: rerun::Color,
    width: f32,
) -> Logged {
    let series = SeriesLines::new().with_names([name]).with_colors([color]).with_widths([width]);
    stream.log_static(path, &series.with_aggregation_policy(AggregationPolicy::Off))
}
