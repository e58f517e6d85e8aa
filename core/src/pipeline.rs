//! One step, on one page: the six stages in running order, from values to a value.
//!
//! ```text
//! designate:   capture → locate (stereo only) → target
//! run_step:    predict → point_mast → capture → locate → judge → update
//! ```
//! The comparison with the truth is not a stage: `session::track` adds it to the record.
//! Everything is a function of the traverse, the target as the last stop left it, and the settings: the same
//! input gives the same bits, and going back is a read of what was recorded.

use std::sync::Arc;

use crate::camera::{Camera, Mast, MastAngles};
use crate::error::{Error, Result};
use crate::frames::{Pixel, Pose};
use crate::locate::features::anchor::Anchors;
use crate::locate::shape_tracker::view::Views;
use crate::locate::store::Shared;
use crate::locate::{DesignateInput, LocateInput, Located, Place, locator};
use crate::settings::Settings;
use crate::stages::capture::{self, Capture, StereoPair};
use crate::stages::judge::{self, Verdict};
use crate::stages::point_mast::{self, Pointing, UsedPointing};
use crate::stages::predict;
use crate::stages::update::{self, Updated};
use crate::target::{Appearance, Designation, Memory, Target, TrackingState};
use crate::trace::StepTrace;
use crate::traverse::{OdometryError, StereoGeometry};

/// The stops of a drive, as the stages see them.
pub trait Stops {
    /// How many stops there are.
    fn stop_count(&self) -> usize;
    /// Time since the first stop, s.
    fn time_s(&self, step: usize) -> f64;
    /// The estimated pose.
    fn site_from_rover(&self, step: usize) -> Pose;
    /// The left and right camera in the rover frame, at the pointing in use.
    fn cameras(&self, step: usize) -> (&Camera, &Camera);
    /// The mast, where it is known.
    fn mast(&self) -> Option<&Mast>;
    /// The mast angles in use.
    fn mast_angles(&self, step: usize) -> Option<MastAngles>;
    /// The error model of the pose estimates.
    fn odometry_error(&self) -> OdometryError;
    /// How the two images of a stop relate.
    fn stereo(&self) -> StereoGeometry;
    /// Where the targets of the traverse keep what they share, and which stop of the recording this one is.
    fn shared(&self, _step: usize) -> Option<Shared<'_>> {
        None
    }
    /// The stereo pair.
    ///
    /// # Errors
    /// A sentence that names the missing or damaged file.
    fn capture(&self, step: usize) -> Result<StereoPair>;
}

/// The first step of a run: the 3-D position and template of a designated pixel (R16, R19).
///
/// # Errors
/// [`Error::Target`] when the pixel or step does not exist or no 3-D position is found; file errors of the stop.
pub fn designate(stops: &dyn Stops, designation: Designation, settings: &Settings) -> Result<StepTrace> {
    let step = designation.step;
    if step >= stops.stop_count() {
        return Err(Error::Target(format!(
            "step {step} does not exist: the traverse has {} stops",
            stops.stop_count()
        )));
    }
    let (left, right) = stops.cameras(step);
    let pixel = check_pixel(designation, left)?;
    let pair = stops.capture(step)?;
    let capture = capture::capture(pair, Some(pixel), settings.template.subframe_px);
    let (stereo, shared) = (stops.stereo(), stops.shared(step));
    let input = DesignateInput {
        step,
        site_from_rover: &stops.site_from_rover(step),
        pixel,
        capture: &capture,
        left,
        right,
        stereo,
        shared,
        settings,
    };
    let located = locator(settings.tracker).designate(&input);
    let target = first_target(stops, designation, &capture, &located)?;
    let pointing = pointing(stops, step, &target);
    let update = Updated {
        target,
        state: TrackingState::Tracking,
        template_renewed: true,
        correction_m: None,
        correction_px: None,
    };
    Ok(StepTrace {
        step,
        time_s: stops.time_s(step),
        fault: None,
        predict: None,
        point_mast: Some(pointing),
        capture: Some(capture),
        locate: Some(located),
        judge: None,
        update,
        truth: None,
    })
}

/// One later step of a run: what `last` left behind is found again at the next stop.
pub fn run_step(stops: &dyn Stops, last: &Updated, settings: &Settings) -> StepTrace {
    run_step_displaced(stops, last, settings, None)
}

/// The same from a prediction that a person put at a pixel of the left image, where they did.
pub fn run_step_displaced(
    stops: &dyn Stops,
    last: &Updated,
    settings: &Settings,
    prediction_px: Option<Pixel>,
) -> StepTrace {
    let (target, step) = (&last.target, last.target.step + 1);
    let site_from_rover = stops.site_from_rover(step);
    let prediction = prediction(stops, target, prediction_px);
    let carried = update::carry(target, step, &prediction);
    let pointing = pointing(stops, step, &carried);
    let mut trace = StepTrace {
        predict: Some(prediction.clone()),
        point_mast: Some(pointing.clone()),
        ..unseen(step, stops.time_s(step), carried.clone(), last.state)
    };
    match stops.capture(step) {
        Err(error) => trace.fault = Some(error.to_string()),
        Ok(pair) => {
            let captured = capture::capture(pair, pointing.predicted_left, settings.template.subframe_px);
            let now_from_template = site_from_rover.inverse() * stops.site_from_rover(target.appearance.step);
            let located = locator(settings.tracker).locate(&LocateInput {
                target,
                prediction: &prediction,
                pointing: &pointing,
                capture: &captured,
                now_from_template: &now_from_template,
                site_from_rover: &site_from_rover,
                stereo: stops.stereo(),
                shared: stops.shared(step),
                place: place(stops, step),
                lost_count: lost_count(last.state),
                settings,
            });
            let verdict: Verdict = judge::judge(
                target,
                &prediction,
                &pointing,
                &located,
                &site_from_rover,
                last.state,
                &settings.limits,
            );
            trace.update =
                update::update(carried, &pointing, &captured, &located, &verdict, &site_from_rover, settings);
            (trace.capture, trace.locate, trace.judge) = (Some(captured), Some(located), Some(verdict));
        }
    }
    trace
}

