//! The inspector: the quantities that the selected stage declares, then the rest of its evidence as a tree.

use egui::{CollapsingHeader, RichText, ScrollArea, Ui};
use serde_json::Value;
use sightline_record::{Kind, Quantity, Unit, Value as Recorded, label, unit_label};
use sightline_session::records;
use sightline_session::step::RunStep;
use sightline_session::why;
use sightline_track::settings::TrackerKind;

use crate::command::{Command, Stage};
use crate::compare::panel::readouts;
use crate::panels::panel::Panel;
use crate::panels::{digits, numbers};
use crate::state::State;
use crate::{panels, theme};

/// The panel “Inspector”.
pub(crate) struct Inspector;

impl Panel for Inspector {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }
}

/// Shows the record.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(state.stage().word()).strong().color(theme::strong()));
        ui.label(theme::note(state.stage().question()));
    });
    let Some(trace) = state.trace() else {
        panels::missing(ui, "", &state.missing_step());
        return;
    };
    let stages = recorded(trace, state.stage());
    if stages.is_empty() {
        panels::missing(ui, "", &not_reached(trace, state));
        return;
    }
    ScrollArea::vertical().auto_shrink(false).id_salt(state.stage()).show(ui, |ui| {
        readouts::record(ui, state, |trace| self::record(trace, state.stage()));
        for (index, stage) in stages.into_iter().enumerate() {
            if index > 0 {
                ui.add_space(4.0);
                ui.label(theme::title(&label(&stage.schema().stage, Unit::One)));
                ui.label(theme::note(stage.schema().question.as_ref()));
            }
            section(ui, trace, stage, out);
        }
        if let Some(truth) = records::stage("truth").filter(|truth| truth.is_reached(trace)) {
            ui.add_space(4.0);
            ui.label(theme::title("against the truth"));
            section(ui, trace, truth, out);
        }
    });
}

/// A stage of the record.
type RecordedStage = &'static sightline_record::Stage<RunStep>;

/// The stages of the record that a stage of the bar shows, those that were reached: its own first, then those that have
/// no place of their own in the bar of the tracker.
fn recorded(trace: &RunStep, stage: Stage) -> Vec<RecordedStage> {
    let tracker = trace.located().map_or_else(TrackerKind::default, |l| l.evidence.tracker());
    let mut of = Stage::PREDICT;
    let mut shown: Vec<RecordedStage> = Vec::new();
    for recorded in records::stages().iter().filter(|recorded| is_in_bar(recorded)) {
        let word = recorded.schema().stage.as_ref();
        let own = Stage::of(tracker).find(|stage| stage.word() == word);
        of = own.unwrap_or(if of.is_step_of_locate() { of } else { Stage::LOCATE });
        // The detection counts what its next two steps made of the features.
        let counts = matches!(stage, Stage::MATCH_FEATURES | Stage::TRIANGULATE) && of == Stage::DETECT;
        if (of == stage || counts) && recorded.is_reached(trace) {
            shown.push(recorded);
        }
    }
    shown.sort_by_key(|recorded| recorded.schema().stage != stage.word());
    shown
}

/// Whether a stage of the record belongs to one of the bar: the row repeats others, and the truth is shown with all.
fn is_in_bar(stage: &sightline_record::Stage<RunStep>) -> bool {
    let schema = stage.schema();
    !schema.path.is_empty() && schema.stage != "truth"
}

/// The quantities of a stage, then the rest of its evidence.
fn section(ui: &mut Ui, trace: &RunStep, stage: RecordedStage, out: &mut Vec<Command>) {
    let schema = stage.schema();
    egui::Grid::new(ui.next_auto_id()).num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (index, quantity) in schema.quantities.iter().enumerate() {
            let name = format!("{}.{}", schema.stage, quantity.name);
            show_quantity(ui, trace.step, (&name, quantity), &stage.value(trace, index), out);
            ui.end_row();
        }
    });
    let place = Place { stage, path: String::new(), step: trace.step };
    entries(ui, &place, &records::rest(stage, trace), out);
}

