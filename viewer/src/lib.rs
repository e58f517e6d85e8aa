//! The debugger's page: data in, commands out.
//!
//! | folder or file | contents |
//! |---|---|
//! | `app` | the frame loop: lays the panels out, applies their commands, carries out the effects |
//! | `command` | what the user can ask for: the commands, the table of names and keys, palette and help sheet |
//! | `state` | the one value of which every panel is a view; `apply` returns effects |
//! | `net`, `cache`, `tables` | requests, events, and loaded data within a limit of memory |
//! | `panels` | the table of panels, the trait `Panel`, and the panels that belong to no feature below |
//! | `layout` | arrangements of the panels |
//! | `compare` | comparing runs |
//! | `why`, `what_if` | where a value came from, what would have saved a step, and changes that are tried out |
//! | `breakpoints` | breakpoints, derived columns, and playing the drive |
//! | `picking`, `trackability` | designating a target, and how well a target would do |
//! | `notes`, `studies`, `tour` | notes, validation studies, and the tour for a new user |
//! | `files`, `exports`, `figure` | opening files, exporting the session, and panels as figures |
//! | `drawing`, `theme` | canvas, marks and textures; colours and text styles |
//! | `stage`, `pointed`, `shape_view` | the stages; what the pointer rests on; the selection in the shape panel |
//! | `access` | the page for a screen reader: egui's tree as elements of the document |
//! | `page` | address, storage and status of the page |
//!
//! A feature's folder has its data, with what a person asks of it, in `mod.rs`, what becomes of that in `update`, its panel
//! in `panel` or a window in `window`, and its tests in `tests`.

mod app;
mod breakpoints;
mod command;
mod compare;
mod drawing;
mod driving;
mod exports;
mod files;
mod notes;
mod odometry;
mod page;
mod picking;
mod studies;
mod tour;
mod trackability;
mod what_if;
mod why;
mod state;
mod stage;
mod net;
mod cache;
mod tables;
mod shape_view;
mod panels;
mod layout;
mod theme;
mod access;
mod pointed;
mod figure;
#[cfg(test)]
mod tests;

pub use crate::app::{Link, SightlineApp};
pub use crate::page::link::Fragment;
#[cfg(target_arch = "wasm32")]
pub use page::start::start;
