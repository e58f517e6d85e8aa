//! Comparisons of runs with known truth: forks of a drive towards a textured plane.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::json;

use super::*;
use crate::track;
use sightline_geometry::frames::{Pixel, Pose};
use sightline_testing::PlaneWorld;
use sightline_track::settings::Changes;
use sightline_track::target::Designation;

/// Six stops, 0.4 m apart.
fn world() -> PlaneWorld {
    PlaneWorld::new((0..6).map(|stop| Pose::translation(0.4 * f64::from(stop), 0.0, 0.0)).collect())
}

fn changes(list: &[(&str, Value)]) -> Changes {
    list.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect()
}

/// A session with one target on the plane and its complete first run.
fn session(world: &PlaneWorld) -> Session {
    let designation = Designation::new(0, Pixel::new(128.0, 120.0));
    let mut session = Session::new("s", "t", 6);
    let first = track::designate(world, designation, &Settings::default()).unwrap();
    session.add_target(None, Settings::default(), Arc::new(first));
    complete(&mut session, world, 0, 0);
    session
}

fn complete(session: &mut Session, world: &PlaneWorld, target: usize, run: usize) {
    while let Some(pending) = session.pending(target, run).unwrap() {
        let step = track::advance(world, &pending.first, &pending.last, &pending.settings);
        session.record(target, run, Arc::new(step)).unwrap();
    }
}

/// Forks the first run and completes the fork.
fn fork(session: &mut Session, world: &PlaneWorld, from_step: usize, list: &[(&str, Value)]) -> RunName {
    let run = session.fork(0, 0, from_step, &changes(list), None).unwrap();
    complete(session, world, 0, run);
    RunName { target: 0, run }
}

const A: RunName = RunName { target: 0, run: 0 };

fn asked(runs: &[RunName]) -> NewComparison {
    let (align, tolerance) = (Alignment::Step, BTreeMap::new());
    NewComparison { runs: runs.to_vec(), align, tolerance, columns: None }
}

fn compared(session: &Session, asked: &NewComparison) -> Comparison {
    compare(&session.compared(&asked.runs).unwrap(), asked).unwrap()
}

#[test]
fn a_fork_differs_first_at_its_fork_step_in_the_stage_whose_setting_changed() {
    let world = world();
    let mut session = session(&world);
    for (from_step, list, stage, part) in [
        (2, vec![("template_size_px", json!(31))], "locate", Some("scale_roll")),
        (3, vec![("scale", json!(false)), ("surface_warp", json!(false))], "locate", Some("scale_roll")),
        (4, vec![("search_window_px", json!(81))], "locate", Some("match_template")),
        (3, vec![("ncc_min", json!(0.9999))], "judge", None),
        (2, vec![("template_update", json!("every_update"))], "update", None),
    ] {
        let other = fork(&mut session, &world, from_step, &list);
        let found = compared(&session, &asked(&[A, other]));
        let first = &found.first[0];
        let divergence = first.divergence.as_ref().unwrap_or_else(|| panic!("{list:?}: {}", first.sentence));
        assert_eq!((divergence.step, divergence.stage.as_str()), (from_step, stage), "{list:?}: {first:?}");
        assert_eq!(divergence.part.as_deref(), part, "{list:?}");
        assert!(
            first.sentence.contains(&format!("step {from_step} in {}", part.unwrap_or(stage))),
            "{first:?}"
        );
        let differing: Vec<&str> = found.settings.iter().map(|setting| setting.key.as_str()).collect();
        let mut expected: Vec<&str> = list.iter().map(|(key, _)| *key).collect();
        expected.sort_unstable();
        let mut sorted = differing.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, expected, "only the differences");
    }
}

#[test]
fn the_sentence_names_step_stage_and_both_values() {
    let world = world();
    let mut session = session(&world);
    let other = fork(&mut session, &world, 3, &[("ncc_min", json!(0.9999))]);
    let found = compared(&session, &asked(&[A, other]));
    let sentence = &found.first[0].sentence;
    assert_eq!(sentence, "first differ at step 3 in judge: gates ncc limit 0.7000 and 0.9999");
    let value = &found.first[0].divergence.as_ref().unwrap().values[0];
    assert_eq!((value.path.as_str(), &value.a, &value.b), ("gates.ncc.limit", &json!(0.7), &json!(0.9999)));
}

#[test]
fn equal_runs_never_differ_and_a_run_computed_anew_is_equal_to_the_bit() {
    let world = world();
    let mut session = session(&world);
    let first = track::designate(&world, session.targets[0].designation, &Settings::default()).unwrap();
    let again = session.fork(0, 0, 0, &Changes::new(), Some(Arc::new(first))).unwrap();
    complete(&mut session, &world, 0, again);
    let found = compared(&session, &asked(&[A, RunName { target: 0, run: again }]));
    assert_eq!(found.first[0].divergence, None);
    assert_eq!(found.first[0].sentence, "do not differ at any of the 6 compared stops");
    assert!(found.settings.is_empty());
    assert!(found.columns.iter().all(|column| column.deltas.iter().flatten().flatten().all(|d| *d == 0.0)));
}

