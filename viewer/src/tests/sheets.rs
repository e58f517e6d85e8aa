//! Panels as tables: every value of the plot with its unit, the current step marked, copied as CSV, accessible as a table.

use egui::accesskit::Role;
use egui_kittest::kittest::Queryable;

use sightline_track::settings::TrackerKind;
use sightline_track::trace::ArrayName;

use crate::command::actions;
use crate::command::{Command, Go};
use crate::layout::show_pane;
use crate::panels::pane::Pane;
use crate::panels::sheets::of_panel as sheets;
use crate::panels::sheets::{Cell, Sheet};
use crate::state::State;
use crate::tables::MatchOutcome;
use crate::tests::{Shown, feature_run, fixture, shape_run};

fn table(pane: Pane, step: usize) -> Shown<'static> {
    Shown::new(
        [900.0, 420.0],
        move |context| {
            let mut state = fixture::at_step(context, step);
            state.perform(Command::Table(pane));
            state
        },
        move |ui, state, out| {
            show_pane(ui, pane, state, out);
        },
    )
}

fn state(step: usize) -> State {
    fixture::with_history(&egui::Context::default(), step)
}

#[test]
fn every_plot_has_a_table_with_a_row_for_every_step_and_the_present_one_marked() {
    let state = state(2);
    for pane in [Pane::Plots, Pane::Tolerances, Pane::Budget, Pane::Map] {
        let sheet = &sheets::of(&state, pane).unwrap()[0];
        let steps: Vec<Option<usize>> = sheet.rows.iter().map(|row| row.step).collect();
        let count = if pane == Pane::Map { fixture::STOPS } else { fixture::STOPS - 1 };
        assert_eq!(steps, (0..count).map(Some).collect::<Vec<_>>(), "{pane:?}");
        let present: Vec<usize> =
            sheet.rows.iter().filter(|row| row.is_present).filter_map(|row| row.step).collect();
        assert_eq!(present, [2], "{pane:?}");
        assert!(sheet.rows.iter().all(|row| row.cells.len() == sheet.columns.len()), "{pane:?}");
        assert!(sheet.columns.iter().any(|column| !column.unit.is_empty()), "{pane:?} has units");
    }
}

#[test]
fn the_table_over_the_steps_has_the_values_of_the_run_in_the_units_of_the_plot() {
    let state = state(2);
    let sheet = sheets::of(&state, Pane::Plots).unwrap().remove(0);
    let column = |name: &str| sheet.columns.iter().position(|column| column.head() == name).unwrap();
    let row = state.row_at(2).unwrap();
    let value = |name: &str| sheet.rows[2].cells[column(name)].clone();
    assert_eq!(value("state"), Cell::Word("tracking".to_owned()));
    assert_eq!(value("scores match score"), Cell::from(row.ncc));
    assert_eq!(value("pixel error, px"), Cell::from(row.err_px));
    assert_eq!(value("position error error, cm"), Cell::from(row.err_m.map(|m| m * 100.0)));
    assert_eq!(sheet.csv().lines().count(), 1 + sheet.rows.len());
}

#[test]
fn the_surface_as_a_table_has_its_marks_and_copies_every_score() {
    let state = state(2);
    let sheets = sheets::of(&state, Pane::Surface).unwrap();
    let matched = fixture::trace(2).template().unwrap().match_template.clone().unwrap();
    let peak = sheets[0].rows.iter().find(|row| row.is_present).unwrap();
    assert_eq!(peak.cells[1], Cell::Number(matched.peak.pixel.x));
    assert_eq!(peak.cells[3], Cell::Number(matched.peak.score));
    let names: Vec<String> = sheets[0].rows.iter().map(|row| row.cells[0].shown()).collect();
    assert!(names.contains(&"predicted".to_owned()) && names.contains(&"truth".to_owned()), "{names:?}");
    let all = sheets[1].csv();
    assert_eq!(all.lines().count(), 1 + 31 * 31, "a line for every position");
    assert!(all.starts_with("\"x, px\",\"y, px\",ncc\r\n"), "{}", &all[..40]);
}

#[test]
fn the_stereo_profile_as_a_table_marks_its_best_range() {
    let state = state(2);
    let sheets = sheets::of(&state, Pane::StereoProfile).unwrap();
    let stereo = fixture::trace(2).template().unwrap().point_stereo.clone().unwrap();
    assert_eq!(sheets[1].rows.len(), stereo.curve.len());
    assert!(sheets[1].rows.iter().any(|row| row.is_present));
    assert_eq!(sheets[0].rows[0].cells[1], Cell::Number(stereo.range_m));
}

#[test]
fn the_feature_tables_match_the_evidence() {
    let mut state = feature_run::at_step(&egui::Context::default(), 2);
    let [residuals, draws, all] = sheets::of(&state, Pane::Features).unwrap().try_into().unwrap();
    let features = state.features().ready().unwrap().clone();
    let sum = |sheet: &Sheet, column: usize| -> f64 {
        sheet.rows.iter().map(|row| number(&row.cells[column])).sum()
    };
    let of_kind =
        |kind: MatchOutcome| features.iter().filter(|feature| MatchOutcome::of(feature) == kind).count();
    assert_eq!(sum(&residuals, 2), of_kind(MatchOutcome::Inlier) as f64);
    assert_eq!(sum(&residuals, 3), of_kind(MatchOutcome::Outlier) as f64);
    let motion = state.feature_evidence().unwrap().fit_motion.clone().unwrap();
    assert_eq!(draws.rows.len(), motion.consensus_by_draw.len());
    let best = draws.rows.iter().find(|row| row.is_present).unwrap();
    assert_eq!(number(&best.cells[1]), f64::from(*motion.consensus_by_draw.iter().max().unwrap()));
    assert_eq!(all.rows.len(), features.len());
    assert_eq!(all.rows[0].cells[0], Cell::Number(features[0].pixel.x));
    // The table contains the rows that pass the filters.
    state.feature_view.residual_m = [0.0, 0.0];
    let [.., fewer] = &sheets::of(&state, Pane::Features).unwrap()[..] else { panic!("three tables") };
    assert!(fewer.rows.len() < all.rows.len());
}

