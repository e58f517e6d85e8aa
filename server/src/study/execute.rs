//! Executes a study: creates one world after another, renders missing images, and tracks unit by unit.
//!
//! If a number of worlds is requested, a world with fewer targets than its scenario requires is skipped, which depends only
//! on its surface and its illumination. Explicit seeds are always used.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::prelude::*;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::{Traverse, create_simulated};
use sightline_rover::visual_odometry::{OdometryMode, OdometryPreset};
use sightline_study::by_pose_row::DriveOdometry;
use sightline_study::picks;
use sightline_study::plan::{Configuration, Plan, Unit, key};
use sightline_study::point::{Picks, Point};
use sightline_study::randomised;
use sightline_study::row::{Row, rows};
use sightline_study::run::{Chosen, Run, Watch, measure};
use sightline_world::Scenario;

use super::log::ResultLog;
use super::order::{Order, Seeds};
use super::report;
use super::tables;

/// Number of seeds tried per requested world.
const SEEDS_PER_WORLD: u64 = 10;

/// Fraction of the work spent on rendering, if no world is rendered yet.
const RENDERING: f64 = 0.5;

/// Progress of a study.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// Finished units.
    Units {
        /// Number of finished units.
        k: usize,
        /// Number of all units.
        n: usize,
        /// Finished fraction of the work, 0 to 1.
        share: f64,
    },
    /// Rendered stops of a world, out of the missing ones.
    Rendering {
        /// The world.
        world: String,
        /// Number of rendered stops.
        k: usize,
        /// Number of missing stops at the start.
        n: usize,
        /// Finished fraction of the work, 0 to 1.
        share: f64,
    },
    /// New or cached rows.
    Rows(Vec<Row>),
    /// A message for the user, as a sentence.
    Notice(String),
}

/// The results of a study.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The units, by configuration, point and world.
    pub units: Vec<Unit>,
    /// The table.
    pub rows: Vec<Row>,
    /// The report, a complete HTML page.
    pub report: String,
    /// Number of units computed in this execution; the others were cached.
    pub found: usize,
}

/// Executes a study and writes its tables and its report.
///
/// # Errors
/// Bad input, a folder that cannot be written, or [`Error::Cancelled`] soon after `cancel` is set.
pub fn carry_out(
    mut order: Order,
    cancel: &AtomicBool,
    notify: &(dyn Fn(Progress) + Sync),
) -> Result<Outcome> {
    replace_scenario(&mut order)?;
    let folder = order.folder.join(order.plan.study.name);
    let log = ResultLog::open(&folder)?;
    log.notices.iter().for_each(|notice| notify(Progress::Notice(notice.clone())));
    let execution = StudyExecution {
        order: &order,
        log,
        cancel,
        notify,
        done: AtomicUsize::new(0),
        found: AtomicUsize::new(0),
        rendered: AtomicUsize::new(0),
    };
    notify(Progress::Units { k: 0, n: execution.all(), share: 0.0 });
    let mut units = Vec::new();
    for name in order.plan.scenarios() {
        units.extend(execution.scenario(name)?);
    }
    let sort_key = |unit: &Unit| {
        let configuration = order.plan.configurations.iter().position(|c| c.name == unit.configuration);
        (configuration, order.plan.points.iter().position(|point| *point == unit.point), unit.seed)
    };
    units.sort_by_key(sort_key);
    let rows: Vec<Row> = units.iter().flat_map(|unit| rows(order.plan.study, unit)).collect();
    tables::write(&folder, &rows, &units)?;
    let report = report::write(&folder, &order, &units)?;
    Ok(Outcome { units, rows, report, found: execution.found.load(Ordering::Relaxed) })
}

/// Replaces the study's own scenario.
fn replace_scenario(order: &mut Order) -> Result<()> {
    let Some((name, _)) = &order.scenario else { return Ok(()) };
    if order.plan.scenarios().len() > 1 {
        let problem = "this study compares several scenarios; none can take the place of all";
        return Err(Error::setting("scenario", problem));
    }
    order.plan.points.iter_mut().for_each(|point| point.scenario.clone_from(name));
    Ok(())
}

struct StudyExecution<'a> {
    order: &'a Order,
    log: ResultLog,
    cancel: &'a AtomicBool,
    notify: &'a (dyn Fn(Progress) + Sync),
    done: AtomicUsize,
    found: AtomicUsize,
    /// Number of completely rendered worlds.
    rendered: AtomicUsize,
}

