//! The timeline: a lane of events and breakpoint hits, a filmstrip of matched windows, a state band for each run, curves
//! of score and error, the loop, and the playhead.
//!
//! A click selects the step, a drag scrubs, a click in the lane sets a breakpoint at the step. Everything is drawn by
//! columns of the screen ([`lod`]): the number of shapes per frame is bounded by the width, independent of the number of
//! steps. At 1400 points, with five runs that change state at every column and hits at every second step, it is about
//! 7,000 for 1,000, 10,000 and 40,000 steps (`tests/timelines.rs` asserts a bound of 13,220).

pub(crate) mod cells;
mod curves;
pub(crate) mod film;
pub(crate) mod lod;
mod marks;

use egui::{Align2, EventFilter, Painter, Rect, Response, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use sightline_session::view::{RunView, TargetView};

use self::cells::cell_of;
pub(crate) use self::cells::{Cell, cell};
use self::film::FILM;
use self::lod::{Scale, Span};
use self::marks::{LANE, NUMBERS};
use crate::breakpoints::BreakpointCommand;
use crate::command::{Command, Go};
use crate::hovered::Hovered;
use crate::state::{State, run_letter};
use crate::theme;

/// Height of the selected run's band, points.
const BAND: f32 = 18.0;
/// Height of any other band, points.
const LOW_BAND: f32 = 10.0;
/// Space between two bands, points.
const GAP: f32 = 2.0;
/// Width of the bands' names on the left, points.
const GUTTER: f32 = 78.0;
/// Maximum number of bands of the target's runs, and of bands of other targets.
const BANDS: usize = 5;
/// Maximum number of state spans in the description of the timeline.
const WORDS: usize = 6;

/// One state band.
struct Band<'a> {
    target: &'a TargetView,
    run: Option<&'a RunView>,
    is_selected: bool,
    name: String,
}

impl Band<'_> {
    fn height(&self) -> f32 {
        if self.is_selected { BAND } else { LOW_BAND }
    }
}

/// The bands, from top to bottom: the target's runs, always including the selected one, then the other targets.
fn bands(state: &State) -> Vec<Band<'_>> {
    let (Some(session), Some(target)) = (&state.session, state.target()) else { return Vec::new() };
    let selected = target.runs.iter().position(|run| run.number == state.cursor.run).unwrap_or(0);
    let first = (selected + 1).saturating_sub(BANDS);
    let runs = target.runs.iter().skip(first).take(BANDS).map(|run| Band {
        target,
        run: Some(run),
        is_selected: run.number == state.cursor.run,
        name: format!("run {}", run_letter(run.number)),
    });
    let others = session
        .targets
        .iter()
        .filter(|other| state.breakpoints.shows_others && other.number != target.number);
    let others = others.take(BANDS).map(|other| Band {
        target: other,
        run: other.runs.last(),
        is_selected: false,
        name: other.label.clone(),
    });
    runs.chain(others).collect()
}

/// Current height of the timeline, points.
pub(crate) fn height(state: &State) -> f32 {
    let bands: f32 = bands(state).iter().map(|band| band.height() + GAP).sum();
    LANE + FILM + bands.max(BAND + GAP) + curves::HEIGHT + NUMBERS
}

