//! The page for those who do not see it: egui's accessibility tree as elements of the document.
//!
//! egui paints on a canvas, of which a screen reader knows nothing, and eframe hands AccessKit's tree to nobody in
//! the browser. So the tree of every frame becomes an *outline* (roles, names, values and places, in reading
//! order), and the outline becomes elements that lie invisibly over the canvas. What a person does to an element
//! goes back as a request of AccessKit, which egui's widgets understand. Tests in a browser find controls there by
//! role and name, as a screen reader does.
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
