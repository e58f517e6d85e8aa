//! The hand-off: the last image of the old cameras, rendered on its mesh from the new camera (“draped”), beside the window
//! where it was matched (R205).

use egui::{Grid, Label, Ui};
use sightline_api::wire::StopView;
use sightline_track::locate::shape_tracker::drape::Draped;
use sightline_track::locate::shape_tracker::placement::{Placement, REACH_M};
use sightline_track::trace::ArrayName;

use crate::drawing::overlay::Mark;
use crate::panels;
use crate::panels::shape::array_image::{ArrayImage, DisplayUnit, side_by_side};
use crate::panels::shape::part_context::{PartContext, ready};
use crate::theme;

/// The purpose of the part.
const PURPOSE: &str =
    "The last image of the old cameras, draped and matched in the image of the new ones, at a hand-off.";

/// Shows the part.
pub(crate) fn show(ui: &mut Ui, context: &PartContext<'_>) {
    let found = context.evidence.registration.as_ref();
    if let Some(placement) = &context.evidence.placement {
        ui.add(Label::new(theme::note(placed(placement))).wrap());
    }
    let Some(draped) = found.and_then(|found| found.draped.as_ref()) else {
        panels::missing(ui, PURPOSE, &why_none(context));
        return;
    };
    let Some(picture) = ready(ui, context.state.array(ArrayName::DRAPED), "draped picture") else { return };
    let Some(matched) = ready(ui, context.state.array(ArrayName::DRAPED_MATCH), "present image") else {
        return;
    };
    let size = side_by_side(ui, 2, ui.available_height() - 76.0);
    let from = found.map_or(0, |found| found.to_step);
    let titles = [format!("step {from}, draped"), format!("step {}, where it was found", context.trace.step)];
    ui.horizontal_top(|ui| {
        for (raster, title) in [picture, matched].into_iter().zip(&titles) {
            let unit = DisplayUnit { word: "", factor: 1.0 };
            let placed = ArrayImage { title, raster, colour_map: None, unit }.show(ui, size);
            let [x, y] = raster.size().map(|side| (f64::from(side) - 1.0) / 2.0);
            placed.mark(x, y, Mark::Plus, theme::run(context.state.cursor.run));
        }
    });
    numbers(ui, context, draped);
}

fn numbers(ui: &mut Ui, context: &PartContext<'_>, draped: &Draped) {
    let least = format!("at least {:.2}", context.state.run_settings().shape.hand_off_score_min);
    let sigmas = crate::drawing::ellipse::axes(&draped.covariance_px2);
    let sigmas =
        sigmas.map_or_else(String::new, |[a, b]| format!("1σ {:.2} and {:.2} px", a.norm(), b.norm()));
    let rows = [
        ("score", format!("{:.3}", draped.score), least),
        ("correction", format!("{:.2} px", draped.correction_px), "from the registered target".to_owned()),
        ("pixel", format!("{:.1}, {:.1}", draped.pixel.x, draped.pixel.y), sigmas),
        (
            "on the mesh",
            format!("{:.0} %", draped.on_mesh * 100.0),
            "of the window; the rest continues the plane under the target".to_owned(),
        ),
    ];
    Grid::new("hand-off").num_columns(3).spacing([12.0, 1.0]).show(ui, |ui| {
        for (name, value, remark) in rows {
            ui.label(theme::label(name));
            ui.label(theme::number(value));
            ui.label(theme::note(remark));
            ui.end_row();
        }
    });
}

/// The instrument placement as a sentence.
fn placed(placement: &Placement) -> String {
    let [near, far] = REACH_M.map(|metres| format!("{metres:.1}"));
    let reach = if placement.is_reachable {
        format!("The arm reaches the target: {:.2} m from its shoulder.", placement.reach_m)
    } else {
        format!(
            "The arm does not reach the target: {:.2} m from its shoulder, {near} to {far} m ahead can be reached; choose a smaller standoff.",
            placement.reach_m
        )
    };
    let touch = placement.offset_m.map_or_else(
        || "No point within 15 cm of it can be touched without a collision.".to_owned(),
        |offset_m| {
            format!(
                "The nearest point that can be touched without a collision is {:.1} cm from it.",
                100.0 * offset_m
            )
        },
    );
    format!("{reach} {touch}")
}

/// Why there is no draped image at this step.
fn why_none(context: &PartContext<'_>) -> String {
    let step = context.trace.step;
    if let Some(found) = context.evidence.registration.as_ref().filter(|found| found.is_hand_off) {
        let reason = found.draped_missing.as_ref().or(found.reason.as_ref());
        let why = reason.map_or("the setting hand_off_picture is off", String::as_str);
        return format!("The cameras change at step {step}, but the draped image was not matched: {why}.");
    }
    let stops = context.state.traverse.as_ref().map_or(&[][..], |traverse| &traverse.stops);
    match hand_offs(stops).as_slice() {
        [] => format!(
            "No other cameras take over at step {step}. A hand-off is at the first stop whose cameras differ from those \
             of the stop before; the images of this drive all have one size, as far as they are known."
        ),
        [only] => {
            format!("The hand-off is at step {only}, where other cameras take over. Go there to see it.")
        }
        several => {
            let all: Vec<String> = several.iter().map(usize::to_string).collect();
            format!("Hand-offs are at steps {}, where other cameras take over.", all.join(", "))
        }
    }
}

/// The stops whose image size differs from that of the previous stop: a change of cameras.
fn hand_offs(stops: &[StopView]) -> Vec<usize> {
    let changes = stops.windows(2).enumerate();
    changes.filter(|(_, pair)| pair[0].left_size != pair[1].left_size).map(|(step, _)| step + 1).collect()
}
