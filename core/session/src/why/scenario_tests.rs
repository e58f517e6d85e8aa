//! The cause of the first loss in drives of the scenario library, each with a known trouble.

use serde_json::{Value, json};

use super::*;
use crate::track;
use sightline_recordings::create_simulated;
use sightline_track::settings::Changes;
use sightline_track::target::Designation;
use sightline_world::{choose_targets, library};

/// The first rejected step of a drive and its summary without the truth; `None` if all steps up to `last` are accepted. The
/// changed settings apply at step `last`.
fn first_loss(name: &str, last: usize, changes: &[(&str, Value)]) -> Option<(usize, sentence::Summary)> {
    let mut scenario = library::scenario(name).unwrap();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 1);
    scenario.targets.window_px = 11;
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario, &folder.path().join("drive")).unwrap();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];
    let changes: Changes = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    let (usual, changed) = (Settings::default(), Settings::default().with(&changes).unwrap());
    let mut steps = vec![track::designate(&traverse, Designation::new(0, pixel), &usual).unwrap()];
    while steps.len() <= last && steps.len() < traverse.index().stops.len() {
        let settings = if steps.len() == last { &changed } else { &usual };
        let mut next = track::advance(&traverse, &steps[0], &steps[steps.len() - 1], settings);
        next.truth = None;
        let is_rejected = next.verdict().is_some_and(|verdict| !verdict.accepted);
        steps.push(next);
        if is_rejected {
            let step = steps.len() - 1;
            let (trace, before) = (&steps[step], Some(&steps[step - 1]));
            let book = Book { trace, before, settings, prediction_px: None, sources: &traverse };
            return Some((step, book.summary()));
        }
    }
    None
}

#[test]
fn the_cause_of_a_loss_in_a_simulated_drive_is_its_trouble() {
    for (name, trouble_at, cause) in [
        (
            "heading-jump",
            18,
            "The heading estimate jumped by 6.8° to the right while the rover drove straight; ",
        ),
        ("occlusion", 5, "The match score fell from 0.99"),
        ("self-shadow", 15, "The match score fell from 0.97"),
        (
            "stuck",
            5,
            "The match is 17 px from the prediction, where a score of 0.850 is required, and has 0.849",
        ),
    ] {
        let (step, summary) = first_loss(name, trouble_at, &[]).expect(name);
        assert_eq!(step, trouble_at, "{name}: {summary:?}");
        assert!(summary.headline.starts_with(cause), "{name}: {summary:?}");
    }
}

#[test]
fn a_simulated_step_that_is_lost_by_a_strict_limit_has_no_cause() {
    for name in ["occlusion", "turn-in-place", "sideways-70"] {
        let (step, summary) = first_loss(name, 4, &[("match_sigma_max_px", json!(0.001))]).expect(name);
        assert_eq!((step, summary.headline.as_str()), (4, "No single cause is visible."), "{name}");
    }
}
