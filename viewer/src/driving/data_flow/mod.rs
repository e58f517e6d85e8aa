//! The panel “Data flow”: the components of targeted driving, and the last message on each edge between them at the
//! cursor's stop.
//!
//! Source: Kim et al. (2009), §3, Fig. 1; R2, R3.

mod messages;

use crate::command::Command;
use crate::driving::pause;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets::{Cell, Column, Sheet};
use crate::state::State;
use crate::theme;
use egui::{
    Align2, FontId, Frame, Label, Margin, Pos2, Rangef, Rect, RichText, ScrollArea, Stroke, Ui, UiBuilder,
    pos2, vec2,
};

use self::messages::{Component, Message, messages};

/// Minimum size of the drawing in a narrow panel, points.
const LEAST: [f32; 2] = [330.0, 500.0];
/// Width from which the drawing may be lower, points.
const WIDE: f32 = 560.0;
/// Minimum height of a wide drawing, points.
const LOW: f32 = 340.0;
/// Free space between two components, points.
const GAP: [f32; 2] = [18.0, 18.0];
/// Columns and rows of the drawing.
const GRID: [f32; 2] = [3.0, 4.0];

impl Component {
    /// Column and row in the drawing, and the number of rows.
    const fn place(self) -> [f32; 3] {
        match self {
            Self::Operator => [0.0, 0.0, 1.0],
            Self::Tracker => [0.0, 1.0, 1.0],
            Self::MastCameras => [0.0, 2.0, 1.0],
            Self::MastPointing => [0.0, 3.0, 1.0],
            Self::Goal => [1.0, 0.0, 1.0],
            Self::HazardMap => [1.0, 1.0, 1.0],
            Self::Hazcams => [1.0, 2.0, 1.0],
            Self::PoseEstimate => [1.0, 3.0, 1.0],
            Self::Navigator => [2.0, 0.0, 2.0],
            Self::Locomotor => [2.0, 2.0, 2.0],
        }
    }

    fn rect(self, whole: Rect) -> Rect {
        let [column, row, rows] = self.place();
        let cell = vec2(whole.width() / GRID[0], whole.height() / GRID[1]);
        let first = whole.min + vec2(column * cell.x, row * cell.y);
        let size = vec2(cell.x - GAP[0], rows * cell.y - GAP[1]);
        Rect::from_min_size(first, size)
    }
}

/// The panel “Data flow”.
pub(crate) struct DataFlow;

impl Panel for DataFlow {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        if state.run().is_none() {
            return Some(state.missing_target());
        }
        let is_there = state.trace().is_some() || state.paused_before(state.cursor.step).is_some();
        (!is_there).then(|| state.missing_step())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets)
    }
}

/// The messages as a table.
fn sheets(state: &State) -> Result<Vec<Sheet>, String> {
    if let Some(missing) = DataFlow.missing(state) {
        return Err(missing);
    }
    let columns = ["from", "to", "message"].map(|name| Column::new(name, "")).to_vec();
    let mut sheet = Sheet::of(format!("messages at step {}", state.cursor.step), columns);
    for message in messages(state) {
        let word = |part: Component| Cell::Word(part.name().to_owned());
        let text = message.text.map_or(Cell::Nothing, Cell::Word);
        sheet.row(false, vec![word(message.from), word(message.to), text]);
    }
    Ok(vec![sheet])
}

fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let messages = messages(state);
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        let room = ui.available_size();
        let least = if room.x < WIDE { LEAST } else { [WIDE, LOW] };
        let size = room.max(least.into());
        let (whole, _) = ui.allocate_exact_size(size, egui::Sense::hover());
        for message in &messages {
            arrow(ui, message, whole);
        }
        for part in Component::ALL {
            let inner = UiBuilder::new().max_rect(part.rect(whole)).id_salt(part.name());
            ui.scope_builder(inner, |ui| component(ui, part, &messages, out));
        }
        if let Some(before) = state.paused_before(state.cursor.step) {
            let text = pause::not_computed(before);
            let font = FontId::proportional(11.0);
            ui.painter().text(whole.right_bottom(), Align2::RIGHT_BOTTOM, text, font, theme::accent());
        }
    });
}

/// Draws a component: its name, which selects its stage, and its messages by receiver.
fn component(ui: &mut Ui, part: Component, messages: &[Message], out: &mut Vec<Command>) {
    let rect = ui.max_rect();
    let frame = Frame::new()
        .fill(theme::panel())
        .stroke(Stroke::new(1.0, theme::line()))
        .corner_radius(4)
        .inner_margin(Margin::same(5));
    frame.show(ui, |ui| {
        ui.set_min_size(rect.size() - vec2(10.0, 10.0));
        ui.set_max_size(rect.size() - vec2(10.0, 10.0));
        ui.set_clip_rect(rect.intersect(ui.clip_rect()));
        ui.spacing_mut().item_spacing.y = 1.0;
        let title = RichText::new(part.name()).size(12.0).strong();
        match part.stage() {
            None => {
                ui.label(title.color(theme::strong()));
            }
            Some(stage) => {
                if ui.link(title).on_hover_text("Selects the stage: the inspector shows its record").clicked()
                {
                    out.push(Command::SelectStage(stage));
                }
            }
        }
        for message in messages.iter().filter(|message| message.from == part) {
            let text = message.text.as_deref().unwrap_or("nothing at this stop");
            let colour = if message.text.is_some() { theme::text() } else { theme::weak() };
            let words = format!("→ {}: {text}", message.to.name());
            ui.add(Label::new(RichText::new(words).size(11.0).color(colour)).wrap());
        }
    });
}

