//! One step, on one page: the six stages in order, as a pure function.
//!
//! ```text
//! designate:   capture → locate (stereo only) → target
//! run_step:    predict → point_mast → capture → locate → judge → update
//! ```
//! The comparison with the ground truth is not a stage: `session::track` adds it to the record. Everything is a function
//! of the traverse, the target after the previous stop, and the settings: going back is a read.

use std::borrow::Cow;

use sightline_geometry::camera::{Camera, CameraName, Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Pose};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate::store::Shared;
use sightline_track::locate::{self, DesignateInput, LocateInput, Located, Place, TrackerMemory};
use sightline_track::settings::Settings;
use sightline_track::stages::capture::{self, Capture, StereoPair};
use sightline_track::stages::judge;
use sightline_track::stages::predict;
use sightline_track::stages::update::{self, Updated};
use sightline_track::target::{Designation, Target, TrackingState};
use sightline_track::trace::{StepKind, StepTrace};

use crate::begun::Begun;
use crate::pair::{self, FurtherCamera, FurtherImages, StopPair};
use crate::sight::{is_another_look, not_searched, pointing};
use crate::visual_odometry::{MeasuredMotion, pose_change_error};

/// The stops of a drive, as input of the stages.
pub trait Stops {
    /// Number of stops.
    fn stop_count(&self) -> usize;
    /// Time since the first stop, s.
    fn time_s(&self, step: usize) -> f64;
    /// The estimated pose.
    fn site_from_rover(&self, step: usize) -> Pose;
    /// The left and right camera in the rover frame, at the pointing in use.
    fn cameras(&self, step: usize) -> (&Camera, &Camera);
    /// The mast, if known.
    fn mast(&self) -> Option<&Mast>;
    /// The mast angles in use; `None` if unknown or without a mast.
    fn mast_angles(&self, step: usize) -> Option<MastAngles>;
    /// The error model of the pose estimates by wheels, gyro and accelerometers.
    fn odometry_error(&self) -> OdometryError;
    /// Visual odometry's measurement of the motion to a stop; `None` without one.
    fn measured_motion(&self, _step: usize) -> Option<&MeasuredMotion> {
        None
    }
    /// Whether only visual odometry runs at a stop of a drive: the tracker does not search for its target there.
    fn is_odometry_alone(&self, _step: usize) -> bool {
        false
    }
    /// Whether the cameras on the mast delivered no images at a stop.
    fn has_dropped_out(&self, _step: usize) -> bool {
        false
    }
    /// The target at which the mast was pointed at a stop; `None` if there was none or it is unknown.
    fn mast_target(&self, _step: usize) -> Option<Designation> {
        None
    }
    /// 1σ error of each mast angle, deg; 0 if unknown.
    fn pointing_error_deg(&self) -> f64;
    /// Geometric relation of the two images of a stop.
    fn stereo(&self) -> StereoGeometry;
    /// The store of results shared by the targets of the traverse, with this stop's index in the recording.
    fn shared(&self, _step: usize) -> Option<Shared<'_>> {
        None
    }
    /// The stereo pair.
    ///
    /// # Errors
    /// An error that names the missing or damaged file, or [`Error::Cancelled`] soon after `cancel` is requested.
    fn capture(&self, step: usize, cancel: Cancel<'_>) -> Result<StereoPair>;
    /// The cameras of a stop beside its main pair.
    fn further_cameras(&self, _step: usize) -> Vec<FurtherCamera<'_>> {
        Vec::new()
    }
    /// The images of such a camera; `None` if they cannot be read, or would have to be rendered first.
    fn images_at_hand(&self, _step: usize, _name: CameraName) -> Option<FurtherImages> {
        None
    }
    /// A pair beside the main one.
    ///
    /// # Errors
    /// A stop without a pair of this name ([`pair::missing`], [`pair::single`]).
    fn further_pair(&self, step: usize, name: CameraName) -> Result<StopPair<'_>> {
        Err(pair::missing(step, name))
    }
    /// The images of a pair beside the main one.
    ///
    /// # Errors
    /// As [`Self::capture`] and [`Self::further_pair`].
    fn capture_further(&self, step: usize, name: CameraName, _cancel: Cancel<'_>) -> Result<StereoPair> {
        Err(pair::missing(step, name))
    }
}

