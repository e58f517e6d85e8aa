//! The panel of the validation studies.

use egui_kittest::kittest::{NodeT, Queryable};
use sightline_api::endpoint::Call;
use sightline_api::endpoints::{CancelStudy, ListStudies, ListStudyJobs, ShowStudyRows, StartStudy};
use sightline_api::event::Event;
use sightline_api::location::AtStudyJob;
use sightline_api::wire::Problem;
use sightline_study::row::Row;
use sightline_study::wire::{StudyInfo, StudyJob, StudyRows, StudyState};

use crate::command::Command;
use crate::figure::request::{FigureFormat, FigureRequest};
use crate::figure::save;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::state::messages::Weight;
use crate::studies::StudyForm;
use crate::tests::calls::{answer, bodies, calls, calls_of, refuse};
use crate::tests::{Shown, fixture};

fn job(state: StudyState, k: usize) -> StudyJob {
    StudyJob {
        id: "j1".to_owned(),
        study: "straight".to_owned(),
        state,
        k,
        n: 40,
        share: 0.5,
        seconds: 60.0,
        revision: k as u64,
        doing: "world 7".to_owned(),
        notices: vec!["world 3 offers 12 targets".to_owned()],
        command: "sightline study straight".to_owned(),
    }
}

/// A page with one study, and a job of it.
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
        points_per_value: 1,
    }]);
    page.apply_event(Event::StudyProgress { job: job(state, 3) });
    page
}

#[test]
fn studies_are_requested_once() {
    let mut page = fixture::without_target();
    page.take_requests();
    page.read_studies_once();
    page.read_studies_once();
    assert_eq!(calls_of::<ListStudies>(&mut page).len(), 1);
    Shown::pane(Pane::Studies, |_| fixture::without_target()).says("Asking the server for its studies");
}

#[test]
fn a_study_is_started_with_what_was_typed() {
    let mut shown = Shown::pane(Pane::Studies, |_| with_job(StudyState::Running));
    shown.says("How large may a step be?").says("n_skip");
    shown.says("2 configurations × 2 points × 2 worlds = 8 runs, about");
    assert_eq!(shown.click("Start the study"), vec![Command::StartStudy]);
    let mut page = with_job(StudyState::Running);
    page.take_requests();
    page.perform(Command::SetStudyForm(StudyForm { seeds: "7,8".to_owned(), ..StudyForm::default() }));
    page.perform(Command::StartStudy);
    let [new] = bodies::<StartStudy>(&mut page).try_into().unwrap();
    assert_eq!((new.study.as_str(), new.seeds.as_slice()), ("straight", &[7, 8][..]));
    let wrong = Shown::pane(Pane::Studies, |_| {
        let mut page = with_job(StudyState::Running);
        page.perform(Command::SetStudyForm(StudyForm { seeds: "seven".to_owned(), ..StudyForm::default() }));
        page
    });
    wrong.says("seven is not a whole number");
    // Configurations and grid are also checked as they are entered; errors name the field.
    let typed = |configurations: &str, grid: &str| {
        let (configurations, grid) = (configurations.to_owned(), grid.to_owned());
        Shown::pane(Pane::Studies, move |_| {
            let mut page = with_job(StudyState::Running);
            page.perform(Command::SetStudyForm(StudyForm { configurations, grid, ..StudyForm::default() }));
            page
        })
    };
    typed("ncc,foo", "").says("configurations: ");
    typed("", "1,-2").says("n_skip: ");
    typed("ncc", "1,2").hides("configurations: ").hides("n_skip: ");
}

#[test]
fn a_started_study_clears_the_error_of_the_refused_one() {
    let mut page = with_job(StudyState::Running);
    page.take_requests();
    page.perform(Command::StartStudy);
    refuse::<StartStudy>(&mut page, Problem::new(422, "grid", "", "grid: 99 is too large."));
    let problem =
        |page: &State| page.messages.newest().filter(|message| message.weight == Weight::Problem).cloned();
    assert!(problem(&page).is_some());
    page.perform(Command::StartStudy);
    answer::<StartStudy>(&mut page, &job(StudyState::Waiting, 0));
    assert_eq!((problem(&page), page.messages.card()), (None, None));
}

#[test]
fn a_job_says_how_far_it_is_and_can_be_stopped_or_read() {
    let mut running = Shown::pane(Pane::Studies, |_| with_job(StudyState::Running));
    running
        .says("3 of 40 runs")
        .says("about 1 min left")
        .says("running")
        .says("world 7")
        .says("! world 3 offers 12 targets");
    assert_eq!(running.click("Cancel"), vec![Command::CancelStudy("j1".to_owned())]);
    let cancelling = Shown::pane(Pane::Studies, |_| {
        let mut state = with_job(StudyState::Running);
        state.perform(Command::CancelStudy("j1".to_owned()));
        state
    });
    cancelling.says("cancelling …");
    let mut done = Shown::pane(Pane::Studies, |_| with_job(StudyState::Done));
    assert_eq!(done.click("Report"), vec![Command::OpenReport("j1".to_owned())]);
    assert_eq!(done.click("Result"), vec![Command::ShowStudy("j1".to_owned())]);
    let mut stopped = Shown::pane(Pane::Studies, |_| with_job(StudyState::Cancelled));
    assert_eq!(stopped.click("Resume"), vec![Command::ResumeStudy("j1".to_owned())]);
}