/// A quantity: its name, which leads to its origin, and its value with unit and formula.
fn show_quantity(
    ui: &mut Ui,
    step: usize,
    (name, quantity): (&str, &Quantity),
    value: &Recorded,
    out: &mut Vec<Command>,
) {
    let words = in_words(quantity, value);
    let rows = matrix_of(quantity.kind, value);
    let mut help = quantity.description.to_string();
    if !quantity.formula.is_empty() {
        help += &format!("\n= {}", quantity.formula);
    }
    if *value == Recorded::Missing {
        ui.label(theme::label(quantity.label.as_ref()).size(12.0)).on_hover_text(help);
    } else {
        let link = ui.link(RichText::new(quantity.label.as_ref()).size(12.0)).on_hover_text(help);
        numbers::ask(&link, step, name, &words, out);
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        match rows {
            Some(rows) => matrix(ui, &rows),
            None => {
                ui.label(theme::number(words));
            }
        }
        let formula = Some(&quantity.formula).filter(|formula| !formula.is_empty());
        let notes = [quantity.unit_label(), formula.map_or_else(String::new, |f| format!("= {f}"))];
        for note in notes.into_iter().filter(|note| !note.is_empty()) {
            ui.label(theme::note(note));
        }
    });
}

/// The value of a quantity on one line.
fn in_words(quantity: &Quantity, value: &Recorded) -> String {
    match value {
        Recorded::Missing => "none".to_owned(),
        Recorded::Flag(is) => if *is { "yes" } else { "no" }.to_owned(),
        Recorded::Count(count) => digits(*count as f64),
        Recorded::Number(number) => with_degrees(*number, quantity.unit),
        Recorded::Word(word) => word.clone(),
        Recorded::Components(parts) if quantity.kind == Kind::Pixel => {
            parts.iter().copied().map(coordinate).collect::<Vec<_>>().join(", ")
        }
        Recorded::Components(parts) => parts.iter().copied().map(digits).collect::<Vec<_>>().join("  "),
    }
}

/// An angle in radians with its degrees; other numbers alone.
fn with_degrees(number: f64, unit: Unit) -> String {
    if unit == Unit::Radian {
        format!("{} ({:.2}°)", digits(number), number.to_degrees())
    } else {
        digits(number)
    }
}

/// A coordinate in an image: hundredths of a pixel, also far from the origin.
fn coordinate(value: f64) -> String {
    if value.abs() >= 10.0 && value.fract() != 0.0 { format!("{value:.2}") } else { digits(value) }
}

/// The rows of a matrix.
fn matrix_of(kind: Kind, value: &Recorded) -> Option<Vec<Vec<f64>>> {
    let Recorded::Components(parts) = value else { return None };
    let at = |rows: &[&[usize]]| -> Option<Vec<Vec<f64>>> {
        let row = |row: &&[usize]| row.iter().map(|&part| parts.get(part).copied()).collect();
        rows.iter().map(row).collect()
    };
    match kind {
        Kind::Symmetric3 => at(&[&[0, 1, 2], &[1, 3, 4], &[2, 4, 5]]),
        Kind::Matrix2 => at(&[&[0, 1], &[2, 3]]),
        Kind::Matrix3x2 => at(&[&[0, 1], &[2, 3], &[4, 5]]),
        _ => None,
    }
}

fn not_reached(trace: &RunStep, state: &State) -> String {
    let word = state.stage().word();
    match (trace.fault(), trace.prediction().is_none()) {
        (Some(fault), _) => format!("{word} was not reached: {fault}"),
        (None, true) => {
            let mut steps = Stage::of(state.tracker()).filter(|stage| stage.is_step_of_locate());
            let other = steps.find(|stage| is_reached(trace, *stage)).unwrap_or(Stage::LOCATE).word();
            format!(
                "{word} is not part of the designation. Go one step on (Right) to see it, or select `{other}`."
            )
        }
        (None, false) => format!("{word} was not reached: {}", state.missing_step()),
    }
}

/// Whether a stage was reached.
pub(crate) fn is_reached(trace: &RunStep, stage: Stage) -> bool {
    match stage {
        // The evidence of the registration exists before its refinement has an end.
        Stage::REFINE_REGISTER => trace
            .shape()
            .and_then(|evidence| evidence.registration.as_ref())
            .is_some_and(|found| found.mean_m[2].is_some()),
        // The feature tracker triangulates what it detects.
        Stage::TRIANGULATE if trace.features().is_some() => is_reached(trace, Stage::DETECT),
        _ => records::stage(stage.word()).is_some_and(|recorded| recorded.is_reached(trace)),
    }
}

/// What a stage returned, as one tree; none where it was not reached.
pub(crate) fn record(trace: &RunStep, stage: Stage) -> Option<Value> {
    let mut stages = recorded(trace, stage).into_iter();
    let mut whole = records::evidence(stages.next()?, trace);
    for other in stages {
        whole[other.schema().stage.as_ref()] = records::evidence(other, trace);
    }
    Some(whole)
}

