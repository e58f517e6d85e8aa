//! Commanded drives: the worlds in which sessions drive. Each has its own folder, which grows stop by stop.
//!
//! An open drive is an ordinary [`OpenTraverse`]. After each stop, one with an additional stop replaces it in the list of
//! open drives and in its sessions; readers of the old one are not disturbed. The folder contains the whole state
//! (`sightline_recordings::driven`), so that a drive continues after a restart.

use std::path::Path;
use std::sync::{Arc, Mutex};

use sightline_api::event::Event;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{Cycle, DriveCommand, Ending, HazardMaps, OdometryPair, executive, odometry};
use sightline_rover::pipeline::Stops;
use sightline_session::Run;
use sightline_session::driving::{self, DriveView, Steering};
use sightline_session::hazard_view::HazardView;
use sightline_session::step::RunStep;
use sightline_session::stop_cause::Explained;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate::store::Cache;
use tokio::sync::broadcast;

use crate::cancel::CancelFlag;
use crate::folders::{Folders, make_private};
use crate::identity::Identity;
use crate::jobs::lock;
use crate::live_session::LiveSession;
use crate::naming::slug;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::rerun_log::DriveLog;
use crate::shared_world::SharedWorld;

/// The open traverses; those opened from a page are last.
pub(crate) type OpenTraverses = Arc<Mutex<Vec<Arc<OpenTraverse>>>>;

/// The world of a commanded drive.
pub(crate) struct CommandedDrive {
    world: Mutex<DrivenTraverse>,
    /// Hazard maps of the stops. Lock order: `maps`, `explained`, `world`.
    maps: Mutex<HazardMaps>,
    /// Why the drive stopped.
    explained: Mutex<Explained>,
    cache: Arc<Cache>,
}

impl CommandedDrive {
    /// Reads the world; the drive is locked meanwhile.
    pub(crate) fn with<T>(&self, look: impl FnOnce(&DrivenTraverse) -> T) -> T {
        look(&lock(&self.world))
    }
}

/// Creates a new folder for a drive and returns it; the name of the drive is that of the folder.
///
/// # Errors
/// A folder that cannot be created.
pub(crate) fn new_folder(folders: &Folders, name: &str) -> Result<std::path::PathBuf> {
    let write = |path: &Path, source| Error::Write { path: path.to_owned(), source };
    make_private(&folders.commanded_drives).map_err(|source| write(&folders.commanded_drives, source))?;
    let mut number = 1;
    loop {
        let folder = folders.commanded_drives.join(format!("{}-driven-{number}", slug(name)));
        match std::fs::create_dir(&folder) {
            Ok(()) => return Ok(folder),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err(write(&folder, error)),
        }
    }
}

/// Opens the world of a drive with the name of its folder.
///
/// # Errors
/// A folder that cannot be read.
pub(crate) fn open(
    world: DrivenTraverse,
    cache: &Arc<Cache>,
    events: &broadcast::Sender<Event>,
) -> Result<OpenTraverse> {
    let traverse = world.snapshot()?.with_cache(cache);
    let name = traverse.folder().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let drive = Arc::new(CommandedDrive {
        world: Mutex::new(world),
        maps: Mutex::default(),
        explained: Mutex::default(),
        cache: Arc::clone(cache),
    });
    Ok(OpenTraverse::new(Identity::of_commanded_drive(name), traverse, events.clone()).in_world_of(drive))
}

/// Reopens the drives of earlier starts; returns one sentence for each that cannot be opened.
pub(crate) fn reopen(
    folders: &Folders,
    cache: &Arc<Cache>,
    open: &mut Vec<Arc<OpenTraverse>>,
    events: &broadcast::Sender<Event>,
) -> Vec<String> {
    let entries = std::fs::read_dir(&folders.commanded_drives).into_iter().flatten().flatten();
    let mut all: Vec<_> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    all.sort();
    let mut lost = Vec::new();
    for folder in all {
        let opened = DrivenTraverse::resume(&folder).and_then(|world| self::open(world, cache, events));
        match opened {
            Ok(one) => open.push(Arc::new(one)),
            Err(error) => {
                lost.push(format!("the drive {} cannot be opened again: {error}", folder.display()));
            }
        }
    }
    lost
}

