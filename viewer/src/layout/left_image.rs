//! The position of the left image on the screen, for code that clicks into it.

use egui::Ui;

use crate::drawing::view2d::Transform;

/// The transform and size (px) of the left image on the screen; `None` if it is not shown.
pub(crate) type LeftImage = Option<(Transform, [u32; 2])>;

/// The id under which [`keep_left_image`] stores its value within a frame.
fn left_image_id() -> egui::Id {
    egui::Id::unique("left image")
}

/// Reports the position of the left image on the screen; only the panel of the left image does so.
pub(crate) fn keep_left_image(ui: &Ui, place: LeftImage) {
    ui.data_mut(|data| data.insert_temp(left_image_id(), place));
}

/// Takes the position of the left image, if the panel that was just shown reported it.
pub(super) fn take_left_image(ui: &Ui) -> LeftImage {
    ui.data_mut(|data| data.remove_temp::<LeftImage>(left_image_id())).flatten()
}
