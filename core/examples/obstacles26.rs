//! temporary
use sightline_experiments::driving::scenario_of;
use sightline_geometry::cancel::Cancel;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{DriveCommand, NavigatorKind};
use sightline_session::driving::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::{choose_targets, library};
use std::time::Instant;

fn var<T: std::str::FromStr>(name: &str) -> Option<T> {
    std::env::var(name).ok().and_then(|v| v.parse().ok())
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let seeds: Vec<u64> = arguments[2].split(',').map(|s| s.parse().unwrap()).collect();
    for seed in seeds {
        for name in arguments[1].split(',') {
            let navigator = match name {
                "gestalt" => NavigatorKind::Gestalt,
                "morphin" => NavigatorKind::Morphin,
                _ => NavigatorKind::Arcs,
            };
            one(seed, navigator);
        }
    }
}

fn one(seed: u64, navigator: NavigatorKind) {
    let mut scenario = scenario_of(&library::scenario("obstacles-10").unwrap(), seed);
    (scenario.camera.image_size, scenario.camera.samples_per_axis) =
        (var("SIZE").unwrap_or(512), var("SAMPLES").unwrap_or(4));
    if scenario.camera.image_size < 512 {
        scenario.targets.window_px = 11;
    }
    if let Some(a) = var("AREA") {
        scenario.rocks.area_fraction = a;
    }
    if let Some(slope) = var("SLOPE") {
        scenario.terrain.slope_deg = slope;
    }
    let folder = std::env::temp_dir().join(format!("obst26-{seed}-{navigator:?}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    let world = DrivenTraverse::begin(&scenario, &folder, Cancel::default()).unwrap();
    let traverse = world.traverse();
    let targets = choose_targets(traverse.world().unwrap(), &scenario, traverse.index());
    let Some(pixel) = targets.first() else {
        println!("{seed} no target");
        return;
    };
    let mut command =
        DriveCommand { navigator, stops_max: var("STOPS").unwrap_or(60), ..DriveCommand::default() };
    if let Some(x) = var("OFFSET_X") {
        command.offset_m[0] = x;
    }
    if std::env::var("FIXED").is_ok() {
        command.goal = sightline_rover::driving::GoalRule::Fixed;
    }
    let settings = Settings::default();
    let mut drive =
        match TargetedDrive::begin(world, Designation::new(0, *pixel), command, &settings, Cancel::default())
        {
            Ok(drive) => drive,
            Err(error) => {
                println!("{seed} {navigator:?} {error}");
                return;
            }
        };
    let start = Instant::now();
    let verbose = std::env::var("VERBOSE").is_ok();
    loop {
        let before = Instant::now();
        let goes_on = match drive.advance(&settings, Cancel::default()) {
            Ok(goes_on) => goes_on,
            Err(error) => {
                println!("{seed} {navigator:?} ERROR {error}");
                return;
            }
        };
        if verbose {
            let cycle = &drive.cycles[drive.cycles.len() - 1];
            let vetoed = cycle.choice.as_ref().map(|c| (c.candidates.len(), c.vetoed_count()));
            let terms = cycle.choice.as_ref().map(|c| {
                let mut counts = std::collections::BTreeMap::new();
                for veto in c.candidates.iter().filter_map(|c| c.veto) {
                    *counts.entry(format!("{:?}", veto.term)).or_insert(0) += 1;
                }
                counts
            });
            let chosen =
                cycle.choice.as_ref().and_then(|c| c.candidates.get(c.chosen?)).map(|c| (c.terms, c.vote));
            println!(
                "  {} at {:.2?} goal {:.2} m {:?} points {:?} vetoed {:?} {:?} {:?} {:.1} s",
                cycle.step,
                drive.world.state()[cycle.step].site_from_rover.position_m,
                cycle.goal.distance_m,
                cycle.motion,
                cycle.range_points,
                vetoed,
                terms,
                chosen,
                before.elapsed().as_secs_f64()
            );
            if cycle.motion.is_none() {
                for c in cycle.choice.iter().flat_map(|c| &c.candidates) {
                    println!("     {c:?}");
                }
            }
        }
        if !goes_on {
            break;
        }
    }
    let s = drive.summary();
    let touched: Vec<(usize, u32, f64)> = drive
        .world
        .state()
        .iter()
        .enumerate()
        .filter(|(_, stop)| stop.touched_rocks > 0 || stop.completed < 1.0)
        .map(|(k, stop)| (k, stop.touched_rocks, stop.completed))
        .collect();
    let detail = drive.ending().and_then(|e| e.detail.or_else(|| e.value.map(|v| format!("{v:.3}"))));
    println!(
        "{seed} {navigator:?} {:?} ({}) stops {} driven {:.2} m collisions {} {touched:?} target {:.4?} goal {:.4?} tracked {:?} flight {:.0} min; {:.1} s, {:.2} s a stop",
        s.reason,
        detail.unwrap_or_default(),
        s.stops,
        s.driven_m,
        s.collisions,
        s.target_error_m,
        s.goal_error_m,
        s.tracked,
        s.flight_minutes,
        start.elapsed().as_secs_f64(),
        start.elapsed().as_secs_f64() / s.stops as f64
    );
    let _ = std::fs::remove_dir_all(&folder);
}