/// The first step of a run: the 3-D position and template of a designated pixel (R16, R19).
///
/// # Errors
/// [`Error::Target`] when the pixel or step does not exist or no 3-D position is found; file errors of the stop.
pub fn designate(stops: &dyn Stops, designation: Designation, settings: &Settings) -> Result<StepTrace> {
    designate_until(stops, designation, settings, Cancel::default())
}

/// [`designate`], cancellable.
///
/// # Errors
/// As [`designate`], and [`Error::Cancelled`].
pub fn designate_until(
    stops: &dyn Stops,
    designation: Designation,
    settings: &Settings,
    cancel: Cancel<'_>,
) -> Result<StepTrace> {
    let step = designation.step;
    if step >= stops.stop_count() {
        return Err(Error::Target(format!(
            "step {step} does not exist: the traverse has {} stops",
            stops.stop_count()
        )));
    }
    cancel.check()?;
    let (capture, located, memory) = designated(stops, designation, settings, cancel)?;
    cancel.check()?;
    let pair = pair::of_stop(stops, step, designation.camera)?;
    let target = first_target(stops, designation, &pair, &located, memory)?;
    let pointing = pointing(stops, Some(&pair), &target);
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
        point_mast: pointing,
        kind: StepKind::Designation { capture, locate: located },
        update,
    })
}

/// Finds the position of a designated pixel with the tracker of the settings.
fn designated(
    stops: &dyn Stops,
    designation: Designation,
    settings: &Settings,
    cancel: Cancel<'_>,
) -> Result<(Capture, Located, Option<TrackerMemory>)> {
    let step = designation.step;
    let pair = pair::of_stop(stops, step, designation.camera).map_err(pair::as_target)?;
    let pixel = check_pixel(designation, pair.left)?;
    let images = pair::capture(stops, step, designation.camera, cancel)?;
    let capture = capture::capture(images, Some(pixel), settings.subframe_px());
    let (located, memory) = locate::designate(&DesignateInput {
        step,
        site_from_rover: &stops.site_from_rover(step),
        pixel,
        capture: &capture,
        left: pair.left,
        right: pair.right,
        stereo: stops.stereo(),
        shared: pair.shared,
        settings,
        cancel,
    });
    Ok((capture, located, memory))
}

/// One later step of a run: finds the target `last` again at the next stop.
pub fn run_step(stops: &dyn Stops, last: &Updated, settings: &Settings) -> StepTrace {
    computed_step(stops, last, settings, &StepChanges::default(), Cancel::default())
}

/// Changes and callbacks of a step that the user requests.
#[derive(Clone, Copy, Default)]
pub struct StepChanges<'a> {
    /// Pixel of the left image to which the prediction is moved, px; `None` for dead reckoning's.
    pub prediction_px: Option<Pixel>,
    /// First stage that is not computed, from `point_mast` to `update`; `None` for the whole step.
    pub before: Option<CycleStage>,
    /// Called at the end of every stage, to measure its time; stages have no clock.
    pub ended: Option<&'a dyn Fn(CycleStage)>,
}

impl StepChanges<'_> {
    /// Reports the end of a stage; returns whether the step is paused after it.
    fn end(&self, stage: CycleStage) -> bool {
        self.ended.iter().for_each(|ended| ended(stage));
        stage.next().is_some_and(|next| self.before.is_some_and(|before| before <= next))
    }
}

