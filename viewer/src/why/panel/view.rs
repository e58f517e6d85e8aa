//! Scrolls the requested part of the panel to the top of the panel, so that an answer below the fold is not missed.

use egui::style::ScrollAnimation;
use egui::{Align, Id, Ui};

use crate::why::{ScrollRequest, WhySection};

/// If `part` was requested last, scrolls to its top at `top` in each frame until its content has arrived (`is_here`).
pub(super) fn scroll_to(ui: &Ui, request: ScrollRequest, part: WhySection, top: f32, is_here: bool) {
    let id = Id::unique("why asked for");
    let is_done = request.count == 0 || ui.data(|data| data.get_temp(id)) == Some(request.count);
    if is_done || request.part != part {
        return;
    }
    let rect = ui.max_rect().with_min_y(top).with_max_y(ui.cursor().top());
    ui.scroll_to_rect_animation(rect, Some(Align::TOP), ScrollAnimation::none());
    if is_here {
        ui.data_mut(|data| data.insert_temp(id, request.count));
    }
}
