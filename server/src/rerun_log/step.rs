//! One step of one run on its way into a recording: where its rows go, and what the `log_*` functions read.

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
use super::border::ellipsoids;
use super::palette::{Rgb, color, faint};

/// One step of one run.
pub(super) struct Step<'a> {
    /// Where the rows go.
    pub(super) stream: &'a RecordingStream,
    /// The run's name in entity paths.
    pub(super) root: &'a str,
    /// What the person calls the run.
    pub(super) label: &'a str,
    /// What the stages saw and decided.
    pub(super) trace: &'a RunStep,
    /// The marks over its images.
    pub(super) marks: Vec<Mark>,
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

    /// The pair in which the target is tracked.
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

    /// The shape of a mark over the images, where the step has it.
    pub(super) fn mark(&self, name: MarkName) -> Option<&Shape> {
        self.marks.iter().find(|mark| mark.name == name).map(|mark| &mark.shape)
    }

    /// A point of the present rover frame in the site frame of the estimated pose.
    pub(super) fn in_site(&self, point_in_rover: &Point3) -> Point3 {
        self.site_from_rover * point_in_rover
    }

    /// The ellipsoids of a covariance in the rover frame, turned into the site frame.
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
