//! Smoke tests of the panels from a fixed drive: the display of each with data and without.

mod accuracy;
#[path = "../compare/tests/mod.rs"]
mod compare;
#[path = "../breakpoints/tests.rs"]
pub(crate) mod breakpoints;
mod cameras;
pub(crate) mod feature_run;
mod features;
mod figures;
pub(crate) mod fixture;
#[path = "../what_if/tests.rs"]
mod ghost;
mod hazards;
mod history;
mod keeping;
mod playing;
mod records;
mod session;
mod sheets;
mod sizes;
mod shape;
mod shape_run;
#[path = "../figure/tests.rs"]
mod paper;
#[path = "../studies/tests.rs"]
mod studies;
mod timelines;
mod tracking;
#[path = "../command/palette_tests.rs"]
mod palette;
#[path = "../picking/tests.rs"]
mod picking;
pub(crate) mod calls;
#[path = "../tour/tests.rs"]
mod tour;
#[path = "../why/tests.rs"]
mod why;
mod undo;
#[path = "../why/card_tests.rs"]
mod why_card;
#[path = "../why/follow_tests.rs"]
mod following;
mod hovered;
#[path = "../files/tests.rs"]
mod opening;
#[path = "../files/recording_tests.rs"]
mod recordings;
mod pauses;
pub(crate) mod odometry;
mod problems;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;

use crate::command::help;
use crate::command::{Command, Go, Layer, Mode, Stage};
use crate::layout::show_pane;
use crate::net::events::Connection;
use crate::panels::pane::Pane;
use crate::panels::{bars, timeline};
use crate::state::{Progress, State};
use crate::theme;

/// A panel on a separate screen, with its commands.
pub(crate) struct Shown<'a> {
    harness: Harness<'a, Vec<Command>>,
}

impl<'a> Shown<'a> {
    pub(crate) fn new(
        size: [f32; 2],
        state: impl FnOnce(&egui::Context) -> State + 'a,
        show: impl Fn(&mut egui::Ui, &State, &mut Vec<Command>) + 'a,
    ) -> Self {
        // Textures belong to the context that shows them, so that the state is created in the first frame.
        let mut make = Some(state);
        let mut state: Option<State> = None;
        let mut harness = Harness::builder().with_size(size).build_ui_state(
            move |ui, out: &mut Vec<Command>| {
                if let Some(make) = make.take() {
                    theme::apply(ui.ctx(), theme::ColourTheme::Dark);
                    state = Some(make(ui.ctx()));
                }
                if let Some(state) = &state {
                    show(ui, state, out);
                }
            },
            Vec::new(),
        );
        harness.run_steps(4);
        Self { harness }
    }

