//! Scrolls the part of the panel that was asked for to the panel's upper edge: an answer below the fold would be missed.

use egui::style::ScrollAnimation;
use egui::{Align, Id, Ui};

use crate::why::{InView, Part};

/// Scrolls to `part`, which begins at `top`, until what it shows is here, if it is the one that was asked for last.
pub(super) fn bring(ui: &Ui, asked: InView, part: Part, top: f32, is_here: bool) {
    let id = Id::unique("why asked for");
    let is_done = asked.count == 0 || ui.data(|data| data.get_temp(id)) == Some(asked.count);
    if is_done || asked.part != part {
        return;
    }
    let rect = ui.max_rect().with_min_y(top).with_max_y(ui.cursor().top());
    ui.scroll_to_rect_animation(rect, Some(Align::TOP), ScrollAnimation::none());
    if is_here {
        ui.data_mut(|data| data.insert_temp(id, asked.count));
    }
}