#[test]
fn the_buttons_of_a_study_stay_the_same_while_it_begins_and_another_one_is_started() {
    // A click is handled a frame after the control was found, so that no other one may take its position and id.
    let shown = |first: StudyJob, other: Option<StudyJob>| {
        Shown::pane(Pane::Studies, move |_| {
            let mut page = with_job(StudyState::Running);
            page.studies.jobs = std::iter::once(first).chain(other).collect();
            page
        })
    };
    let waiting = StudyJob { n: 0, k: 0, ..job(StudyState::Waiting, 0) };
    let before = shown(waiting, None);
    let before = before.harness.get_by_label("Cancel").accesskit_node().id();
    let running = shown(job(StudyState::Running, 3), None);
    assert_eq!(running.harness.get_by_label("Cancel").accesskit_node().id(), before);
    let other = StudyJob { id: "j2".to_owned(), ..job(StudyState::Done, 4) };
    let two = shown(job(StudyState::Running, 3), Some(other));
    assert_eq!(two.harness.get_by_label("Cancel").accesskit_node().id(), before);
}

#[test]
fn a_late_progress_event_does_not_revive_a_cancelled_study() {
    let mut page = with_job(StudyState::Running);
    page.perform(Command::CancelStudy("j1".to_owned()));
    // The event of the end arrives before the reply, which was written while the study was still running.
    page.apply_event(Event::StudyProgress { job: job(StudyState::Cancelled, 5) });
    answer::<CancelStudy>(&mut page, &job(StudyState::Running, 4));
    assert_eq!(page.studies.jobs[0].state, StudyState::Cancelled);
    page.apply_event(Event::StudyProgress { job: job(StudyState::Running, 4) });
    assert_eq!(page.studies.jobs[0].state, StudyState::Cancelled);
    page.apply_event(Event::StudyProgress { job: job(StudyState::Waiting, 6) });
    assert_eq!(page.studies.jobs[0].state, StudyState::Waiting, "resumed elsewhere");
}

#[test]
fn a_restarted_server_that_counts_anew_is_heard() {
    let mut page = with_job(StudyState::Running);
    page.studies.make_stale();
    page.read_studies_once();
    answer::<ListStudyJobs>(&mut page, &vec![job(StudyState::Cancelled, 1)]);
    assert_eq!(page.studies.jobs[0].state, StudyState::Cancelled);
}

#[test]
fn the_bar_moves_while_worlds_are_rendered() {
    let shown = Shown::pane(Pane::Studies, |_| {
        let mut page = with_job(StudyState::Running);
        let rendering = StudyJob { share: 0.2, ..job(StudyState::Running, 0) };
        page.apply_event(Event::StudyProgress { job: StudyJob { revision: 9, ..rendering } });
        page
    });
    shown.says("20 % done").says("0 of 40 runs");
}

#[test]
fn the_state_of_a_study_is_said_once() {
    let done = StudyJob { doing: "done".to_owned(), ..job(StudyState::Done, 40) };
    let shown = Shown::pane(Pane::Studies, |_| {
        let mut page = with_job(StudyState::Running);
        page.apply_event(Event::StudyProgress { job: done });
        page
    });
    assert_eq!(shown.harness.query_all_by_label("done").count(), 1);
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
    page.perform(Command::ShowStudy("j1".to_owned()));
    let of_job = Call::to::<ShowStudyRows>(&AtStudyJob { job: "j1".to_owned() });
    assert!(calls(&mut page).contains(&of_job));
    page.apply_event(Event::StudyProgress { job: job(StudyState::Running, 4) });
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

/// A study with results.
fn with_result() -> State {
    let mut page = with_job(StudyState::Done);
    page.perform(Command::ShowStudy("j1".to_owned()));
    let rows = (0..10u64).map(|k| Row {
        study: "straight".to_owned(),
        configuration: ["ncc", "sightline"][(k % 2) as usize].to_owned(),
        scenario: "approach-5".to_owned(),
        seed: 7,
        columns: serde_json::from_value(
            serde_json::json!({"n_skip": k / 2, "targets": 20, "tracked": 20 - k}),
        )
        .unwrap(),
    });
    answer::<ShowStudyRows>(&mut page, &StudyRows { rows: rows.collect() });
    page
}

#[test]
fn a_figure_of_a_study_has_its_result_and_no_form() {
    let shown = Shown::pane(Pane::Studies, |_| with_result());
    shown.says("Start the study").says("targets tracked, %");
    let context = egui::Context::default();
    let mut output = context.run_ui(egui::RawInput::default(), |_| {});
    output.textures_delta.clear();
    let request = FigureRequest { pane: Pane::Studies, kind: FigureFormat::Svg };
    let file = save::take(&context, &with_result(), &[], request).unwrap();
    let text = String::from_utf8(file.bytes).unwrap();
    assert!(text.contains("targets tracked, %") && !text.contains("Start the study"), "{text}");
    // Three numbered ticks: 0, 50 and 100.
    assert!(text.contains(">50</text>"), "{text}");
}
