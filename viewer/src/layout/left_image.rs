//! Where the left image is on the screen, for whoever needs to click into it.

use egui::Ui;

use crate::drawing::view2d::Transform;

/// Where the left image is on the screen, for whoever needs to click into it.
pub(crate) type LeftImage = Option<(Transform, [u32; 2])>;

/// Where [`keep_left_image`] keeps its value within a frame.
fn left_image_id() -> egui::Id {
    egui::Id::unique("left image")
}

/// Reports where the left image is on the screen; only the panel of the left image does so.
pub(crate) fn keep_left_image(ui: &Ui, place: LeftImage) {
    ui.data_mut(|data| data.insert_temp(left_image_id(), place));
}

/// Takes out where the left image is, if the panel that was just shown reported it.
pub(super) fn take_left_image(ui: &Ui) -> LeftImage {
    ui.data_mut(|data| data.remove_temp::<LeftImage>(left_image_id())).flatten()
}
