//! One step of one run as input of the `log_*` functions.

use std::sync::Arc;

use nalgebra::Matrix3;
use rerun::components::AggregationPolicy;
use rerun::{AsComponents, Clear, Color, Ellipsoids3D, RecordingStream, SeriesLines};
use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::{Point3, Pose};
use sightline_session::marks::{Mark, MarkName, Shape};
use sightline_session::step::RunStep;
use sightline_track::locate::features::FeatureEvidence;
use sightline_track::locate::template::TemplateEvidence;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_vision::image::GrayImage;

use super::Logged;
use super::convert::ellipsoids;
use super::palette::{Rgb, color, faint};

/// One step of one run.
pub(super) struct Step<'a> {
    /// The recording.
    pub(super) stream: &'a RecordingStream,
    /// The run's name in entity paths.
    pub(super) root: &'a str,
    /// The user's label of the run.
    pub(super) label: &'a str,
    /// The record of the stages.
    pub(super) trace: &'a RunStep,
    /// The marks over its images.
    pub(super) marks: Vec<Mark>,
    /// The left and the right image of the stop; `None` if they could not be read or are already logged.
    pub(super) images: Option<[Arc<GrayImage>; 2]>,
    /// The estimated pose of the stop.
    pub(super) site_from_rover: Pose,
}

impl Step<'_> {
    /// Logs `value` at this step. Without a value the entity is cleared, because a viewer would continue to show the last
    /// step's value.
    pub(super) fn log<A: AsComponents>(&self, entity: &str, value: Option<A>) -> Logged {
        let path = path(entity, self.root);
        match value {
            Some(value) => self.stream.log(path, &value),
            None => self.stream.log(path, &Clear::flat()),
        }
    }

    /// The pair used for tracking the target; `None` for the main pair.
    pub(super) fn camera(&self) -> Option<CameraName> {
        self.trace.update.target.designation.camera
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

    /// The shape of a mark; `None` if the step does not have it.
    pub(super) fn mark(&self, name: MarkName) -> Option<&Shape> {
        self.marks.iter().find(|mark| mark.name == name).map(|mark| &mark.shape)
    }

    /// Transforms a point from the rover frame of this step to the site frame, with the estimated pose.
    pub(super) fn in_site(&self, point_in_rover: &Point3) -> Point3 {
        self.site_from_rover * point_in_rover
    }

    /// The ellipsoids of a covariance in the rover frame, rotated to the site frame.
    pub(super) fn spread(
        &self,
        point_in_rover: &Point3,
        covariance: &Matrix3<f64>,
        rgb: Rgb,
    ) -> Option<Ellipsoids3D> {
        let turn = self.site_from_rover.rotation.to_rotation_matrix();
        let covariance_in_site = turn.matrix() * covariance * turn.matrix().transpose();
        let colors: [Color; 2] = [color(rgb), faint(rgb, 110)];
        ellipsoids(&self.in_site(point_in_rover), &covariance_in_site, colors)
    }
}

/// The path of an entity for the run with path name `root`.
pub(super) fn path(entity: &str, root: &str) -> String {
    entity.replace("{target}", root)
}

/// Logs the drawing style of a scalar as static data. Aggregation is off: the viewer would otherwise draw the mean of
/// neighbours in a small plot, and a lost step between good ones would look half good.
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
