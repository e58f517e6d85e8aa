//! Drives on commands: the worlds in which sessions drive, each in a folder of its own that grows stop by stop.
//!
//! An open drive is an [`OpenTraverse`] as any other. After each stop it is replaced by one with a stop more, in the list of
//! open drives and in the sessions on it: who reads the former one is not disturbed. The folder holds the whole state
//! (`sightline_recordings::driven`), so that the drive goes on after a restart.

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

/// The open traverses, those that were opened from a page last.
pub(crate) type OpenTraverses = Arc<Mutex<Vec<Arc<OpenTraverse>>>>;

/// The world of a drive on commands.
pub(crate) struct Driven {
    world: Mutex<DrivenTraverse>,
    /// Hazard maps of the stops; locked before `world`, never while it is held.
    maps: Mutex<HazardMaps>,
    /// Why the drive stopped; locked between these two.
    explained: Mutex<Explained>,
    cache: Arc<Cache>,
}

impl Driven {
    /// Looks at the world; nobody drives meanwhile.
    pub(crate) fn with<T>(&self, look: impl FnOnce(&DrivenTraverse) -> T) -> T {
        look(&lock(&self.world))
    }
}

/// A new folder for a drive, and the drive's name, which is that of the folder.
///
/// # Errors
/// A folder that cannot be made.
pub(crate) fn new_folder(folders: &Folders, name: &str) -> Result<std::path::PathBuf> {
    let write = |path: &Path, source| Error::Write { path: path.to_owned(), source };
    make_private(&folders.driven).map_err(|source| write(&folders.driven, source))?;
    let mut number = 1;
    loop {
        let folder = folders.driven.join(format!("{}-driven-{number}", slug(name)));
        match std::fs::create_dir(&folder) {
            Ok(()) => return Ok(folder),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => number += 1,
            Err(error) => return Err(write(&folder, error)),
        }
    }
}

/// Opens the world of a drive under the name of its folder.
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
    let driven = Arc::new(Driven {
        world: Mutex::new(world),
        maps: Mutex::default(),
        explained: Mutex::default(),
        cache: Arc::clone(cache),
    });
    Ok(OpenTraverse::new(Identity::driven(name), traverse, events.clone()).driven_in(driven))
}

/// Opens the drives of earlier starts; what cannot be opened is said in one sentence each.
pub(crate) fn open_again(
    folders: &Folders,
    cache: &Arc<Cache>,
    open: &mut Vec<Arc<OpenTraverse>>,
    events: &broadcast::Sender<Event>,
) -> Vec<String> {
    let entries = std::fs::read_dir(&folders.driven).into_iter().flatten().flatten();
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
        // Kept radiance is only time.
        if path.is_dir() && entry.file_name() != "cache" {
            copy(&path, &copied)?;
        } else if path.is_file() {
            std::fs::copy(&path, &copied).map_err(failed)?;
        }
    }
    Ok(())
}

/// What became of a drive to another stop.
pub(crate) enum DrivenOn {
    /// The drive with a stop more.
    Grown(Arc<OpenTraverse>),
    /// It ends at the last stop.
    Ended(Ending),
    /// Somebody else drove on from there.
    Overtaken,
}

/// Drives from the last stop to the next on the estimates of `steps`. The mast is pointed and the images are due if no pause is
/// before.
///
/// # Errors
/// A drive that is none on commands, ground that cannot be driven on, a folder that cannot be written, or
/// [`Error::Cancelled`]; the world is then as it was.
pub(crate) fn drive_on(
    open: &OpenTraverse,
    steering: &Steering,
    steps: &[Arc<RunStep>],
    cancel: &CancelFlag,
) -> Result<DrivenOn> {
    let Some(driven) = &open.driven else {
        let problem = "this drive was planned or recorded before; it is replayed and cannot be driven on";
        return Err(Error::Request(problem.to_owned()));
    };
    let (Some(first), Some(last)) = (steps.first(), steps.last()) else { return Ok(DrivenOn::Overtaken) };
    let (command, navigator) = (&steering.command, &*steering.command.navigator.navigator());
    let mut maps = lock(&driven.maps);
    // Images may have to be rendered: the world is free meanwhile.
    map_hazards(open, command, (first, undecided(driven, steps)), &mut maps, cancel.as_ref().into())?;
    let mut world = lock(&driven.world);
    if world.traverse().stop_count() != last.step + 1 {
        return Ok(DrivenOn::Overtaken);
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
        Ok(Cycle { ending: Some(ending), .. }) => return Ok(DrivenOn::Ended(ending)),
        Ok(_) => prepare_stop(driven, last, &steering.command, before, cancel),
        Err(error) => Err(error),
    };
    let mut world = lock(&driven.world);
    if let Err(error) = prepared {
        world.restore(state)?;
        return Err(error);
    }
    let traverse = world.snapshot()?.with_cache(&driven.cache);
    drop(world);
    Ok(DrivenOn::Grown(Arc::new(open.grown(traverse))))
}

/// The last steps of a run, from the first that the rover has not driven on from.
fn undecided<'a>(driven: &Driven, steps: &'a [Arc<RunStep>]) -> &'a [Arc<RunStep>] {
    let count =
        driven.with(|world| steps.iter().take_while(|step| world.followed(step.step).is_some()).count());
    &steps[count..]
}

