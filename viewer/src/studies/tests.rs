//! The panel of the validation experiments.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{ListStudies, ShowStudyRows, StartStudy};
use sightline_api::event::Event;
use sightline_api::location::AtStudyJob;
use sightline_study::row::Row;
use sightline_study::wire::{StudyInfo, StudyJob, StudyRows, StudyState};

use crate::command::Command;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::studies::Order;
use crate::tests::calls::{answer, bodies, calls, calls_of};
use crate::tests::{Shown, fixture};

fn job(state: StudyState, k: usize) -> StudyJob {
    StudyJob {
        id: "j1".to_owned(),
        study: "straight".to_owned(),
        state,
        k,
        n: 40,
        doing: "world 7".to_owned(),
        notices: vec!["world 3 offers 12 targets".to_owned()],
        command: "sightline study straight".to_owned(),
    }
}

/// A page that knows one study, and a job of it.
fn with_job(state: StudyState) -> State {
    let mut page = fixture::without_target();
    page.studies.infos = Some(vec![StudyInfo {
        name: "straight".to_owned(),
        question: "How large may a step be?".to_owned(),
        variable: "n_skip".to_owned(),
        unit: String::new(),
        grid: vec!["0".to_owned(), "1".to_owned()],
        configurations: vec!["ncc".to_owned(), "ncc-scale".to_owned()],
        scenarios: vec!["approach-5".to_owned()],
    }]);
    page.told(Event::StudyProgress { job: job(state, 3) });
    page
}

#[test]
fn studies_are_asked_for_once() {
    let mut page = fixture::without_target();
    page.take_requests();
    page.want_studies();
    page.want_studies();
    assert_eq!(calls_of::<ListStudies>(&mut page).len(), 1);
    Shown::pane(Pane::Studies, |_| fixture::without_target()).says("Asking the server for its studies");
}

#[test]
fn a_study_is_started_with_what_was_typed() {
    let mut shown = Shown::pane(Pane::Studies, |_| with_job(StudyState::Running));
    shown.says("How large may a step be?").says("n_skip");
    assert_eq!(shown.click("Start the study"), vec![Command::StartStudy]);
    let mut page = with_job(StudyState::Running);
    page.take_requests();
    page.perform(Command::OrderStudy(Order { seeds: "7,8".to_owned(), ..Order::default() }));
    page.perform(Command::StartStudy);
    let [new] = bodies::<StartStudy>(&mut page).try_into().unwrap();
    assert_eq!((new.study.as_str(), new.seeds.as_slice()), ("straight", &[7, 8][..]));
    let wrong = Shown::pane(Pane::Studies, |_| {
        let mut page = with_job(StudyState::Running);
        page.perform(Command::OrderStudy(Order { seeds: "seven".to_owned(), ..Order::default() }));
        page
    });
    wrong.says("seven is no whole number");
}

#[test]
fn a_job_says_how_far_it_is_and_can_be_stopped_or_read() {
    let mut running = Shown::pane(Pane::Studies, |_| with_job(StudyState::Running));
    running.says("3 of 40").says("running").says("world 7").says("! world 3 offers 12 targets");
    assert_eq!(running.click("Cancel"), vec![Command::CancelStudy("j1".to_owned())]);
    let mut done = Shown::pane(Pane::Studies, |_| with_job(StudyState::Done));
    assert_eq!(done.click("Report"), vec![Command::OpenReport("j1".to_owned())]);
    assert_eq!(done.click("Table"), vec![Command::LookAtStudy("j1".to_owned())]);
    let mut stopped = Shown::pane(Pane::Studies, |_| with_job(StudyState::Cancelled));
    assert_eq!(stopped.click("Resume"), vec![Command::ResumeStudy("j1".to_owned())]);
}

#[test]
fn the_table_has_a_row_for_each_unit_and_grows_with_the_job() {
    let columns = |tracked: u64| {
        let document = serde_json::json!({
            "n_skip": 1, "targets": 20, "tracked": tracked, "err_m_median": 0.0123, "err_m_p95": null
        });
        serde_json::from_value(document).unwrap()
    };
    let row = Row {
        study: "straight".to_owned(),
        configuration: "ncc-scale".to_owned(),
        scenario: "approach-5".to_owned(),
        seed: 7,
        columns: columns(19),
    };
    let mut page = with_job(StudyState::Running);
    page.perform(Command::LookAtStudy("j1".to_owned()));
    let of_job = Call::to::<ShowStudyRows>(&AtStudyJob { job: "j1".to_owned() });
    assert!(calls(&mut page).contains(&of_job));
    page.told(Event::StudyProgress { job: job(StudyState::Running, 4) });
    assert!(calls(&mut page).contains(&of_job), "one more unit is done");
    for rows in [Vec::new(), vec![row]] {
        answer::<ShowStudyRows>(&mut page, &StudyRows { rows });
    }
    let shown = Shown::new(
        [900.0, 600.0],
        |_| page,
        |ui, state, out| {
            crate::layout::show_pane(ui, Pane::Studies, state, out);
        },
    );
    shown.says("median, cm").says("ncc-scale").says("19").says("1.23").says("–");
}
