//! Tracks which rows are in a recording: every step of every run is logged once, in any order, and the images of a stop once
//! for all runs.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::SystemTime;

use rerun::{RecordingStream, RecordingStreamBuilder, TextDocument};
use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Point3;
use sightline_rover::pair;
use sightline_rover::pipeline::Stops;
use sightline_session::marks::marks;
use sightline_session::step::RunStep;
use sightline_vision::image::GrayImage;

use super::blueprint::Lane;
use super::drive::DriveLog;
use super::images::log_further;
use super::map::Outlook;
use super::step::Step;
use super::{
    Logged, blueprint, log_odometry, log_step, log_stop, map, odometry, properties, root, scores, states,
};

/// One run with its steps.
#[derive(Clone, Copy, Debug)]
pub struct RunLog<'a> {
    /// The target's index, from 0.
    pub target: usize,
    /// The run's index within the target, from 0.
    pub run: usize,
    /// The user's label of the target.
    pub label: &'a str,
    /// Its steps so far.
    pub steps: &'a [Arc<RunStep>],
}

impl RunLog<'_> {
    /// The title of the run in the recording: its target's label, with the index of a forked run.
    fn title(&self) -> String {
        if self.run == 0 { self.label.to_owned() } else { format!("{}, run {}", self.label, self.run) }
    }
}

/// A recording that is being written.
pub(super) struct Recorder {
    stream: RecordingStream,
    /// Whether a viewer should follow the newest step.
    live: bool,
    /// Number of stops in the recording; grows with a commanded drive.
    stop_count: usize,
    /// Stops and cameras whose images are in the recording.
    captured: BTreeSet<(usize, Option<CameraName>)>,
    /// Steps whose odometry is in the recording.
    measured: BTreeSet<usize>,
    /// The pairs with odometry in the layout.
    odometry: BTreeSet<Option<CameraName>>,
    /// Stops whose decision is in the recording.
    decided: BTreeSet<usize>,
    /// The runs by path name.
    runs: BTreeMap<String, LoggedRun>,
}

/// A run that is part of the recording.
struct LoggedRun {
    /// The steps that are in the recording.
    steps: BTreeSet<usize>,
    /// Position of the designated target, site frame, m.
    position_in_site: Point3,
    /// Width and height of the subframe, px.
    close_up_px: [u32; 2],
    /// Whether it uses the shape tracker.
    has_shape: bool,
    /// The pair used for tracking its target; `None` for the main pair.
    camera: Option<CameraName>,
}

impl LoggedRun {
    fn new(first: &RunStep) -> Self {
        let subframe = first.capture().and_then(|capture| capture.subframe);
        Self {
            steps: BTreeSet::new(),
            position_in_site: first.update.target.initial_position_in_site,
            close_up_px: subframe.map_or([161; 2], |rect| [rect.width, rect.height]),
            has_shape: first.shape().is_some(),
            camera: first.update.target.designation.camera,
        }
    }
}

/// Starts the builder of a recording. Always enabled, regardless of rerun's environment variables, because the user
/// requested the recording.
///
/// # Errors
/// As [`check_clock`].
pub(super) fn builder(name: &str) -> Result<RecordingStreamBuilder> {
    check_clock(SystemTime::now())?;
    Ok(RecordingStreamBuilder::new("sightline").recording_name(name).enabled(true))
}

/// Rejects a clock before 1970, at which rerun panics: a recording contains its creation time.
///
/// # Errors
/// [`Error::Request`].
fn check_clock(now: SystemTime) -> Result<()> {
    let is_valid = now.duration_since(SystemTime::UNIX_EPOCH).is_ok();
    let problem =
        "the clock of this computer is before 1970, which a rerun recording cannot hold: set the clock";
    is_valid.then_some(()).ok_or_else(|| Error::Request(problem.to_owned()))
}

impl Recorder {
    /// A recording into `stream`; its rows have no wall-clock time, only the step and the traverse's own time.
    pub(super) fn new(stream: RecordingStream, live: bool) -> Self {
        stream.set_log_time_enabled(false);
        Self {
            stream,
            live,
            stop_count: 0,
            captured: BTreeSet::new(),
            measured: BTreeSet::new(),
            odometry: BTreeSet::new(),
            decided: BTreeSet::new(),
            runs: BTreeMap::new(),
        }
    }

    /// Logs the data that are independent of runs: everything on the first call, then new stops only.
    pub(super) fn log_traverse(&mut self, name: &str, stops: &dyn Stops) -> Logged {
        let count = stops.stop_count();
        let before = std::mem::replace(&mut self.stop_count, count);
        if before >= count {
            return Ok(());
        }
        if before == 0 {
            self.stream.send_recording_name(name)?;
            properties::send(&self.stream, name)?;
            map::log_site_axes(&self.stream)?;
        }
        let about = format!("# {name}\n{count} stops. Frames: site x north, y east, z down.");
        self.stream.log_static("/traverse", &TextDocument::from_markdown(about))?;
        map::log_path(&self.stream, stops)?;
        (before..count).try_for_each(|step| {
            self.set_time(step, stops);
            log_stop(&self.stream, stops, step)
        })
    }