#[test]
fn a_tolerance_moves_the_first_divergence_on_to_where_it_is_exceeded() {
    let world = world();
    let mut session = session(&world);
    // A copy of the run with its range changed by 1 mm at step 2 and by 1 cm at step 4.
    let mut copy = Compared::new(A, session.run(0, 0).unwrap());
    copy.name.run = 1;
    for (step, off_m) in [(2, 1e-3), (4, 1e-2)] {
        let trace = Arc::make_mut(&mut copy.steps[step]);
        let evidence = trace.located_mut().and_then(|located| located.evidence.template_mut()).unwrap();
        evidence.triangulate.as_mut().unwrap().range_m += off_m;
    }
    let runs = [Compared::new(A, session.run(0, 0).unwrap()), copy];
    let with = |tolerance: f64| {
        let tolerance = [("m".to_owned(), tolerance)].into();
        compare(&runs, &NewComparison { tolerance, ..asked(&[A, runs[1].name]) }).unwrap().first.remove(0)
    };
    for (tolerance, step) in [(0.0, Some(2)), (5e-3, Some(4)), (2e-2, None)] {
        assert_eq!(with(tolerance).divergence.map(|found| found.step), step, "{tolerance} m");
    }
    let part = with(0.0).divergence.unwrap().part;
    assert_eq!(part.as_deref(), Some("triangulate"));
    session.targets.clear();
}

#[test]
fn columns_have_the_difference_of_each_run_from_the_first_with_its_unit() {
    let world = world();
    let mut session = session(&world);
    let other = fork(&mut session, &world, 3, &[("ncc_min", json!(1.0))]);
    let found = compared(&session, &asked(&[A, other]));
    let column = |name: &str| found.columns.iter().find(|column| column.name == name).unwrap();
    let limits = column("gates.ncc.limit");
    let expected = [None, Some(0.0), Some(0.0), Some(1.0 - 0.7), Some(1.0 - 0.7), Some(1.0 - 0.7)];
    assert_eq!(limits.deltas[1], expected, "the designation has no gate");
    let range = column("range_m");
    assert_eq!(range.unit, "m");
    for (moment, (a, b)) in range.values[0].iter().zip(&range.values[1]).enumerate() {
        assert_eq!(range.deltas[1][moment], b.zip(*a).map(|(b, a)| b - a));
    }
    let states = found.words.iter().find(|column| column.name == "state").unwrap();
    let is_unlike = |moment: usize| states.values[0][moment] != states.values[1][moment];
    assert_eq!(states.differs, [0, 1, 2, 3, 4, 5].map(is_unlike));
    assert_eq!(states.differs[..4], [false, false, false, true], "the fork is lost at its first step");
    let few = NewComparison { columns: Some(vec!["ncc".to_owned()]), ..asked(&[A, other]) };
    assert_eq!(compared(&session, &few).columns.len(), 1);
    let none = NewComparison { columns: Some(vec!["nonsense".to_owned()]), ..few };
    let error = compare(&session.compared(&none.runs).unwrap(), &none).unwrap_err().to_string();
    assert!(error.contains("nonsense"), "{error}");
}

#[test]
fn a_target_picked_later_is_aligned_by_distance_and_time_since_its_pick() {
    let world = world();
    let mut session = session(&world);
    let designation = Designation::new(2, Pixel::new(128.0, 120.0));
    let first = track::designate(&world, designation, &Settings::default()).unwrap();
    session.add_target(None, Settings::default(), Arc::new(first));
    complete(&mut session, &world, 1, 0);
    let runs = [A, RunName { target: 1, run: 0 }];
    let steps = |align: Alignment| -> Vec<(Option<usize>, Option<usize>)> {
        let found = compared(&session, &NewComparison { align, ..asked(&runs) });
        assert!(found.aligned_by.contains(align.word()), "{}", found.aligned_by);
        found.moments.iter().map(|moment| (moment.steps[0], moment.steps[1])).collect()
    };
    let both = |a: usize, b: usize| (Some(a), Some(b));
    let expected = [(Some(0), None), (Some(1), None), both(2, 2), both(3, 3), both(4, 4), both(5, 5)];
    assert_eq!(steps(Alignment::Step), expected);
    let expected = [both(0, 2), both(1, 3), both(2, 4), both(3, 5), (Some(4), None), (Some(5), None)];
    for align in [Alignment::Distance, Alignment::Time] {
        assert_eq!(steps(align), expected, "{align:?}");
    }
}

#[test]
fn trackers_of_another_kind_differ_in_locate() {
    let world = world();
    let mut session = session(&world);
    let other = fork(&mut session, &world, 4, &[("tracker", json!("features"))]);
    let first = compared(&session, &asked(&[A, other])).first.remove(0);
    assert_eq!(first.sentence, "first differ at step 4 in locate: tracker template and features");
}

#[test]
fn one_run_five_runs_a_run_twice_and_an_unknown_run_are_refused_by_name() {
    let world = world();
    let session = session(&world);
    let refused = |runs: &[RunName]| session.compared(runs).unwrap_err().to_string();
    let other = |run: usize| RunName { target: 0, run };
    assert_eq!(refused(&[A]), "runs: name two to 4 runs to compare, not 1");
    assert!(refused(&[0, 1, 2, 3, 4].map(other)).contains("not 5"));
    assert!(refused(&[A, A]).contains("run 0 of target 0 is named twice"));
    assert!(refused(&[A, other(7)]).contains("target 0 has no run 7"));
}
