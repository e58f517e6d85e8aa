//! Which rows are still to be logged: a recording takes every step of every run once, in whatever order they
//! come, and the images of a stop once for all runs.

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

/// One run: which it is, and its steps.
#[derive(Clone, Copy, Debug)]
pub struct RunLog<'a> {
    /// The target's number, from 0.
    pub target: usize,
    /// The run's number within the target, from 0.
    pub run: usize,
    /// What the person calls the target.
    pub label: &'a str,
    /// Its steps so far.
    pub steps: &'a [Arc<RunStep>],
}

impl RunLog<'_> {
    /// What the run is called in the recording: its target's label, with the number of a forked run.
    fn title(&self) -> String {
        if self.run == 0 { self.label.to_owned() } else { format!("{}, run {}", self.label, self.run) }
    }
}

/// A recording that is being written.
pub(super) struct Recorder {
    stream: RecordingStream,
    /// Whether a viewer should follow the newest step.
    live: bool,
    /// Stops of the traverse that are in the recording; a drive on commands gains more.
    stop_count: usize,
    /// Stops and cameras whose images are in the recording.
    captured: BTreeSet<(usize, Option<CameraName>)>,
    /// Steps whose odometry is in the recording.
    measured: BTreeSet<usize>,
    /// The pairs whose odometry the layout shows.
    odometry: BTreeSet<Option<CameraName>>,
    /// Stops whose decision is in the recording.
    decided: BTreeSet<usize>,
    /// The runs by their names in paths.
    runs: BTreeMap<String, Known>,
}

/// A run that was made known.
struct Known {
    /// The steps that are in the recording.
    steps: BTreeSet<usize>,
    /// Where the target was designated, in the site frame.
    position_in_site: Point3,
    /// Width and height of the subframe, px.
    close_up_px: [u32; 2],
    /// Whether its tracker asks for the shape.
    has_shape: bool,
    /// The pair in which its target is tracked.
    camera: Option<CameraName>,
}

impl Known {
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

/// What every recording of ours begins with. The environment cannot switch it off: a person asked for it.
///
/// # Errors
/// As [`check_clock`].
pub(super) fn builder(name: &str) -> Result<RecordingStreamBuilder> {
    check_clock(SystemTime::now())?;
    Ok(RecordingStreamBuilder::new("sightline").recording_name(name).enabled(true))
}

/// Refuses a clock before 1970, at which rerun panics: a recording holds the time at which it was made.
///
/// # Errors
/// [`Error::Request`].
fn check_clock(now: SystemTime) -> Result<()> {
    let is_held = now.duration_since(SystemTime::UNIX_EPOCH).is_ok();
    let problem =
        "the clock of this computer is before 1970, which a rerun recording cannot hold: set the clock";
    is_held.then_some(()).ok_or_else(|| Error::Request(problem.to_owned()))
}

impl Recorder {
    /// A recording into `stream`; its rows carry no clock time, only the step and the traverse's own time.
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

    /// Logs what does not depend on any run: all of it the first time, later the stops that are new.
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

    /// Logs the decisions of a drive that are new.
    pub(super) fn log_drive(&mut self, drive: &DriveLog, stops: &dyn Stops) -> Logged {
        for cycle in &drive.cycles {
            if self.decided.insert(cycle.step) {
                self.set_time(cycle.step, stops);
                drive.log(&self.stream, cycle, &stops.site_from_rover(cycle.step))?;
            }
        }
        Ok(())
    }

    /// Makes runs known, so that a viewer lays them out; those already known cost nothing.
    pub(super) fn log_runs(&mut self, runs: &[RunLog<'_>], stops: &dyn Stops) -> Logged {
        let known = self.runs.len();
        for run in runs {
            let root = root(run.target, run.run);
            let Some(first) = run.steps.first().filter(|_| !self.runs.contains_key(&root)) else { continue };
            states::log_run(&self.stream, &root, &run.title(), first)?;
            states::log_styles(&self.stream, &root)?;
            scores::log_styles(&self.stream, &root)?;
            self.runs.insert(root, Known::new(first));
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

    /// Logs one step of a run that was made known, unless it is in the recording already.
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
        // Last: those in which the motion was measured are there by now.
        self.log_images_at_hand(stops, trace.step, camera)
    }

    /// Logs the images of the cameras beside the main pair and `tracked` that are there without being rendered.
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

/// The side of the template; 0 where none was prepared.
fn template_size_px(trace: &RunStep) -> u32 {
    let prepared = trace.template().and_then(|evidence| evidence.scale_roll.as_ref());
    prepared.and_then(|prepared| prepared.reference.get()).map_or(0, |reference| reference.width())
}

/// The images of a step. Those of a run that was read back from disk are not in the trace and come from the
/// traverse.
fn images(trace: &RunStep, stops: &dyn Stops) -> Option<[Arc<GrayImage>; 2]> {
    let kept = trace.capture()?.pair.clone();
    let camera = trace.update.target.designation.camera;
    let read = || pair::capture(stops, trace.step, camera, Cancel::default()).ok();
    let pair = if kept.left.width() > 0 { kept } else { read()? };
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