    /// Logs the new decisions of a drive.
    pub(super) fn log_drive(&mut self, drive: &DriveLog, stops: &dyn Stops) -> Logged {
        for cycle in &drive.cycles {
            if self.decided.insert(cycle.step) {
                self.set_time(cycle.step, stops);
                drive.log(&self.stream, cycle, &stops.site_from_rover(cycle.step))?;
            }
        }
        Ok(())
    }

    /// Adds new runs to the recording and its layout.
    pub(super) fn log_runs(&mut self, runs: &[RunLog<'_>], stops: &dyn Stops) -> Logged {
        let known = self.runs.len();
        for run in runs {
            let root = root(run.target, run.run);
            let Some(first) = run.steps.first().filter(|_| !self.runs.contains_key(&root)) else { continue };
            states::log_run(&self.stream, &root, &run.title(), first)?;
            states::log_styles(&self.stream, &root)?;
            scores::log_styles(&self.stream, &root)?;
            self.runs.insert(root, LoggedRun::new(first));
        }
        let odometry = odometry::cameras(stops);
        if self.runs.len() == known && self.odometry == odometry {
            return Ok(());
        }
        self.odometry = odometry;
        let lanes = self.runs.iter().map(|(root, known)| Lane {
            root,
            close_up_px: known.close_up_px,
            has_shape: known.has_shape,
            camera: known.camera,
        });
        let lanes: Vec<_> = lanes.collect();
        let Some(first) = self.runs.values().next() else { return Ok(()) };
        let outlook = Outlook::over(stops, &first.position_in_site);
        blueprint::send(&self.stream, &lanes, &outlook, (&self.odometry, self.live))
    }

    /// Logs one step of a known run, unless it is already in the recording.
    pub(super) fn log_step(&mut self, run: &RunLog<'_>, stops: &dyn Stops, trace: &RunStep) -> Logged {
        let root = root(run.target, run.run);
        if !self.runs.get_mut(&root).is_some_and(|known| known.steps.insert(trace.step)) {
            return Ok(());
        }
        self.set_time(trace.step, stops);
        let camera = trace.update.target.designation.camera;
        let is_first_here = self.captured.insert((trace.step, camera));
        let step = Step {
            stream: &self.stream,
            root: &root,
            label: &run.title(),
            trace,
            marks: marks(trace, template_size_px(trace)),
            images: if is_first_here { images(trace, stops) } else { None },
            site_from_rover: stops.site_from_rover(trace.step),
        };
        log_step(&step, is_first_here)?;
        if self.measured.insert(trace.step) {
            log_odometry(&self.stream, stops, trace)?;
        }
        // Last, because by this time the images used by odometry exist.
        self.log_images_at_hand(stops, trace.step, camera)
    }

    /// Logs the existing images of further cameras except `tracked`, without rendering.
    fn log_images_at_hand(&mut self, stops: &dyn Stops, step: usize, tracked: Option<CameraName>) -> Logged {
        for name in stops.further_cameras(step).iter().map(|camera| camera.name) {
            if Some(name) == tracked || self.captured.contains(&(step, Some(name))) {
                continue;
            }
            if let Some(found) = stops.images_at_hand(step, name) {
                self.captured.insert((step, Some(name)));
                log_further(&self.stream, name, &found)?;
            }
        }
        Ok(())
    }

    /// Whether a step of a run is in the recording.
    pub(super) fn has(&self, run: &RunLog<'_>, trace: &RunStep) -> bool {
        self.runs.get(&root(run.target, run.run)).is_some_and(|known| known.steps.contains(&trace.step))
    }

    fn set_time(&self, step: usize, stops: &dyn Stops) {
        self.stream.set_time_sequence("step", step as i64);
        self.stream.set_duration_secs("time", stops.time_s(step));
    }
}

/// The side of the template, px; 0 if none was prepared.
fn template_size_px(trace: &RunStep) -> u32 {
    let prepared = trace.template().and_then(|evidence| evidence.scale_roll.as_ref());
    prepared.and_then(|prepared| prepared.reference.get()).map_or(0, |reference| reference.width())
}

/// The images of a step. A run restored from disk has none in its trace; they are then read from the traverse.
fn images(trace: &RunStep, stops: &dyn Stops) -> Option<[Arc<GrayImage>; 2]> {
    let held = trace.capture()?.pair.clone();
    let camera = trace.update.target.designation.camera;
    let read = || pair::capture(stops, trace.step, camera, Cancel::default()).ok();
    let pair = if held.left.width() > 0 { held } else { read()? };
    Some([pair.left, pair.right])
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn clock_before_1970_is_refused() {
        assert!(check_clock(SystemTime::now()).is_ok());
        let before = SystemTime::UNIX_EPOCH - Duration::from_secs(1);
        assert!(check_clock(before).unwrap_err().to_string().contains("set the clock"));
    }
}
