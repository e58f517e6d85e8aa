//! The debugger's page: data in, commands out.
//!
//! | file | what it does |
//! |---|---|
//! | `app` | lays the panels out and carries their commands to state and network |
//! | `state` | what is known and looked at: the one value of which every panel is a view |
//! | `stage` | the stages, their order and their words |
//! | `command`, `keys`, `actions` | what a person can ask for, by which key, and by which name |
//! | `link`, `keep` | what the page's address says, and what the browser keeps across reloads |
//! | `net` | requests and events; nothing blocks |
//! | `cache`, `raster`, `stretch`, `tables` | what was loaded, with a limit of memory, and how pixels become a texture and tables rows |
//! | `shape_view` | what is looked at of a registration by shape |
//! | `panels` | one file a panel: read-only data in, commands out |
//! | `layout` | where the panels are |
//! | `view2d`, `overlay`, `ellipse`, `contour` | the zoomable canvas and the marks on it |
//! | `thin` | what of a long drive is drawn |
//! | `as_text` | any action as `curl` and as a command |
//! | `opening`, `inbox` | what a dropped or chosen file is, and how its bytes come in |
//! | `markdown`, `picture` | notes as text with emphasis; a file that is given to the person |
//! | `figure` | a panel as a figure: SVG, and PNG at 1x to 4x |
//! | `theme` | colours, text styles and spacing, and nowhere else |
//! | `access` | the page for a screen reader: egui's tree as elements of the document |
//! | `aim` | choosing a place in the left image |
//! | `pointed` | what the pointer rests on, which every panel shows in its own way |
//! | `tour` | the six bubbles for a new user |
//! | `status` | the machine-readable status for tests in a browser |

pub mod app;
pub mod state;
pub mod stage;
pub mod command;
pub mod compare;
pub mod keys;
pub mod actions;
pub mod link;
pub mod keep;
pub mod net;
pub mod cache;
pub mod raster;
pub mod stretch;
pub mod tables;
pub mod shape_view;
pub mod panels;
pub mod layout;
pub mod view2d;
pub mod overlay;
pub mod ellipse;
pub mod contour;
pub mod theme;
pub mod access;
pub mod status;
pub mod aim;
pub mod pointed;
pub mod tour;
pub mod as_text;
pub mod figure;
pub mod thin;
pub mod markdown;
pub mod picture;
pub mod opening;
pub mod inbox;
#[cfg(target_arch = "wasm32")]
pub mod web;
#[cfg(test)]
mod tests;

pub use app::{Link, SightlineApp};