/// Where an entry is in the evidence of a stage.
struct Place {
    stage: RecordedStage,
    /// Names of fields with dots between; empty for the evidence itself.
    path: String,
    step: usize,
}

impl Place {
    /// The place of a field.
    fn field(&self, key: &str) -> Self {
        let dot = if self.path.is_empty() { "" } else { "." };
        Self { path: format!("{}{dot}{key}", self.path), ..*self }
    }

    /// The name under which it can be asked about.
    fn asked(&self) -> String {
        format!("{}.{}", self.stage.schema().stage, self.path)
    }

    /// The unit as the stage declares it, else as the field's name or the kind of its value tells.
    fn unit(&self, value: &Value) -> Unit {
        let found = records::unit_at(&format!("{}.{}", self.stage.schema().path, self.path));
        found.unwrap_or(if records::is_pixel(value) { Unit::Pixel } else { Unit::One })
    }
}

/// The fields of a record, plain values first.
fn entries(ui: &mut Ui, at: &Place, record: &Value, out: &mut Vec<Command>) {
    let Some(fields) = record.as_object() else {
        ui.label(theme::number(record.to_string()));
        return;
    };
    let (plain, nested): (Vec<_>, Vec<_>) =
        fields.iter().partition(|(key, value)| words(key, value).is_some());
    egui::Grid::new(ui.next_auto_id()).num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
        for (key, value) in plain {
            let (at, words) = (at.field(key), words(key, value).unwrap_or_default());
            let unit = at.unit(value);
            name_of(ui, &at, &label(key, unit), &words, out);
            ui.horizontal_wrapped(|ui| {
                ui.spacing_mut().item_spacing.x = 4.0;
                ui.label(theme::number(words));
                ui.label(theme::note(unit_label(key, unit)));
            });
            ui.end_row();
        }
    });
    for (key, value) in nested {
        let at = at.field(key);
        let unit = at.unit(value);
        let list = value.as_array().filter(|_| !is_matrix(key, value));
        let count = list.map(|list| format!(" ({})", list.len())).unwrap_or_default();
        let header = format!("{}{count} {}", label(key, unit), unit_label(key, unit));
        let header = RichText::new(header.trim_end().to_owned()).size(12.0).color(theme::text());
        CollapsingHeader::new(header).id_salt(key).default_open(is_small(key, value)).show(ui, |ui| {
            if why::is_explained(&at.asked()) {
                let link = ui.link(RichText::new("why").small());
                numbers::ask(&link, at.step, &at.asked(), &value.to_string(), out);
            }
            children(ui, &at, key, value, out);
        });
    }
}

/// The name of an entry; where its origin is known, a link to it.
fn name_of(ui: &mut Ui, at: &Place, name: &str, value: &str, out: &mut Vec<Command>) {
    if why::is_explained(&at.asked()) {
        let link = ui.link(RichText::new(name).size(12.0));
        numbers::ask(&link, at.step, &at.asked(), value, out);
    } else {
        ui.label(theme::label(name).size(12.0));
    }
}

fn children(ui: &mut Ui, at: &Place, key: &str, value: &Value, out: &mut Vec<Command>) {
    match value {
        Value::Array(list) if is_matrix(key, value) => {
            // Written as one list, column by column.
            let side = list.len().isqrt();
            let at = |row: usize, column: usize| list[column * side + row].as_f64().unwrap_or(f64::NAN);
            let row = |row: usize| (0..side).map(|column| at(row, column)).collect();
            matrix(ui, &(0..side).map(row).collect::<Vec<_>>());
        }
        Value::Array(list) => {
            for (i, item) in list.iter().enumerate() {
                let step = || item.get("step").map(|step| format!("step {step}"));
                let name = item.get("name").and_then(Value::as_str).map(str::to_owned);
                let title = name.or_else(step).unwrap_or_else(|| i.to_string());
                if item.is_object() {
                    CollapsingHeader::new(RichText::new(title).size(12.0))
                        .id_salt(i)
                        .show(ui, |ui| entries(ui, at, item, out));
                } else {
                    ui.label(theme::number(item.to_string()));
                }
            }
        }
        _ => entries(ui, at, value, out),
    }
}

/// Whether a record is short enough to be open from the start.
fn is_small(key: &str, value: &Value) -> bool {
    match value {
        Value::Array(_) => is_matrix(key, value),
        Value::Object(fields) => fields.len() <= 8,
        _ => true,
    }
}