    pub(crate) fn pane(pane: Pane, state: impl FnOnce(&egui::Context) -> State + 'static) -> Shown<'static> {
        Shown::new([520.0, 420.0], state, move |ui, state, out| {
            show_pane(ui, pane, state, out);
        })
    }

    pub(crate) fn says(&self, words: &str) -> &Self {
        let texts = std::cell::RefCell::new(Vec::new());
        let found = self.harness.query_all_by(|node| {
            let all: Vec<String> = [node.label(), node.value()].into_iter().flatten().collect();
            let has = all.iter().any(|text| text.contains(words));
            texts.borrow_mut().extend(all);
            has
        });
        assert!(found.count() > 0, "“{words}” is not on the screen, but {:?}", texts.take());
        self
    }

    fn hides(&self, words: &str) -> &Self {
        let found = self.harness.query_all_by(|node| {
            [node.label(), node.value()].into_iter().flatten().any(|text| text.contains(words))
        });
        assert_eq!(found.count(), 0, "“{words}” is on the screen");
        self
    }

    /// Whether a text or control on the screen has this name.
    pub(crate) fn has(&self, label: &str) -> bool {
        self.harness.query_all_by_label(label).count() > 0
    }

    pub(crate) fn click(&mut self, label: &str) -> Vec<Command> {
        self.harness.get_by_label(label).click();
        self.harness.run_steps(2);
        self.take_commands()
    }

    /// The commands since the last call, without hovered locations.
    fn take_commands(&mut self) -> Vec<Command> {
        let mut commands = std::mem::take(self.harness.state_mut());
        crate::state::hovered::remove_hovered(&mut commands);
        commands
    }
}

#[test]
fn no_panel_is_blank_before_the_server_said_anything() {
    for pane in Pane::ALL {
        let sentence = match pane {
            Pane::Messages => "No messages",
            Pane::Settings => "Asking the server for its settings",
            _ => "Asking the server for its traverses",
        };
        Shown::pane(pane, |_| fixture::nothing()).says(sentence);
    }
}

#[test]
fn without_a_target_every_panel_tells_how_to_get_one() {
    for pane in
        [Pane::Targets, Pane::Settings, Pane::Strip, Pane::Surface, Pane::Plots, Pane::Gates, Pane::Inspector]
    {
        Shown::pane(pane, |_| fixture::without_target()).says("press T");
    }
}

#[test]
fn an_image_that_is_being_rendered_says_so_with_its_progress() {
    let rendering = |_: &egui::Context| {
        let mut state = fixture::without_target();
        state.cursor.step = fixture::STOPS - 1;
        state.rendering = Some((2, 6));
        state
    };
    Shown::pane(Pane::Left, rendering).says("being rendered: 2 of 6 stops");
    Shown::pane(Pane::Right, rendering).says("being rendered: 2 of 6 stops");
}

#[test]
fn a_step_that_is_not_computed_yet_says_how_far_the_run_is() {
    let running = |context: &egui::Context| {
        let mut state = fixture::at_step(context, fixture::STOPS - 1);
        state.progress.insert((0, 0), Progress { k: 5, n: 6, doing: "step 5".to_owned() });
        state
    };
    for pane in [Pane::Strip, Pane::Surface, Pane::Gates, Pane::Inspector] {
        Shown::pane(pane, running).says("is not computed yet: the run has done 5 of 6");
    }
}

#[test]
fn the_designation_says_that_there_is_no_match_yet() {
    for pane in [Pane::Surface, Pane::Gates] {
        Shown::pane(pane, |context| fixture::at_step(context, 0))
            .says("Target designated here; no match yet. Press → for the first one.");
    }
    let strip = Shown::pane(Pane::Strip, |context| fixture::at_step(context, 0));
    strip.says("template patch").says("right image patch").hides("designated here");
    let stereo = Shown::pane(Pane::StereoProfile, |context| fixture::at_step(context, 0));
    stereo.says("no prediction: the whole curve").hides("designated here");
}

#[test]
fn a_drive_of_one_stop_offers_no_further_step() {
    for pane in [Pane::Surface, Pane::Gates] {
        let shown = Shown::pane(pane, |context| {
            let mut state = fixture::at_step(context, 0);
            state.traverse.as_mut().unwrap().stops.truncate(1);
            state
        });
        shown.says("no match yet. This drive has no further stop.").hides("Press →");
    }
}

#[test]
fn the_left_image_has_a_legend_that_switches_its_layers() {
    let mut shown = Shown::pane(Pane::Left, |context| fixture::at_step(context, 2));
    shown.click("legend");
    for word in ["truth", "match, 3σ · run A", "predicted, 3σ gate", "search window", "subframe"] {
        shown.says(&format!("{word} (legend)"));
    }
    assert_eq!(shown.click("search window (legend)"), vec![Command::ToggleLayer(Layer::SearchWindow)]);
}

#[test]
fn the_right_image_names_the_epipolar_curve() {
    let mut shown = Shown::pane(Pane::Right, |context| fixture::at_step(context, 2));
    shown.click("legend");
    shown.says("epipolar curve");
}

#[test]
fn the_strip_shows_its_patches_in_order_and_a_click_goes_to_the_stage() {
    let titles: Vec<String> =
        crate::panels::strip::patches(&fixture::trace(2)).into_iter().map(|patch| patch.title).collect();
    assert_eq!(titles, ["reference, step 1", "scaled", "rolled", "matched", "difference", "right image"]);
    let mut shown = Shown::pane(Pane::Strip, |context| fixture::at_step(context, 2));
    assert_eq!(shown.click("rolled patch"), vec![Command::SelectStage(Stage::SCALE_ROLL)]);
    assert_eq!(shown.click("matched patch"), vec![Command::SelectStage(Stage::MATCH_TEMPLATE)]);
}

#[test]
fn the_gates_give_value_limit_and_verdict_in_words() {
    let good = Shown::pane(Pane::Gates, |context| fixture::at_step(context, 2));
    good.says("ACCEPTED").says("match score").says("0.830").says("pass");
    let bad = Shown::pane(Pane::Gates, |context| fixture::at_step(context, 3));
    bad.says("REJECTED").says("ncc 0.410 is below its limit 0.700").says("FAIL").says("bad update 1");
}

#[test]
fn the_inspector_shows_the_record_of_the_selected_stage_with_units() {
    let shown = Shown::pane(Pane::Inspector, |context| {
        let mut state = fixture::at_step(context, 2);
        state.stage = Stage::TRIANGULATE;
        state
    });
    shown.says("triangulate").says("range").says("m, rover");
}

#[test]
fn targets_list_their_runs_and_can_be_removed() {
    let mut shown = Shown::pane(Pane::Targets, |context| fixture::at_step(context, 2));
    shown.says("ridge").says("run A").says("5 steps");
    assert_eq!(shown.click("Remove"), vec![Command::RemoveTarget(0)]);
    assert_eq!(shown.click("Pick a target  (T)"), vec![Command::SetMode(Mode::Pick)]);
}

#[test]
fn settings_are_listed_by_group_and_run_from_here_forks() {
    let mut shown = Shown::new(
        [420.0, 900.0],
        |context| {
            let mut state = fixture::at_step(context, 2);
            state.perform(Command::Draft { key: "ncc_min".to_owned(), value: Some(serde_json::json!(0.6)) });
            state
        },
        |ui, state, out| {
            show_pane(ui, Pane::Settings, state, out);
        },
    );
    shown.says("LIMITS").says("TEMPLATE").says("ncc_min").says("1 change against run A, from step 2");
    let commands = shown.click("Run from here");
    let expected = [("ncc_min".to_owned(), serde_json::json!(0.6))].into();
    assert_eq!(commands, vec![Command::RunFromHere(expected)]);
}

#[test]
fn the_status_line_tells_step_state_score_and_error() {
    let shown = Shown::new([1200.0, 60.0], |context| fixture::at_step(context, 2), bars::top);
    shown.says("Sightline").says("2/5").says("TRACKING").says("0.83").says("0.5");
    let lost = Shown::new([1200.0, 60.0], |context| fixture::at_step(context, 3), bars::top);
    lost.says("LOST");
}

#[test]
fn the_stage_bar_selects_stages() {
    let mut shown = Shown::new([1200.0, 60.0], |context| fixture::at_step(context, 2), bars::stages);
    assert_eq!(shown.click("point_stereo"), vec![Command::SelectStage(Stage::POINT_STEREO)]);
    assert_eq!(shown.click("judge"), vec![Command::SelectStage(Stage::JUDGE)]);
}

#[test]
fn the_banner_counts_the_attempts() {
    let mut shown = Shown::new(
        [1200.0, 60.0],
        |_| {
            let mut state = fixture::without_target();
            state.connection = Connection::Gone { attempts: 3 };
            state
        },
        bars::banner,
    );
    shown.says("The server is gone").says("retrying (3)");
    assert_eq!(shown.click("Retry now"), vec![Command::Reconnect]);
}

#[test]
fn a_run_that_goes_on_can_be_cancelled() {
    let mut shown = Shown::new(
        [1200.0, 60.0],
        |context| {
            let mut state = fixture::at_step(context, 2);
            state.progress.insert((0, 0), Progress { k: 7, n: 17, doing: "matching".to_owned() });
            state
        },
        bars::transport,
    );
    shown.says("7 of 17");
    assert_eq!(shown.click("Cancel"), vec![Command::CancelRun { target: 0, run: 0 }]);
    assert_eq!(shown.click(">"), vec![Command::Go(Go::By(1))]);
}

#[test]
fn the_timeline_has_a_cell_of_its_kind_for_every_stop() {
    use timeline::Cell;
    let state = fixture::at_step(&egui::Context::default(), 2);
    let cells: Vec<Cell> = (0..fixture::STOPS).map(|step| timeline::cell(&state, step)).collect();
    let expected = [Cell::Tracking, Cell::Tracking, Cell::Tracking, Cell::Lost, Cell::Failed, Cell::Unknown];
    assert_eq!(cells, expected);
    assert_eq!(timeline::cell(&fixture::without_target(), 2), Cell::Before);
}

#[test]
fn the_help_sheet_lists_the_keys_and_the_limit_of_memory() {
    let shown = Shown::new(
        [900.0, 900.0],
        |context| {
            let mut state = fixture::at_step(context, 2);
            state.mode = Mode::Help;
            state
        },
        help::show,
    );
    shown.says("pick a target").says("256 MiB").says("centre of the first pixel");
}

#[test]
fn map_plots_and_messages_show_without_a_fault() {
    for pane in [Pane::Map, Pane::Plots] {
        for step in 0..fixture::STOPS {
            Shown::pane(pane, move |context| fixture::at_step(context, step));
        }
    }
    let mut shown = Shown::pane(Pane::Messages, |context| {
        let mut state = fixture::at_step(context, 2);
        state.messages.problem("no 3-D position at this pixel", Some("pick another".to_owned()));
        state
    });
    shown.says("no 3-D position").says("pick another");
    assert_eq!(shown.click("Dismiss"), vec![Command::Dismiss(0)]);
}