/// Computes the hazard maps of a run's `steps` that are missing, without the world; its first step is that of the designation.
///
/// # Errors
/// [`Error::Cancelled`].
fn map_hazards(
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

/// Points the mast at the last stop and lets its images be taken, as far as no pause is before; returns the drive as it is then.
/// `None` if nothing was put off there.
///
/// # Errors
/// A folder that cannot be written, or [`Error::Cancelled`]; the world is then as it was.
pub(crate) fn prepare(
    open: &OpenTraverse,
    last: &RunStep,
    command: &DriveCommand,
    before: Option<CycleStage>,
    cancel: &CancelFlag,
) -> Result<Option<Arc<OpenTraverse>>> {
    let Some(driven) = &open.driven else { return Ok(None) };
    let world = lock(&driven.world);
    if world.traverse().stop_count() != last.step + 2 || world.awaits().is_none() {
        return Ok(None);
    }
    let state = world.state().to_vec();
    drop(world);
    let prepared = prepare_stop(driven, last, command, before, cancel);
    let mut world = lock(&driven.world);
    if let Err(error) = prepared {
        world.restore(state)?;
        return Err(error);
    }
    let traverse = world.snapshot()?.with_cache(&driven.cache);
    Ok(Some(Arc::new(open.grown(traverse))))
}

/// The world's part of `point_mast` and `capture` at the last stop, as far as no pause is before. Others may look at the world
/// while images are rendered and vision measures the motion.
fn prepare_stop(
    driven: &Driven,
    last: &RunStep,
    command: &DriveCommand,
    before: Option<CycleStage>,
    cancel: &CancelFlag,
) -> Result<()> {
    let reaches = |stage| before.is_none_or(|before| before > stage);
    let step = last.step + 1;
    // Images that are put off show the mast as it was pointed then.
    let is_pointed = lock(&driven.world).awaits() == Some(CycleStage::Capture);
    let is_alone = lock(&driven.world).traverse().is_odometry_alone(step);
    let odometry = || {
        let mut shared = SharedWorld::new(&driven.world, &driven.cache)?;
        odometry::run(&mut shared, command, step, cancel.as_ref().into())
    };
    if !is_pointed {
        // After a restart the drive goes on from here.
        lock(&driven.world).put_off(Some(CycleStage::PointMast))?;
        if !reaches(CycleStage::PointMast) {
            return Ok(());
        }
        if command.odometry_pair == OdometryPair::Own {
            odometry()?;
            if is_alone {
                return lock(&driven.world).put_off(None);
            }
        }
        let mut world = lock(&driven.world);
        executive::point_mast(&mut *world, command, &last.update)?;
        world.put_off(Some(CycleStage::Capture))?;
    }
    if !reaches(CycleStage::Capture) {
        return Ok(());
    }
    odometry()?;
    lock(&driven.world).put_off(None)
}

/// Who drives in a session, with its run.
fn steered(live: &LiveSession) -> (Option<Steering>, Option<Run>) {
    live.with(|session| {
        let steering = session.steering.clone();
        let run = steering.as_ref().and_then(|to| session.run(to.target, to.run).ok().cloned());
        (steering, run)
    })
}

/// The drive of a session.
pub(crate) fn view(live: &LiveSession) -> DriveView {
    let (steering, run) = steered(live);
    // Read after the run: it has the stops of all its steps.
    let open = live.traverse();
    let (Some(steering), Some(driven)) = (&steering, &open.driven) else {
        return DriveView { steering, ..DriveView::default() };
    };
    let Some(run) = run else {
        return DriveView { steering: Some(steering.clone()), ..DriveView::default() };
    };
    let is_driving = live.is_computing(steering.target, steering.run);
    let mut maps = lock(&driven.maps);
    let steps = run.whole_steps();
    if let Some(first) = steps.first() {
        let missing = (first.as_ref(), undecided(driven, steps));
        // Never cancelled.
        let _mapped = map_hazards(&open, &steering.command, missing, &mut maps, Cancel::default());
    }
    let mut explained = lock(&driven.explained);
    let found =
        driven.with(|world| DriveView::of(world, steering, &run, (&mut maps, &mut explained), is_driving));
    DriveView { visits: live.with(|session| session.visits.clone()), ..found }
}

/// The drive of a session as a Rerun recording has it, with the hazard maps that are kept; `None` where nobody drives.
pub(crate) fn log(live: &LiveSession) -> Option<DriveLog> {
    let DriveView { steering, cycles, why, .. } = view(live);
    let command = steering?.command;
    let open = live.traverse();
    let driven = open.driven.as_ref()?;
    let (_, run) = steered(live);
    let run = run?;
    let steps = run.whole_steps();
    let first = steps.first()?;
    let mut maps = lock(&driven.maps);
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
/// A problem for a session without a drive, a navigator without a map, and a step that the drive has not come to.
pub(crate) fn hazards(live: &LiveSession, step: usize, cancel: &CancelFlag) -> ApiResult<HazardView> {
    let (steering, run) = steered(live);
    // Read after the run: it has the stops of all its steps.
    let open = live.traverse();
    let (Some(steering), Some(driven)) = (steering, &open.driven) else {
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
    let mut maps = lock(&driven.maps);
    // The maps of all stops, in order: only the last one can be computed from what is kept, and the page also shows earlier ones.
    map_hazards(&open, command, (first, steps), &mut maps, cancel.as_ref().into())?;
    let found = maps.at(&open.traverse, command, [&first.trace, &last.trace], cancel.as_ref().into())?;
    drop(maps);
    let none =
        || ApiError::not_found(format!("Step {step} has no hazard map: the drive has no pair for it."));
    found.map(|hazards| HazardView::of(&hazards)).ok_or_else(none)
}

/// Puts the drive with a stop more in the place of the former one in the list of open drives.
pub(crate) fn replace(traverses: &OpenTraverses, grown: &Arc<OpenTraverse>) {
    if let Some(place) = lock(traverses).iter_mut().find(|open| open.id == grown.id) {
        *place = Arc::clone(grown);
    }
}
