//! Scrolls a part of the panel into view when it was asked for, or shows something else than before: an answer below the
//! fold would be missed.

use egui::{Id, Ui};

/// Height of a part that is scrolled into view, points.
const HEIGHT: f32 = 140.0;

/// Scrolls to the part from `top` to the cursor if what it shows has changed since the last frame; not when the panel appears.
pub(super) fn follow<T>(ui: &Ui, part: &str, shown: Option<T>, top: f32)
where
    T: Clone + PartialEq + Send + Sync + 'static,
{
    let id = Id::unique(("why in view", part));
    let before = ui.data_mut(|data| {
        let before = data.get_temp::<Option<T>>(id);
        data.insert_temp(id, shown.clone());
        before
    });
    if shown.is_some() && before.is_some_and(|before| before != shown) {
        scroll(ui, top);
    }
}

/// Scrolls to the part from `top` to the cursor, which was asked for as the `count`th, until what it shows is here.
pub(super) fn bring(ui: &Ui, count: usize, top: f32, is_here: bool) {
    let id = Id::unique("why asked for");
    if count == 0 || ui.data(|data| data.get_temp(id)) == Some(count) {
        return;
    }
    scroll(ui, top);
    if is_here {
        ui.data_mut(|data| data.insert_temp(id, count));
    }
}

fn scroll(ui: &Ui, top: f32) {
    let bottom = ui.cursor().top().min(top + HEIGHT);
    ui.scroll_to_rect(ui.max_rect().with_min_y(top).with_max_y(bottom), None);
}