/// Whether a list is a square matrix.
fn is_matrix(key: &str, value: &Value) -> bool {
    let is_named = key.contains("covariance") || key.contains("_from_");
    is_named
        && value
            .as_array()
            .is_some_and(|list| matches!(list.len(), 4 | 9 | 36) && list.iter().all(Value::is_number))
}

/// A matrix in rows and columns.
fn matrix(ui: &mut Ui, rows: &[Vec<f64>]) {
    egui::Grid::new(ui.next_auto_id()).spacing([14.0, 1.0]).show(ui, |ui| {
        for row in rows {
            for value in row {
                ui.label(theme::number(format!("{value:+.2e}")).size(11.0));
            }
            ui.end_row();
        }
    });
}

/// A value that fits on a line; none for records and long lists.
fn words(key: &str, value: &Value) -> Option<String> {
    match value {
        Value::Null => Some("none".to_owned()),
        Value::Bool(is) => Some(if *is { "yes" } else { "no" }.to_owned()),
        Value::Number(number) => {
            Some(with_degrees(number.as_f64()?, Unit::of_name(key).unwrap_or(Unit::One)))
        }
        Value::String(text) => Some(text.clone()),
        Value::Array(list) if list.is_empty() => Some("none".to_owned()),
        Value::Array(list)
            if list.len() <= 4 && !is_matrix(key, value) && list.iter().all(Value::is_number) =>
        {
            Some(list.iter().filter_map(Value::as_f64).map(digits).collect::<Vec<_>>().join("  "))
        }
        Value::Object(fields) if records::is_pixel(value) => {
            let [x, y] = ["x", "y"].map(|k| fields[k].as_f64().unwrap_or(f64::NAN));
            Some(format!("{x:.2}, {y:.2}"))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn values_read_like_values() {
        assert_eq!(words("roll_rad", &json!(0.1)).unwrap(), "0.100 (5.73°)");
        assert_eq!(words("pixel", &json!({"x": 1.25, "y": 2.0})).unwrap(), "1.25, 2.00");
        assert_eq!(words("position_in_rover", &json!([1.0, 2.5, -0.2])).unwrap(), "1  2.500  -0.200");
        assert_eq!(words("missing", &Value::Null).unwrap(), "none");
        assert_eq!(words("tried", &json!([])).unwrap(), "none");
        assert!(words("peak", &json!({"score": 1, "x": 2})).is_none());
        assert!(words("covariance_px2", &json!([1.0, 0.0, 0.0, 1.0])).is_none());
    }

    #[test]
    fn units_of_fields_are_declared_or_in_their_names() {
        let at = |stage: &str, path: &str| Place {
            stage: records::stage(stage).unwrap(),
            path: path.to_owned(),
            step: 0,
        };
        assert_eq!(at("match_template", "peak.integer").unit(&json!([1, 2])), Unit::Pixel);
        assert_eq!(at("match_template", "edge_distance_px").unit(&json!(1.0)), Unit::Pixel);
        assert_eq!(at("point_stereo", "curve.pixel").unit(&json!({"x": 1.0, "y": 2.0})), Unit::Pixel);
        assert_eq!(at("point_mast", "left.C").unit(&json!([0.0, 0.0, 0.0])), Unit::Metre);
        assert_eq!(at("judge", "reason").unit(&Value::Null), Unit::One);
    }

    #[test]
    fn quantities_read_like_values_and_matrices_have_rows() {
        let quantity = |name: &str| {
            let quantity = records::StageQuantity::named(name).unwrap();
            (quantity.declared(), move |value: Recorded| in_words(quantity.declared(), &value))
        };
        assert_eq!(quantity("scale_roll.roll_rad").1(Recorded::Number(0.1)), "0.100 (5.73°)");
        let pixel = Recorded::Components(vec![349.834, 2.0]);
        assert_eq!(quantity("match_template.pixel").1(pixel), "349.83, 2");
        assert_eq!(quantity("match_template.peak.at_edge").1(Recorded::Flag(true)), "yes");
        assert_eq!(quantity("match_template.second_peak.ratio").1(Recorded::Missing), "none");
        let covariance = quantity("locate.covariance_in_rover").0;
        let parts = Recorded::Components(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let rows = vec![vec![1.0, 2.0, 3.0], vec![2.0, 4.0, 5.0], vec![3.0, 5.0, 6.0]];
        assert_eq!(matrix_of(covariance.kind, &parts), Some(rows));
        assert_eq!(covariance.unit_label(), "m², rover");
    }
}