/// Where the target should be at the next stop, perhaps displaced.
fn prediction(stops: &dyn Stops, target: &Target, prediction_px: Option<Pixel>) -> predict::Prediction {
    let step = target.step + 1;
    let [then, now] = [target.step, step].map(|step| stops.site_from_rover(step));
    let predicted = predict::predict(target, &then, &now, &stops.odometry_error());
    let left = stops.cameras(step).0;
    let displaced = prediction_px.and_then(|pixel| predict::displaced(&predicted, left, pixel, &now));
    displaced.unwrap_or(predicted)
}

/// A stop before anything was seen of it: the target is where the prediction puts it.
fn unseen(step: usize, time_s: f64, carried: Target, state: TrackingState) -> StepTrace {
    StepTrace {
        step,
        time_s,
        fault: None,
        predict: None,
        point_mast: None,
        capture: None,
        locate: None,
        judge: None,
        update: Updated {
            target: carried,
            state,
            template_renewed: false,
            correction_m: None,
            correction_px: None,
        },
        truth: None,
    }
}

/// The target that a designation makes.
fn first_target(
    stops: &dyn Stops,
    designation: Designation,
    capture: &Capture,
    located: &Located,
) -> Result<Target> {
    let Designation { step, pixel } = designation;
    let (Some(position_in_rover), Some(covariance_in_rover)) =
        (located.position_in_rover, located.covariance_in_rover)
    else {
        let why = located.missing.as_deref().unwrap_or("no 3-D position");
        return Err(Error::Target(format!(
            "no 3-D position at pixel ({:.1}, {:.1}): {why}",
            pixel.x, pixel.y
        )));
    };
    let (left, _) = stops.cameras(step);
    let distance_m = (position_in_rover - left.model.centre()).norm();
    let appearance = Appearance {
        step,
        pixel,
        position_in_rover,
        surface_by_pixel: located.surface_by_pixel,
        relief: located.evidence.template().and_then(|e| e.relief.clone()),
        camera: left.clone(),
        site_from_rover: stops.site_from_rover(step),
        image: Arc::clone(&capture.pair.left),
    };
    let mut target = Target {
        designation,
        step,
        position_in_rover,
        covariance_in_rover,
        initial_position_in_site: stops.site_from_rover(step) * position_in_rover,
        initial_distance_m: distance_m,
        travelled_m: 0.0,
        last_distance_m: distance_m,
        travelled_since_update_m: 0.0,
        drift: located.left_error,
        appearance,
        memory: Memory::default(),
        anchors: Anchors::default(),
        views: Views::default(),
    };
    if let Some(view) = located.evidence.shape().and_then(|evidence| evidence.view.clone()) {
        target.views = target.views.with(view);
    }
    if let Some(anchor) = update::anchor(&target, located, &target.appearance.site_from_rover) {
        target.anchors = target.anchors.with(anchor, 1);
    }
    Ok(target)
}

/// The designated pixel, if the left image has it.
fn check_pixel(designation: Designation, left: &Camera) -> Result<Pixel> {
    let pixel = designation.pixel;
    if pixel.x.is_finite() && pixel.y.is_finite() && pixel.is_inside(left.width(), left.height()) {
        return Ok(pixel);
    }
    Err(Error::Target(format!(
        "pixel ({}, {}) lies outside the left image of {} x {} pixels",
        pixel.x,
        pixel.y,
        left.width(),
        left.height()
    )))
}

/// Cameras and wanted pointing for a target that was carried to `step`.
fn pointing(stops: &dyn Stops, step: usize, carried: &Target) -> Pointing {
    let (left, right) = stops.cameras(step);
    let used = UsedPointing { mast: stops.mast(), angles: stops.mast_angles(step), left, right };
    point_mast::point_mast(&carried.position_in_rover, &carried.covariance_in_rover, used)
}

/// A stop among those of its drive.
fn place(stops: &dyn Stops, step: usize) -> Place {
    let changes = |from: usize, to: usize| !is_same_pair(stops.cameras(from).0, stops.cameras(to).0);
    let is_last = step + 1 >= stops.stop_count();
    Place {
        step,
        is_hand_over: step > 0 && changes(step - 1, step),
        is_last_of_pair: is_last || changes(step, step + 1),
    }
}

/// Whether two left cameras are the same one, however it points: image size, kind of model and focal length.
fn is_same_pair(a: &Camera, b: &Camera) -> bool {
    let focal_px = |camera: &Camera| camera.model.focal_length_px(camera.centre_pixel());
    let is_near = focal_px(a).zip(focal_px(b)).is_none_or(|(a, b)| (a / b - 1.0).abs() < 0.02);
    a.size == b.size && std::mem::discriminant(&a.model) == std::mem::discriminant(&b.model) && is_near
}

fn lost_count(state: TrackingState) -> u32 {
    match state {
        TrackingState::Lost { count } => count,
        _ => 0,
    }
}
