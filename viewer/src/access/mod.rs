//! The page for users of screen readers: egui's accessibility tree as DOM elements.
//!
//! egui paints on a canvas, which is opaque to a screen reader, and eframe does not pass AccessKit's tree on in the
//! browser. Therefore the tree of every frame is converted to an *outline* (roles, names, values and rectangles, in reading
//! order), and the outline to invisible elements above the canvas. A user action on an element is returned as an AccessKit
//! request, which egui's widgets handle. Browser tests find controls by role and name, as a screen reader does.
//!
//! ```text
//! egui ──TreeUpdate──► outline ──Entry──► dom ──► elements ──click, input──► ActionRequest ──► egui
//! ```

#[cfg(target_arch = "wasm32")]
pub(crate) mod dom;
#[cfg(target_arch = "wasm32")]
pub(crate) mod mirror;
#[cfg(any(test, target_arch = "wasm32"))]
pub(crate) mod outline;
pub(crate) mod press;