/// One unit to compute.
struct Task<'a> {
    configuration: &'a Configuration,
    point: &'a Point,
    key: String,
}

impl StudyExecution<'_> {
    /// Computes all units of the points in one scenario.
    fn scenario(&self, name: &str) -> Result<Vec<Unit>> {
        let scenario = match &self.order.scenario {
            Some((_, scenario)) => scenario.clone(),
            None => randomised::base(name)?,
        };
        let points: Vec<&Point> =
            self.order.plan.points.iter().filter(|point| point.scenario == name).collect();
        match &self.order.seeds {
            Seeds::Named(seeds) => {
                let mut units = Vec::new();
                for &seed in seeds {
                    units.extend(
                        self.world(name, &randomised::world(name, &scenario, seed), &points, true)?
                            .unwrap_or_default(),
                    );
                }
                Ok(units)
            }
            &Seeds::Count { worlds, first } => {
                let seeds = first..first.saturating_add(worlds.saturating_mul(SEEDS_PER_WORLD));
                let (mut units, mut count) = (Vec::new(), 0);
                for seed in seeds.clone() {
                    if count == worlds {
                        break;
                    }
                    let of_world =
                        self.world(name, &randomised::world(name, &scenario, seed), &points, false)?;
                    count += u64::from(of_world.is_some());
                    units.extend(of_world.unwrap_or_default());
                }
                if count < worlds {
                    return Err(Error::Request(format!(
                        "only {count} of {worlds} worlds of {name} with seeds from {first} to {} offer {} targets: \
                         name the seeds, or change targets.count in the scenario",
                        seeds.end - 1,
                        scenario.targets.wanted()
                    )));
                }
                Ok(units)
            }
        }
    }

    /// Computes the units of one world; `None` if it is skipped.
    fn world(
        &self,
        name: &str,
        scenario: &Scenario,
        points: &[&Point],
        is_explicit: bool,
    ) -> Result<Option<Vec<Unit>>> {
        let tasks = self.tasks(scenario, points)?;
        // The same settings may be cached under another name.
        let cached_unit = |task: &Task<'_>| {
            let configuration = task.configuration.name.clone();
            self.log.get(&task.key).map(|unit| Unit { configuration, ..unit.clone() })
        };
        let cached: Vec<Unit> = tasks.iter().filter_map(cached_unit).collect();
        if cached.len() == tasks.len() {
            self.rendered.fetch_add(1, Ordering::Relaxed);
            self.count(&cached);
            return Ok(Some(cached));
        }
        let world = format!("{name}/world-{}", scenario.seed);
        let traverse = create_simulated(scenario, &self.order.folder.join(&world))?;
        let mut chosen: Vec<(&Point, Vec<Chosen>)> = Vec::new();
        for &point in points {
            // Without a fault, the targets of all points are the same.
            let same = chosen.iter().find(|(other, _)| {
                other.picks == point.picks && other.fault.is_none() && point.fault.is_none()
            });
            let of_point = match same {
                Some((_, known)) => known.clone(),
                None => picks::choose(&traverse, scenario, point)?,
            };
            if point.picks == Picks::Rule && of_point.len() < scenario.targets.wanted() as usize {
                let outcome = if is_explicit { "taken as they are" } else { "passed over" };
                (self.notify)(Progress::Notice(format!("{world}: {} targets, {outcome}", of_point.len())));
                if !is_explicit {
                    return Ok(None);
                }
            }
            chosen.push((point, of_point));
        }
        self.count(&cached);
        self.render(&traverse, &world)?;
        let missing: Vec<&Task<'_>> = tasks.iter().filter(|task| self.log.get(&task.key).is_none()).collect();
        let drives = self.drives(&traverse, &missing)?;
        let found: Result<Vec<Unit>> = missing
            .par_iter()
            .map(|task| {
                let of_point = chosen.iter().find(|(point, _)| *point == task.point);
                let own = drives.iter().find(|(mode, _)| Some(*mode) == task.point.odometry);
                let drive = own.map_or(&traverse, |(_, drive)| drive);
                let chosen = of_point.map_or(&[][..], |(_, chosen)| chosen.as_slice());
                self.unit([&traverse, drive], scenario, task, chosen)
            })
            .collect();
        Ok(Some(cached.into_iter().chain(found?).collect()))
    }

    /// The drives of a world with the uses of odometry in `tasks`.
    fn drives(&self, traverse: &Traverse, tasks: &[&Task<'_>]) -> Result<Vec<(OdometryMode, Traverse)>> {
        let mut drives: Vec<(OdometryMode, Traverse)> = Vec::new();
        for mode in tasks.iter().filter_map(|task| task.point.odometry) {
            if drives.iter().all(|(known, _)| *known != mode) {
                let preset = OdometryPreset::Sightline;
                drives.push((mode, traverse.with_odometry(mode, preset, self.cancel.into())?));
            }
        }
        Ok(drives)
    }

    fn tasks(&self, scenario: &Scenario, points: &[&Point]) -> Result<Vec<Task<'_>>> {
        let mut tasks = Vec::new();
        for configuration in &self.order.plan.configurations {
            for point in self.order.plan.points.iter().filter(|point| points.contains(point)) {
                let settings = Plan::settings(configuration, point)?;
                tasks.push(Task { configuration, point, key: key(scenario, point, &settings) });
            }
        }
        Ok(tasks)
    }

    /// Computes one unit in the planned drive and in the drive with the task's odometry.
    fn unit(
        &self,
        [planned, drive]: [&Traverse; 2],
        scenario: &Scenario,
        task: &Task<'_>,
        chosen: &[Chosen],
    ) -> Result<Unit> {
        let settings = Plan::settings(task.configuration, task.point)?;
        let keep_steps = self.order.plan.study.is_by_step;
        let watch = Watch { cancel: self.cancel, tell: &|| () };
        let mut runs = measure(drive, task.point, chosen, &settings, keep_steps, &watch)?;
        let odometry = task.point.odometry.map(|_| DriveOdometry::of(drive, planned.stop_count()));
        if odometry.as_ref().is_some_and(DriveOdometry::is_cut_short) {
            runs.iter_mut().for_each(Run::end_early);
        }
        let unit = Unit {
            key: task.key.clone(),
            scenario: task.point.scenario.clone(),
            seed: scenario.seed,
            configuration: task.configuration.name.clone(),
            point: task.point.clone(),
            odometry,
            runs,
        };
        self.log.add(&unit)?;
        self.found.fetch_add(1, Ordering::Relaxed);
        self.count(std::slice::from_ref(&unit));
        Ok(unit)
    }

    fn render(&self, traverse: &Traverse, world: &str) -> Result<()> {
        let missing: Vec<_> = (0..traverse.stop_count()).filter(|&step| !traverse.is_ready(step)).collect();
        for (k, &step) in missing.iter().enumerate() {
            let n = missing.len();
            let share = self.share(k as f64 / n as f64);
            (self.notify)(Progress::Rendering { world: world.to_owned(), k, n, share });
            traverse.render_step(step, self.cancel)?;
        }
        self.rendered.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }

    /// Finished fraction of the work, 0 to 1, if `of_world` of another world is rendered.
    fn share(&self, of_world: f64) -> f64 {
        let worlds = self.worlds() * self.order.plan.scenarios().len();
        let rendered = self.rendered.load(Ordering::Relaxed) as f64 + of_world;
        let tracked = self.done.load(Ordering::Relaxed) as f64 / self.all().max(1) as f64;
        (RENDERING * rendered / worlds.max(1) as f64 + (1.0 - RENDERING) * tracked).min(1.0)
    }

    /// Reports these units as finished.
    fn count(&self, units: &[Unit]) {
        if units.is_empty() {
            return;
        }
        let k = self.done.fetch_add(units.len(), Ordering::Relaxed) + units.len();
        (self.notify)(Progress::Rows(
            units.iter().flat_map(|unit| rows(self.order.plan.study, unit)).collect(),
        ));
        (self.notify)(Progress::Units { k, n: self.all(), share: self.share(0.0) });
    }

    /// Number of worlds of each scenario.
    fn worlds(&self) -> usize {
        match &self.order.seeds {
            Seeds::Named(seeds) => seeds.len(),
            Seeds::Count { worlds, .. } => *worlds as usize,
        }
    }

    /// Number of units of the study.
    fn all(&self) -> usize {
        self.worlds() * self.order.plan.points.len() * self.order.plan.configurations.len()
    }
}