/// Copies the folder of a drive with its images.
///
/// # Errors
/// Files that cannot be read or written.
pub(crate) fn copy(from: &Path, to: &Path) -> Result<()> {
    let failed = |source| Error::Write { path: to.to_owned(), source };
    std::fs::create_dir_all(to).map_err(failed)?;
    for entry in std::fs::read_dir(from).map_err(failed)?.flatten() {
        let (path, copied) = (entry.path(), to.join(entry.file_name()));
        // The cached radiance is not copied: it can be rendered again.
        if path.is_dir() && entry.file_name() != "cache" {
            copy(&path, &copied)?;
        } else if path.is_file() {
            std::fs::copy(&path, &copied).map_err(failed)?;
        }
    }
    Ok(())
}

/// Result of driving to the next stop.
pub(crate) enum DriveOutcome {
    /// The drive with an additional stop.
    Grown(Arc<OpenTraverse>),
    /// The drive ended at the last stop.
    Ended(Ending),
    /// Another request has already driven on from this stop.
    AlreadyDriven,
}

/// Drives from the last stop to the next on the estimates of `steps`. Points the mast and renders the images there unless a
/// pause comes first.
///
/// # Errors
/// A drive that is not commanded, impassable ground, a folder that cannot be written, or [`Error::Cancelled`]; the world is
/// then unchanged.
pub(crate) fn drive_to_next_stop(
    open: &OpenTraverse,
    steering: &Steering,
    steps: &[Arc<RunStep>],
    cancel: &CancelFlag,
) -> Result<DriveOutcome> {
    let Some(drive) = &open.commanded else {
        let problem = "this drive was planned or recorded before; it is replayed and cannot be driven on";
        return Err(Error::Request(problem.to_owned()));
    };
    let (Some(first), Some(last)) = (steps.first(), steps.last()) else {
        return Ok(DriveOutcome::AlreadyDriven);
    };
    let (command, navigator) = (&steering.command, &*steering.command.navigator.navigator());
    let mut maps = lock(&drive.maps);
    // May render images, so the world is not locked yet.
    compute_hazard_maps(
        open,
        command,
        (first, steps_without_decision(drive, steps)),
        &mut maps,
        cancel.as_ref().into(),
    )?;
    let mut world = lock(&drive.world);
    if world.traverse().stop_count() != last.step + 1 {
        return Ok(DriveOutcome::AlreadyDriven);
    }
    let before = driving::cycle_before(&world, command, &steps[..steps.len() - 1], &mut maps);
    let hazards = maps.at(world.traverse(), command, [&first.trace, &last.trace], cancel.as_ref().into())?;
    drop(maps);
    let input = executive::CycleInput {
        command,
        navigator,
        first: &first.trace,
        last: &last.trace,
        before: before.as_ref(),
        hazards: hazards.as_deref(),
    };
    let state = world.state().to_vec();
    let before = steering.halt_within(last.step + 1);
    let moved = executive::drive(&mut *world, &input, cancel.as_ref().into());
    drop(world);
    let prepared = match moved {
        Ok(Cycle { ending: Some(ending), .. }) => return Ok(DriveOutcome::Ended(ending)),
        Ok(_) => prepare_stop(drive, last, &steering.command, before, cancel),
        Err(error) => Err(error),
    };
    let mut world = lock(&drive.world);
    if let Err(error) = prepared {
        world.restore(state)?;
        return Err(error);
    }
    let traverse = world.snapshot()?.with_cache(&drive.cache);
    drop(world);
    Ok(DriveOutcome::Grown(Arc::new(open.grown(traverse))))
}