/// [`run_step`] with a displaced prediction, or paused.
///
/// A step paused before a stage has the results of the whole step's earlier stages. The mast and the images of the stop
/// are not used before their stages. A stop with damaged files is complete after `capture`.
///
/// # Errors
/// [`Error::Cancelled`] soon after `cancel` is requested.
pub fn run_step_changed(
    stops: &dyn Stops,
    last: &Updated,
    settings: &Settings,
    changes: &StepChanges<'_>,
    cancel: Cancel<'_>,
) -> Result<StepTrace> {
    cancel.check()?;
    let trace = computed_step(stops, last, settings, changes, cancel);
    cancel.check()?;
    Ok(trace)
}

/// The step; its value is meaningless once `cancel` is requested.
fn computed_step(
    stops: &dyn Stops,
    last: &Updated,
    settings: &Settings,
    changes: &StepChanges<'_>,
    cancel: Cancel<'_>,
) -> StepTrace {
    let target = &*with_own_memory(stops, &last.target, settings, cancel);
    let (step, camera) = (target.step + 1, target.designation.camera);
    let (site_from_rover, time_s) = (stops.site_from_rover(step), stops.time_s(step));
    let lacks_pair = |error| format!("{error}, which the target was designated in");
    let pair = pair::of_stop(stops, step, camera).map_err(lacks_pair);
    let prediction =
        prediction(stops, target, pair.as_ref().ok().map(|pair| pair.left).zip(changes.prediction_px));
    let carried = update::carry(target, step, &prediction);
    changes.end(CycleStage::Predict);
    let pointing = pointing(stops, pair.as_ref().ok(), &carried);
    let begun = Begun { step, time_s, predict: &prediction, point_mast: &pointing, carried: &carried, last };
    if changes.end(CycleStage::PointMast) {
        return begun.trace(changes.before > Some(CycleStage::PointMast), None, None, None);
    }
    if let Some(trace) = not_searched(stops, pair.as_ref().ok(), target, &begun) {
        return trace;
    }
    let images = |pair| pair::capture(stops, step, camera, cancel).map(|images| (pair, images));
    let (pair, images) = match pair.and_then(|pair| images(pair).map_err(|error| error.to_string())) {
        Ok(captured) => captured,
        Err(fault) => return begun.damaged(fault),
    };
    let capture = capture::capture(images, pointing.predicted_left, settings.subframe_px());
    if changes.end(CycleStage::Capture) {
        return begun.trace(true, Some(capture), None, None);
    }
    let input = LocateInput {
        prediction: &prediction,
        pointing: &pointing,
        capture: &capture,
        site_from_rover: &site_from_rover,
        stereo: stops.stereo(),
        shared: pair.shared,
        place: place(stops, step, target.designation, settings),
        lost_count: lost_count(last.state),
        was_found: last.state == TrackingState::Tracking,
        settings,
        cancel,
    };
    let locate = locate::locate(&input, &target.memory);
    if changes.end(CycleStage::Locate) {
        return begun.trace(true, Some(capture), Some(locate), None);
    }
    let judge =
        judge::judge(target, &prediction, &pointing, &locate, &site_from_rover, last.state, &settings.limits);
    if changes.end(CycleStage::Judge) {
        return begun.trace(true, Some(capture), Some(locate), Some(judge));
    }
    let update = update::update(carried, &pointing, &capture, &locate, &judge, &site_from_rover, settings);
    changes.end(CycleStage::Update);
    let kind = StepKind::Tracked { predict: prediction, capture, locate, judge };
    StepTrace { step, time_s, point_mast: pointing, kind, update }
}

/// The predicted target at the next stop, or displaced to a pixel of the left camera of its pair.
fn prediction(
    stops: &dyn Stops,
    target: &Target,
    displaced_to: Option<(&Camera, Pixel)>,
) -> predict::Prediction {
    let step = target.step + 1;
    let [then, now] = [target.step, step].map(|step| stops.site_from_rover(step));
    let predicted = predict::predict(target, &then, &now, &pose_change_error(stops, step));
    let displaced = displaced_to.and_then(|(left, pixel)| predict::displaced(&predicted, left, pixel, &now));
    displaced.unwrap_or(predicted)
}