/// Shows the timeline.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let count = state.stop_count();
    let size = vec2(ui.available_width(), height(state));
    let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
    let painter = ui.painter_at(rect);
    if count == 0 {
        let words = state.missing_target();
        painter.text(rect.center(), Align2::CENTER_CENTER, &words, theme::image_font(), theme::weak());
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("timeline: {words}")));
        return;
    }
    let drive = rect.with_min_x(rect.left() + GUTTER.min(rect.width() / 4.0));
    let scale = Scale::new(drive.x_range(), count);
    let lane = drive.with_max_y(drive.top() + LANE);
    let bands = bands(state);
    let frames = paint_bands(&painter, state, &bands, drive, &scale);
    let all = drive.with_min_y(lane.bottom() + 1.0).with_max_y(rect.bottom() - NUMBERS - GAP);
    marks::rendered(&painter, all.bottom() + 1.0, &scale, |step| is_ready(state, step));
    marks::numbers(&painter, drive.with_min_y(rect.bottom() - NUMBERS), count, &scale);
    marks::lane(&painter, lane, state, &scale);
    film::paint(&painter, all.with_max_y(lane.bottom() + FILM), state, &scale);
    let below = all.bottom() - curves::HEIGHT;
    curves::paint(&painter, drive, below, GUTTER, state, &scale);
    crate::notes::marks::timeline(&painter, lane, state, &scale);
    marks::loop_range(&painter, all, state, &scale, count);
    marks::playhead(&painter, all, state.cursor.step.min(count - 1), &scale);
    let hovered = response.hover_pos().or(response.interact_pointer_pos());
    if let Some(pointer) = hovered.filter(|at| lane.contains(*at)) {
        marks::lane_hint(&painter, lane, scale.middle_of(scale.step_at(pointer.x)));
    }
    point(&response, state, &bands, &frames, (lane, &scale), out);
    keys_and_readers(ui, &response, state, &bands, out);
    if let Some(step) = state.hovered_step() {
        marks::hovered(&painter, all, step, &scale);
    }
    if let Some(pointer) = response.hover_pos() {
        let step = scale.step_at(pointer.x);
        out.push(Command::Hover(Hovered::Step(step)));
        let band = frames.iter().position(|frame| frame.y_range().contains(pointer.y)).map(|at| &bands[at]);
        response.on_hover_text_at_pointer(words(state, band, step, lane.contains(pointer)));
    }
}