/// The last steps of a run, starting with the first from which the rover has not driven on.
fn steps_without_decision<'a>(drive: &CommandedDrive, steps: &'a [Arc<RunStep>]) -> &'a [Arc<RunStep>] {
    let count =
        drive.with(|world| steps.iter().take_while(|step| world.followed(step.step).is_some()).count());
    &steps[count..]
}

/// Computes the missing hazard maps of a run's `steps` without locking the world; `first` is the step of the designation.
///
/// # Errors
/// [`Error::Cancelled`].
fn compute_hazard_maps(
    open: &OpenTraverse,
    command: &DriveCommand,
    (first, steps): (&RunStep, &[Arc<RunStep>]),
    maps: &mut HazardMaps,
    cancel: Cancel<'_>,
) -> Result<()> {
    steps
        .iter()
        .try_for_each(|step| maps.at(&open.traverse, command, [&first.trace, &step.trace], cancel).map(drop))
}

/// Points the mast and captures the images at the last stop, up to the next pause; returns the resulting drive, or `None` if
/// nothing was pending there.
///
/// # Errors
/// A folder that cannot be written, or [`Error::Cancelled`]; the world is then unchanged.
pub(crate) fn prepare(
    open: &OpenTraverse,
    last: &RunStep,
    command: &DriveCommand,
    before: Option<CycleStage>,
    cancel: &CancelFlag,
) -> Result<Option<Arc<OpenTraverse>>> {
    let Some(drive) = &open.commanded else { return Ok(None) };
    let world = lock(&drive.world);
    if world.traverse().stop_count() != last.step + 2 || world.awaits().is_none() {
        return Ok(None);
    }
    let state = world.state().to_vec();
    drop(world);
    let prepared = prepare_stop(drive, last, command, before, cancel);
    let mut world = lock(&drive.world);
    if let Err(error) = prepared {
        world.restore(state)?;
        return Err(error);
    }
    let traverse = world.snapshot()?.with_cache(&drive.cache);
    Ok(Some(Arc::new(open.grown(traverse))))
}

/// Performs `point_mast` and `capture` at the last stop in the world, up to the next pause. The world is readable while
/// images are rendered and visual odometry runs.
fn prepare_stop(
    drive: &CommandedDrive,
    last: &RunStep,
    command: &DriveCommand,
    before: Option<CycleStage>,
    cancel: &CancelFlag,
) -> Result<()> {
    let reaches = |stage| before.is_none_or(|before| before > stage);
    let step = last.step + 1;
    // Pending images are captured with the mast angles already set.
    let is_pointed = lock(&drive.world).awaits() == Some(CycleStage::Capture);
    let is_alone = lock(&drive.world).traverse().is_odometry_alone(step);
    let odometry = || {
        let mut shared = SharedWorld::new(&drive.world, &drive.cache)?;
        odometry::run(&mut shared, command, step, cancel.as_ref().into())
    };
    if !is_pointed {
        // After a restart the drive resumes here.
        lock(&drive.world).put_off(Some(CycleStage::PointMast))?;
        if !reaches(CycleStage::PointMast) {
            return Ok(());
        }
        if command.odometry_pair == OdometryPair::Own {
            odometry()?;
            if is_alone {
                return lock(&drive.world).put_off(None);
            }
        }
        let mut world = lock(&drive.world);
        executive::point_mast(&mut *world, command, &last.update)?;
        world.put_off(Some(CycleStage::Capture))?;
    }
    if !reaches(CycleStage::Capture) {
        return Ok(());
    }
    odometry()?;
    lock(&drive.world).put_off(None)
}

/// The steering of a session and the run that it follows.
fn steering_run(live: &LiveSession) -> (Option<Steering>, Option<Run>) {
    live.with(|session| {
        let steering = session.steering.clone();
        let run = steering.as_ref().and_then(|to| session.run(to.target, to.run).ok().cloned());
        (steering, run)
    })
}

