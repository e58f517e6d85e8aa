//! The cause of the first loss in drives of the library, each with a known trouble.

use super::*;
use crate::track;
use sightline_recordings::create_simulated;
use sightline_track::target::Designation;
use sightline_world::{choose_targets, library};

/// The first rejected step of a drive and its summary without the truth; `None` where all steps up to `last` are accepted.
fn first_loss(name: &str, last: usize) -> Option<(usize, sentence::Summary)> {
    let mut scenario = library::scenario(name).unwrap();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 1);
    scenario.targets.window_px = 11;
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario, &folder.path().join("drive")).unwrap();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];
    let settings = Settings::default();
    let mut steps = vec![track::designate(&traverse, Designation::new(0, pixel), &settings).unwrap()];
    while steps.len() <= last && steps.len() < traverse.index().stops.len() {
        let mut next = track::advance(&traverse, &steps[0], &steps[steps.len() - 1], &settings);
        next.truth = None;
        let is_rejected = next.verdict().is_some_and(|verdict| !verdict.accepted);
        steps.push(next);
        if is_rejected {
            let step = steps.len() - 1;
            let (trace, before) = (&steps[step], Some(&steps[step - 1]));
            let book = Book { trace, before, settings: &settings, prediction_px: None, sources: &traverse };
            return Some((step, book.summary()));
        }
    }
    None
}

#[test]
fn explore() {
    for name in std::env::var("NAMES").unwrap_or_default().split(',').filter(|n| !n.is_empty()) {
        match first_loss(name, 22) {
            Some((step, summary)) => println!("== {name} step {step}: {summary:#?}"),
            None => println!("== {name}: never lost"),
        }
    }
}