/// Paints the bands with their names. Returns their areas.
fn paint_bands(
    painter: &Painter,
    state: &State,
    bands: &[Band<'_>],
    drive: Rect,
    scale: &Scale,
) -> Vec<Rect> {
    let mut top = drive.top() + LANE + FILM + GAP;
    if bands.is_empty() {
        let frame = Rect::from_min_max(pos2(drive.left(), top), pos2(drive.right(), top + BAND));
        cells::paint(painter, frame, Cell::Before);
        return Vec::new();
    }
    let mut frames = Vec::new();
    for band in bands {
        let frame = Rect::from_min_max(pos2(drive.left(), top), pos2(drive.right(), top + band.height()));
        let spans = scale.spans(|step| cell_of(band.target, band.run, step));
        paint_spans(painter, &spans, frame, scale);
        let colour = if band.is_selected { theme::strong() } else { theme::weak() };
        let name =
            painter.with_clip_rect(frame.with_min_x(drive.left() - GUTTER).with_max_x(drive.left() - 4.0));
        name.text(
            frame.left_center() - vec2(6.0, 0.0),
            Align2::RIGHT_CENTER,
            &band.name,
            theme::image_font(),
            colour,
        );
        if band.is_selected {
            paint_words(painter, &spans, frame, scale);
            if state.target().is_some_and(|target| target.runs.len() > 1) {
                let mark = Rect::from_min_size(frame.left_top() - vec2(4.0, 0.0), vec2(3.0, frame.height()));
                painter.rect_filled(mark, 1.0, theme::run(state.cursor.run));
            }
        }
        top = frame.bottom() + GAP;
        frames.push(frame);
    }
    frames
}

fn paint_spans(painter: &Painter, spans: &[Span], band: Rect, scale: &Scale) {
    // Wide steps have a gap; narrow ones touch.
    let gap = if scale.step_width() > 6.0 { 1.0 } else { 0.0 };
    for span in spans {
        let step_frames = if gap > 0.0 { span.from..span.to } else { span.from..span.from + 1 };
        for step in step_frames {
            let end = if gap > 0.0 { step + 1 } else { span.to };
            let x = scale.left_of(step) + gap..=scale.left_of(end) - gap;
            cells::paint(painter, Rect::from_x_y_ranges(x, band.y_range()), span.cell);
        }
    }
}

/// The states of a run as a band too thin for patterns; all states but tracking are lower, so that shape shows them as
/// well.
pub(crate) fn thin_band(
    painter: &Painter,
    band: Rect,
    target: &TargetView,
    run: &RunView,
    stop_count: usize,
) {
    painter.rect_filled(band, 1.0, theme::before());
    let scale = Scale::new(band.x_range(), stop_count);
    for span in scale.spans(|step| cells::cell_of(target, Some(run), step)) {
        let (colour, top) = match span.cell {
            Cell::Before | Cell::Unknown => continue,
            Cell::NotSearched => (theme::weak(), band.center().y),
            Cell::Tracking | Cell::FalseTracking => (theme::tracking(), band.top()),
            Cell::Lost => (theme::lost(), band.center().y),
            Cell::Failed => (theme::failed(), band.center().y),
            Cell::Fault => (theme::weak(), band.center().y),
        };
        let x = scale.left_of(span.from)..=scale.left_of(span.to);
        painter.rect_filled(Rect::from_x_y_ranges(x, top..=band.bottom()), 0.0, colour);
    }
}

/// The word of each span of equal cells at its left end, if it fits.
fn paint_words(painter: &Painter, spans: &[Span], band: Rect, scale: &Scale) {
    for span in spans {
        let left = scale.left_of(span.from);
        let room = scale.left_of(span.to) - left;
        // No word fits into less: this skips most spans of a long drive without a layout.
        if room < 34.0 {
            continue;
        }
        let galley =
            painter.layout_no_wrap(span.cell.word().to_owned(), theme::image_font(), theme::strong());
        if galley.size().x + 16.0 > room {
            continue;
        }
        let at = pos2(left + 7.0, band.center().y - galley.size().y / 2.0);
        let behind = Rect::from_min_size(at, galley.size()).expand2(vec2(4.0, 0.0));
        painter.rect_filled(behind, 2.0, theme::scrim());
        painter.galley(at, galley, theme::strong());
    }
}

/// Pushes the commands of clicks and drags.
fn point(
    response: &Response,
    state: &State,
    bands: &[Band<'_>],
    frames: &[Rect],
    (lane, scale): (Rect, &Scale),
    out: &mut Vec<Command>,
) {
    let Some(pointer) = response.interact_pointer_pos() else { return };
    let step = scale.step_at(pointer.x);
    if response.clicked() && lane.contains(pointer) {
        out.push(Command::Breakpoints(BreakpointCommand::BreakAt(step)));
        return;
    }
    if response.clicked()
        && let Some(band) =
            frames.iter().position(|frame| frame.y_range().contains(pointer.y)).map(|at| &bands[at])
        && let Some(run) = band.run.filter(|_| !band.is_selected)
    {
        out.push(Command::SelectRun { target: band.target.number, run: run.number });
    }
    if (response.clicked() || response.dragged()) && step != state.cursor.step {
        out.push(Command::Go(Go::Step(step)));
    }
}

/// The description for screen readers, and the keys while the timeline has the focus.
fn keys_and_readers(ui: &Ui, response: &Response, state: &State, bands: &[Band<'_>], out: &mut Vec<Command>) {
    response.widget_info(|| WidgetInfo::slider(true, state.cursor.step as f64, in_words(state, bands)));
    if response.has_focus() {
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
    }
    let (more, less) = ui.input(|input| {
        let count = |action| input.num_accesskit_action_requests(response.id, action);
        (count(egui::accesskit::Action::Increment), count(egui::accesskit::Action::Decrement))
    });
    if more != less {
        out.push(Command::Go(Go::By(more as isize - less as isize)));
    }
}

/// The timeline in words.
fn in_words(state: &State, bands: &[Band<'_>]) -> String {
    let (step, last) = (state.cursor.step, state.stop_count().saturating_sub(1));
    let mut words = format!("timeline: step {step} of {last}, {}", cell(state, step).word());
    if let Some(band) = bands.iter().find(|band| band.is_selected) {
        let cell = |step: usize| cell_of(band.target, band.run, step);
        let (mut from, mut stretches) = (0, Vec::new());
        while from <= last && stretches.len() < WORDS {
            let first = cell(from);
            let to = (from..last).find(|step| cell(step + 1) != first).unwrap_or(last);
            stretches.push(format!("{} {from} to {to}", first.word()));
            from = to + 1;
        }
        words += &format!("; {}: {}", band.name, stretches.join(", "));
        if from <= last {
            words += " and further changes";
        }
    }
    let hits: usize = state.breakpoints.watched().map(|(_, breakpoint)| breakpoint.count).sum();
    if hits > 0 {
        words += &format!("; {hits} hits of breakpoints in all runs");
    }
    words
}

fn is_ready(state: &State, step: usize) -> bool {
    state.traverse.as_ref().is_some_and(|t| t.stops.get(step).is_some_and(|stop| stop.ready))
}

/// The description of a stop.
fn words(state: &State, band: Option<&Band<'_>>, step: usize, in_lane: bool) -> String {
    let selected = || state.target().map(|target| (target, state.run()));
    let shown = band.map(|band| (band.target, band.run)).or_else(selected);
    let mut words = match shown {
        Some((target, run)) => format!("step {step}: {}", cell_of(target, run, step).word()),
        None => format!("step {step}"),
    };
    if let Some(band) = band.filter(|band| !band.is_selected) {
        words += &format!(" ({})", band.name);
    }
    if let Some(row) = shown.and_then(|(_, run)| crate::state::row_of(run?, step)) {
        let values = [
            row.ncc.map(|v| format!("ncc {v:.2}")),
            row.inliers.map(|n| format!("{n} inliers")),
            row.err_px.map(|v| format!("err {v:.2} px")),
            row.sigma_m.map(|v| format!("σ {:.1} cm", v * 100.0)),
            row.range_m.map(|v| format!("range {v:.2} m")),
        ];
        let values: Vec<String> = values.into_iter().flatten().collect();
        if !values.is_empty() {
            words += &format!("\n{}", values.join(", "));
        }
        if let Some(reason) = &row.reason {
            words += &format!("\n{reason}");
        }
    }
    let of_run = shown.and_then(|(target, run)| Some((target.number, run?.number)));
    let hits = of_run.map(|(target, run)| state.hit_at(target, run, step)).unwrap_or_default();
    for hit in hits.into_iter().take(4) {
        words += &format!("\n◆ {hit}");
    }
    for note in crate::notes::marks::words(state, step).into_iter().take(3) {
        words += &format!("\n{note}");
    }
    if in_lane {
        words += "\nclick: toggle breakpoint here";
    }
    if !is_ready(state, step) {
        words += "\nits images are not rendered yet";
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::breakpoints::breakpoint;
    use crate::tests::fixture;

    #[test]
    fn the_tooltip_of_another_run_has_the_hits_of_that_run() {
        let mut state = fixture::at_step(&egui::Context::default(), 2);
        let target = &mut state.session.as_mut().unwrap().targets[0];
        let second = RunView { number: 1, ..target.runs[0].clone() };
        target.runs.push(second);
        let mut hit = breakpoint(0, "ncc < 0.6", &[3]);
        hit.hits[0].run = 1;
        state.breakpoints.list = vec![hit];
        let bands = bands(&state);
        let words = |run: usize| words(&state, Some(&bands[run]), 3, false);
        assert!(!words(0).contains("◆ ncc < 0.6"), "{}", words(0));
        assert!(words(1).contains("◆ ncc < 0.6"), "{}", words(1));
    }
}