/// Draws the edge of a message from border to border.
fn arrow(ui: &Ui, message: &Message, whole: Rect) {
    let [from, to] = [message.from, message.to].map(|part| part.rect(whole));
    let colour = if message.text.is_some() { theme::accent() } else { theme::unknown() };
    let (start, end) = ends(from, to);
    ui.painter().arrow(start, end - start, Stroke::new(1.5, colour));
}

/// The end points of the edge between two components.
fn ends(from: Rect, to: Rect) -> (Pos2, Pos2) {
    let shared = |a: Rangef, b: Rangef| {
        let both = a.intersection(b);
        (both.min < both.max).then(|| both.center())
    };
    let facing = |a: Rangef, b: Rangef| if a.max <= b.min { (a.max, b.min) } else { (a.min, b.max) };
    let (x, y) = (facing(from.x_range(), to.x_range()), facing(from.y_range(), to.y_range()));
    match (shared(from.x_range(), to.x_range()), shared(from.y_range(), to.y_range())) {
        (Some(middle), _) => (pos2(middle, y.0), pos2(middle, y.1)),
        (None, Some(middle)) => (pos2(x.0, middle), pos2(x.1, middle)),
        (None, None) => (pos2(x.0, y.0), pos2(x.1, y.1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Stage;
    use crate::panels::pane::Pane;
    use crate::tests::{Shown, fixture};
    use serde_json::json;

    fn driving(context: &egui::Context) -> State {
        let mut state = fixture::at_step(context, 2);
        let steering = json!({ "target": 0, "run": 0, "command": { "standoff_m": 1.5 } });
        if let Some(session) = &mut state.session {
            session.steering = Some(serde_json::from_value(steering.clone()).unwrap());
        }
        let mut cycles: Vec<_> = (0..3).map(fixture::cycle).collect();
        cycles[1]["report"] = json!({ "wheels_m": 0.5, "duration_s": 40.0, "tilt_deg": 3.0, "stall": null });
        cycles[2]["range_points"] = json!(1234);
        let view = json!({ "steering": steering, "cycles": cycles, "summary": null, "is_driving": true });
        state.driving.view = Some(("s1".to_owned(), serde_json::from_value(view).unwrap()));
        state
    }

    #[test]
    fn every_edge_has_its_last_message_and_a_component_leads_to_its_record() {
        let mut shown = Shown::new([560.0, 460.0], driving, show);
        for words in [
            "→ goal: standoff 1.50 m, tolerance 5.0 cm",
            "→ navigator: (4.00, 0.50) m, 3.00 m away",
            "→ hazard map: 1234 points",
            "→ pose estimate: 0.50 m by the wheels from stop 1, tilt 3.0°",
            "→ mast pointing: target at",
            "→ tracker: pair",
            "→ navigator: nothing at this stop",
        ] {
            shown.says(words);
        }
        assert_eq!(shown.click("goal"), [Command::SelectStage(Stage::SET_GOAL)]);
    }

    #[test]
    fn the_table_has_every_edge_and_says_nothing_where_nothing_was_said() {
        let state = driving(&egui::Context::default());
        let [sheet] = &sheets(&state).unwrap()[..] else { panic!("one table") };
        assert_eq!(sheet.rows.len(), 12);
        let silent = |state: &State| {
            let of = |message: Message| message.text.is_none().then_some((message.from, message.to));
            messages(state).into_iter().filter_map(of).collect::<Vec<_>>()
        };
        let silent_here = silent(&state);
        let is_nothing = |row: &&crate::panels::sheets::SheetRow| row.cells[2] == Cell::Nothing;
        assert_eq!(sheet.rows.iter().filter(is_nothing).count(), silent_here.len());
        assert!(silent_here.contains(&(Component::MastCameras, Component::PoseEstimate)), "odometry is off");
        assert!(
            silent_here.contains(&(Component::HazardMap, Component::Navigator)),
            "no path was chosen on a map"
        );
        // A replayed drive has neither command nor decisions.
        let replayed = silent(&fixture::at_step(&egui::Context::default(), 2));
        for edge in [
            (Component::Operator, Component::Goal),
            (Component::Goal, Component::Navigator),
            (Component::Navigator, Component::Locomotor),
        ] {
            assert!(replayed.contains(&edge) && !silent_here.contains(&edge), "{edge:?}");
        }
    }

    #[test]
    fn the_panel_says_what_is_missing() {
        Shown::pane(Pane::DataFlow, |_| State::new("http://localhost".to_owned(), None)).says("target");
    }

    #[test]
    fn an_edge_runs_between_the_borders_that_face_each_other() {
        let rect = |x: f32, y: f32| Rect::from_min_size(pos2(x, y), vec2(10.0, 10.0));
        assert_eq!(ends(rect(0.0, 0.0), rect(20.0, 0.0)), (pos2(10.0, 5.0), pos2(20.0, 5.0)));
        assert_eq!(ends(rect(0.0, 20.0), rect(0.0, 0.0)), (pos2(5.0, 20.0), pos2(5.0, 10.0)));
        assert_eq!(ends(rect(0.0, 20.0), rect(20.0, 0.0)), (pos2(10.0, 20.0), pos2(20.0, 10.0)));
    }
}