/// The target with a memory of the settings' tracker.
///
/// A run may change its tracker on the way. The new one cannot read the other's memory: it starts with the memory of a new
/// designation, and keeps the position from the other one. If it finds no position there, memory and tracker stay.
fn with_own_memory<'a>(
    stops: &dyn Stops,
    target: &'a Target,
    settings: &Settings,
    cancel: Cancel<'_>,
) -> Cow<'a, Target> {
    if target.memory.tracker() == settings.tracker {
        return Cow::Borrowed(target);
    }
    match designated(stops, target.designation, settings, cancel) {
        Ok((_, _, Some(memory))) => Cow::Owned(Target { memory, ..target.clone() }),
        _ => Cow::Borrowed(target),
    }
}

/// The target created by a designation.
fn first_target(
    stops: &dyn Stops,
    designation: Designation,
    pair: &StopPair<'_>,
    located: &Located,
    memory: Option<TrackerMemory>,
) -> Result<Target> {
    let Designation { step, pixel, camera } = designation;
    let (Some(position_in_rover), Some(covariance_in_rover), Some(memory)) =
        (located.position_in_rover, located.covariance_in_rover, memory)
    else {
        let why = located.missing.as_deref().unwrap_or("no 3-D position");
        return Err(Error::Target(format!(
            "no 3-D position at pixel ({:.1}, {:.1}): {why}",
            pixel.x, pixel.y
        )));
    };
    let used = pair.pointing(stops, camera);
    let covariance_in_rover = used
        .error_covariance(&position_in_rover)
        .map_or(covariance_in_rover, |error| covariance_in_rover + error);
    let distance_m = (position_in_rover - used.left.model.centre()).norm();
    Ok(Target {
        designation,
        step,
        position_in_rover,
        covariance_in_rover,
        initial_position_in_site: stops.site_from_rover(step) * position_in_rover,
        initial_distance_m: distance_m,
        travelled_m: 0.0,
        last_distance_m: distance_m,
        travelled_since_update_m: 0.0,
        memory,
    })
}

/// The designated pixel, if it is inside the left image.
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

/// The position of a stop in its drive.
fn place(stops: &dyn Stops, step: usize, designation: Designation, settings: &Settings) -> Place {
    let share = settings.limits.same_camera_focal_share;
    let left = |step: usize| pair::of_stop(stops, step, designation.camera).ok().map(|pair| pair.left);
    // A stop that lacks the pair does not count as a change.
    let changes =
        |from: usize, to: usize| left(from).zip(left(to)).is_some_and(|(a, b)| !is_same_pair(a, b, share));
    let is_last = step + 1 >= stops.stop_count();
    // If the mast was pointed at a target, the drive is a commanded one, whose last stop is not known in advance.
    let is_last_of_pair = match stops.mast_target(step) {
        Some(_) => is_another_look(stops, step, designation),
        None => is_last || changes(step, step + 1),
    };
    Place { step, is_hand_over: step > 0 && changes(step - 1, step), is_last_of_pair }
}

/// Whether two left cameras are the same one, regardless of pointing: equal image size and model, focal lengths that
/// differ by less than `share`.
fn is_same_pair(a: &Camera, b: &Camera, share: f64) -> bool {
    let focal_px = |camera: &Camera| camera.model.focal_length_px(camera.centre_pixel());
    let is_near = focal_px(a).zip(focal_px(b)).is_none_or(|(a, b)| (a / b - 1.0).abs() < share);
    a.size == b.size && std::mem::discriminant(&a.model) == std::mem::discriminant(&b.model) && is_near
}

fn lost_count(state: TrackingState) -> u32 {
    match state {
        TrackingState::Lost { count } => count,
        _ => 0,
    }
}