#[test]
fn the_shape_tables_match_the_evidence() {
    let state = shape_run::at_step(&egui::Context::default(), TrackerKind::Shape, 2);
    let [numbers, errors, coarse, way] = sheets::of(&state, Pane::Shape).unwrap().try_into().unwrap();
    let found = state.shape_evidence().unwrap().registration.clone().unwrap();
    assert_eq!(numbers.rows[0].cells[1], Cell::from(found.mean_m[0].map(|m| m * 1000.0)));
    let seen =
        |name: ArrayName| state.array(name).ready().unwrap().values.iter().filter(|v| v.is_finite()).count();
    let sum = |column: usize| -> f64 { errors.rows.iter().map(|row| number(&row.cells[column])).sum() };
    assert_eq!(sum(2), seen(ArrayName::ERROR_BEFORE) as f64);
    assert_eq!(sum(3), seen(ArrayName::ERROR_FINE) as f64);
    // The best shift is at the position that the registration reports.
    assert_eq!(coarse.rows.len(), seen(ArrayName::COARSE_SEARCH));
    let best = coarse.rows.iter().find(|row| row.is_present).unwrap();
    let least = coarse.rows.iter().map(|row| number(&row.cells[2])).fold(f64::INFINITY, f64::min);
    assert_eq!(number(&best.cells[2]), least);
    let path = state.refine_path().ready().unwrap();
    assert_eq!(way.rows.len(), path.len());
    assert_eq!(number(&way.rows[1].cells[2]), path[1].mean_m * 1000.0);
    let shifts = [&coarse.rows[0], &coarse.rows[coarse.rows.len() - 1]].map(|row| number(&row.cells[0]));
    assert!((shifts[0] + shifts[1]).abs() < 1e-9, "as far to either side: {shifts:?}");
}

fn number(cell: &Cell) -> f64 {
    if let Cell::Number(value) = cell { *value } else { panic!("no number: {cell:?}") }
}

#[test]
fn a_table_without_data_says_how_to_fill_it() {
    for pane in sheets::panes() {
        let sentence = sheets::of(&fixture::without_target(), pane);
        if pane == Pane::Map {
            assert!(sentence.is_ok(), "the drive is known without a target");
            continue;
        }
        assert!(sentence.unwrap_err().len() > 20, "{pane:?}");
    }
}

#[test]
fn a_screen_reader_finds_a_table_with_head_rows_and_cells_and_a_step_leads_there() {
    let mut shown = table(Pane::Plots, 2);
    let count = |role: Role| shown.harness.query_all_by_role(role).count();
    assert_eq!(count(Role::Table), 1);
    assert_eq!(count(Role::Row), 1 + fixture::STOPS - 1);
    let columns = count(Role::ColumnHeader);
    assert!(columns >= 6, "{columns}");
    assert_eq!(count(Role::Cell), (columns - 1) * (fixture::STOPS - 1), "the step itself is a button");
    shown.harness.get_by_role_and_label(Role::Row, "step 2, the current one");
    shown.harness.get_by_role_and_label(Role::ColumnHeader, "pixel error, px");
    assert_eq!(shown.click("go to step 4"), vec![Command::Go(Go::Step(4))]);
}

#[test]
fn a_table_is_copied_as_csv() {
    let mut shown = table(Pane::Budget, 2);
    shown.harness.get_by_label("copy Error budget over range as CSV").click();
    shown.harness.step();
    let copied = shown.harness.output().platform_output.commands.iter().find_map(|command| match command {
        egui::OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    let copied = copied.unwrap();
    assert!(copied.starts_with("step,\"range, m\",\"3σ without tracking, cm\""), "{copied}");
    assert_eq!(copied.lines().count(), fixture::STOPS);
}

#[test]
fn the_switch_has_a_name_and_the_palette_knows_it() {
    let mut shown = Shown::new(
        [300.0, 60.0],
        |context| fixture::at_step(context, 2),
        |ui, state, out| {
            sheets::switch(ui, state, Pane::Plots, out);
            sheets::switch(ui, state, Pane::Gates, out);
        },
    );
    assert_eq!(shown.click("Over the steps as table"), vec![Command::Table(Pane::Plots)]);
    assert_eq!(shown.harness.query_all_by_role(Role::Button).count(), 1, "gates are a table already");
    let found = actions::find(&fixture::without_target(), "match scores table");
    assert_eq!(found[0].command, Command::Table(Pane::Surface));
}

#[test]
fn ten_thousand_steps_are_made_row_by_row() {
    let mut shown = Shown::new(
        [700.0, 400.0],
        |context| {
            let mut state = fixture::at_step(context, 2);
            let run = &mut state.session.as_mut().unwrap().targets[0].runs[0];
            let row = run.rows[2].clone();
            run.rows.extend((5..10_000).map(|step| sightline_session::step::StepRow { step, ..row.clone() }));
            state.perform(Command::Table(Pane::Plots));
            state
        },
        |ui, state, out| {
            show_pane(ui, Pane::Plots, state, out);
        },
    );
    let begun = std::time::Instant::now();
    shown.harness.step();
    let rows = shown.harness.query_all_by_role(Role::Row).count();
    assert!(rows < 40, "{rows} rows for the few that are seen");
    assert!(begun.elapsed().as_secs_f64() < 1.0, "{:?}", begun.elapsed());
    shown.says("10000 rows");
}
