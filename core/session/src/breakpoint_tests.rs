//! Breakpoints and queries of a session: their hits, that each step is evaluated once, and their saved form.

use std::sync::Arc;

use super::expression::Expression;
use super::query::ask;
use super::*;
use crate::track;
use sightline_geometry::frames::Pose;
use sightline_testing::{PlaneWorld, Trouble};

/// A session with one target over five stops; its run is lost at stop 2, where the cameras are covered.
fn session() -> Session {
    let mut world =
        PlaneWorld::new((0..5).map(|k| Pose::translation(0.3 * f64::from(k), 0.0, 0.0)).collect());
    world.troubles[2] = Trouble::Covered;
    let designation = Designation::new(0, sightline_geometry::frames::Pixel::new(118.3, 131.6));
    let steps = track::run(&world, designation, &Settings::default()).unwrap();
    let mut steps = steps.into_iter().map(Arc::new);
    let mut session = Session::new("s1", "plane", 5);
    session.add_target(None, Settings::default(), steps.next().unwrap());
    for step in steps {
        session.record(0, 0, step).unwrap();
    }
    session
}

fn hits(session: &mut Session) -> Vec<(usize, Vec<usize>)> {
    let views = session.breakpoint_views();
    views.iter().flat_map(|view| view.hits.iter().map(|hits| (hits.run, hits.steps.clone()))).collect()
}

#[test]
fn a_breakpoint_hits_every_step_of_every_run_at_which_it_is_true() {
    let mut session = session();
    let number = session.add_breakpoint("state == lost").unwrap();
    assert_eq!(hits(&mut session), [(0, vec![2])]);
    let run = session.fork(0, 0, 3, &Changes::new(), None).unwrap();
    assert_eq!(hits(&mut session), [(0, vec![2]), (run, vec![2])], "the fork shares the steps before it");
    assert_eq!(session.breakpoint_views()[0].count, 2);
    session.switch_breakpoint(number, false).unwrap();
    assert_eq!((hits(&mut session), session.breakpoint_views()[0].count), (vec![], 0));
    session.switch_breakpoint(number, true).unwrap();
    session.remove_target(0).unwrap();
    assert_eq!(hits(&mut session), []);
}

#[test]
fn a_run_that_goes_on_adds_its_new_steps_and_no_step_twice() {
    let whole = session();
    let steps = whole.run(0, 0).unwrap().steps.clone();
    let mut session = Session::new("s2", "plane", 5);
    session.add_target(None, Settings::default(), Arc::clone(&steps[0]));
    for text in ["step >= 1", "state changes", "has(prev(ncc)) && missing(ncc)"] {
        session.add_breakpoint(text).unwrap();
    }
    for step in &steps[1..] {
        session.breakpoint_views();
        session.record(0, 0, Arc::clone(step)).unwrap();
    }
    let grown = hits(&mut session);
    assert_eq!(grown, hits(&mut session));
    assert_eq!(grown[0], (0, vec![1, 2, 3, 4]));
    let mut at_once = whole;
    for text in ["step >= 1", "state changes", "has(prev(ncc)) && missing(ncc)"] {
        at_once.add_breakpoint(text).unwrap();
    }
    assert_eq!(grown, hits(&mut at_once));
}

#[test]
fn a_comparison_of_runs_waits_for_the_slower_one_and_hits_in_both() {
    let mut session = session();
    session.add_breakpoint("differs(A, B, step_length_m) || step >= 3").unwrap();
    assert_eq!(hits(&mut session), [], "there is no run B yet");
    let run = session.fork(0, 0, 3, &Changes::new(), None).unwrap();
    assert_eq!(hits(&mut session), [], "run B has come to step 2");
    let next = Arc::clone(&session.run(0, 0).unwrap().steps[3]);
    session.record(0, run, next).unwrap();
    assert_eq!(hits(&mut session), [(0, vec![3]), (1, vec![3])]);
}

#[test]
fn breakpoints_are_saved_without_their_hits_and_numbers_are_not_used_again() {
    let mut session = session();
    session.add_breakpoint("ncc < 0.6").unwrap();
    let second = session.add_breakpoint(" step == 3 ").unwrap();
    assert_eq!(session.add_breakpoint("step==3").unwrap(), second, "the same condition is one breakpoint");
    session.switch_breakpoint(second, false).unwrap();
    let saved = session.saved();
    assert_eq!(saved.breakpoints.len(), 2);
    let mut restored = Session::restored(&saved, 5).unwrap();
    assert_eq!(restored.view().breakpoints, session.view().breakpoints);
    restored.remove_breakpoint(0).unwrap();
    assert_eq!(restored.add_breakpoint("fault").unwrap(), 2);
    assert!(restored.remove_breakpoint(7).is_err());
    let mut text = serde_json::to_value(&saved).unwrap();
    text.as_object_mut().unwrap().remove("breakpoints");
    assert!(
        serde_json::from_value::<view::SavedSession>(text).unwrap().breakpoints.is_empty(),
        "older files are read"
    );
}

#[test]
fn a_saved_condition_that_cannot_be_read_any_more_stays_and_says_so() {
    let mut saved = session().saved();
    let expression = "name_of_long_ago > 1".to_owned();
    saved.breakpoints.push(breakpoints::Breakpoint { number: 3, expression, on: true });
    let mut restored = Session::restored(&saved, 5).unwrap();
    let views = restored.breakpoint_views();
    assert!(views[0].problem.as_ref().unwrap().sentence.contains("name_of_long_ago"));
    restored.change_breakpoint(3, "ncc < 1").unwrap();
    assert_eq!(restored.breakpoint_views()[0].problem, None);
    assert!(restored.change_breakpoint(3, "ncc <").is_err());
    assert_eq!(restored.breakpoint(3).unwrap().expression, "ncc < 1");
}

#[test]
fn there_are_at_most_so_many_breakpoints() {
    let mut session = session();
    for step in 0..breakpoints::BREAKPOINT_LIMIT {
        session.add_breakpoint(&format!("step == {step}")).unwrap();
    }
    assert!(session.add_breakpoint("fault").unwrap_err().sentence.contains("64 breakpoints"));
}

#[test]
fn a_query_gives_hits_values_and_unit_of_every_run() {
    let mut session = session();
    session.fork(0, 0, 3, &Changes::new(), None).unwrap();
    let answer = ask(&Expression::read("ncc < 0.6 or step > 2").unwrap(), &session.steps_of(None), true);
    // At the covered stop the score is below the limit in both runs.
    assert_eq!((answer.count, answer.runs[0].hits.as_slice()), (4, &[2, 3, 4][..]));
    assert_eq!(answer.runs[0].values, [0.0, 0.0, 1.0, 1.0, 1.0].map(Some));
    assert_eq!((answer.runs[1].steps, answer.runs[1].hits.as_slice()), (3, &[2][..]));
    let sigma = ask(&Expression::read("prev(sigma_m) * 100").unwrap(), &session.steps_of(Some(0)), true);
    let rows: Vec<_> = session.run(0, 0).unwrap().steps.iter().map(|trace| trace.row()).collect();
    assert_eq!((sigma.unit.as_str(), sigma.runs[0].values[0]), ("m", None));
    assert_eq!(sigma.runs[0].values[1], rows[0].sigma_m.map(|sigma| sigma * 100.0));
    assert!(ask(&Expression::read("ncc").unwrap(), &session.steps_of(None), false).runs[0].values.is_empty());
}