/// The view of a session's drive.
pub(crate) fn view(live: &LiveSession) -> DriveView {
    let (steering, run) = steering_run(live);
    // Read after the run, so that it has the stops of all the run's steps.
    let open = live.traverse();
    let (Some(steering), Some(drive)) = (&steering, &open.commanded) else {
        return DriveView { steering, ..DriveView::default() };
    };
    let Some(run) = run else {
        return DriveView { steering: Some(steering.clone()), ..DriveView::default() };
    };
    let is_driving = live.is_computing(steering.target, steering.run);
    let mut maps = lock(&drive.maps);
    let steps = run.whole_steps();
    if let Some(first) = steps.first() {
        let missing = (first.as_ref(), steps_without_decision(drive, steps));
        // Never cancelled.
        let _mapped = compute_hazard_maps(&open, &steering.command, missing, &mut maps, Cancel::default());
    }
    let mut explained = lock(&drive.explained);
    let found =
        drive.with(|world| DriveView::of(world, steering, &run, (&mut maps, &mut explained), is_driving));
    DriveView { visits: live.with(|session| session.visits.clone()), ..found }
}

/// The drive of a session for a Rerun recording, with the stored hazard maps; `None` if the session is not steered.
pub(crate) fn log(live: &LiveSession) -> Option<DriveLog> {
    let DriveView { steering, cycles, why, .. } = view(live);
    let command = steering?.command;
    let open = live.traverse();
    let drive = open.commanded.as_ref()?;
    let (_, run) = steering_run(live);
    let run = run?;
    let steps = run.whole_steps();
    let first = steps.first()?;
    let mut maps = lock(&drive.maps);
    let hazards = steps.iter().map_while(|step| {
        let pair = [&first.trace, &step.trace];
        maps.at(&open.traverse, &command, pair, Cancel::default()).ok().flatten()
    });
    let hazards = hazards.collect();
    Some(DriveLog { cycles, hazards, tolerance_m: command.tolerance_m, why })
}

/// The goodness map at a stop of the drive of a session.
///
/// # Errors
/// A problem for a session without a commanded drive, a navigator without a map, and a step that the drive has not reached.
pub(crate) fn hazards(live: &LiveSession, step: usize, cancel: &CancelFlag) -> ApiResult<HazardView> {
    let (steering, run) = steering_run(live);
    // Read after the run, so that it has the stops of all the run's steps.
    let open = live.traverse();
    let (Some(steering), Some(drive)) = (steering, &open.commanded) else {
        return Err(ApiError::conflict("The drive of this session is not on commands."));
    };
    let (command, navigator) = (&steering.command, steering.command.navigator);
    if !navigator.needs_map() {
        let problem = format!("The navigator `{}` uses no hazard map.", navigator.name());
        return Err(ApiError::conflict(problem).hint("Choose `gestalt` or `morphin` in the command."));
    }
    let steps = run.as_ref().map(Run::whole_steps).unwrap_or_default();
    let (Some(first), Some(last)) = (steps.first(), steps.iter().find(|known| known.step == step)) else {
        return Err(ApiError::not_found(format!("The drive has not come to step {step}.")));
    };
    let mut maps = lock(&drive.maps);
    // Computes the maps of all stops in order, because only the last one can be computed from stored data and the page also
    // shows earlier ones.
    compute_hazard_maps(&open, command, (first, steps), &mut maps, cancel.as_ref().into())?;
    let found = maps.at(&open.traverse, command, [&first.trace, &last.trace], cancel.as_ref().into())?;
    drop(maps);
    let none =
        || ApiError::not_found(format!("Step {step} has no hazard map: the drive has no pair for it."));
    found.map(|hazards| HazardView::of(&hazards)).ok_or_else(none)
}

/// Replaces a drive in the list of open drives by the one with an additional stop.
pub(crate) fn replace(traverses: &OpenTraverses, grown: &Arc<OpenTraverse>) {
    if let Some(slot) = lock(traverses).iter_mut().find(|open| open.id == grown.id) {
        *slot = Arc::clone(grown);
    }
}
