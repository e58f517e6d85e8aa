//! The debugger's page: data in, commands out.
//!
//! | folder or file | contents |
//! |---|---|
//! | `app` | the frame loop: lays the panels out, applies their commands, carries out the effects |
//! | `command` | the user's commands, the table of their names and keys, the palette and the help sheet |
//! | `state` | the application state that all panels display; `apply` returns effects |
//! | `net`, `cache`, `tables` | requests, events, and loaded data within a memory limit |
//! | `panels` | the table of panels, the trait `Panel`, and the panels that belong to no feature below |
//! | `layout` | layouts of the panels |
//! | `compare` | comparing runs |
//! | `why`, `what_if` | origins of values, counterfactuals of a lost step, and trial changes |
//! | `breakpoints` | breakpoints, derived columns, and playback of the drive |
//! | `picking`, `trackability` | designating a target, and the expected tracking quality of a target |
//! | `notes`, `studies`, `tour` | notes, validation studies, and the tour for a new user |
//! | `files`, `exports`, `figure` | opening files, exporting the session, and panels as figures |
//! | `drawing`, `theme` | canvas, marks and textures; colours and text styles |
//! | `stage`, `hovered`, `shape_view` | the stages; the hovered location; the selection in the shape panel |
//! | `access` | the page for screen readers: egui's accessibility tree as DOM elements |
//! | `page` | address, storage and status of the page |
//!
//! A feature's folder contains its data and commands in `mod.rs`, their effect on the state in `update`, its panel in
//! `panel` or its window in `window`, and its tests in `tests`.

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
mod hovered;
mod figure;
#[cfg(test)]
mod tests;

pub use crate::app::{Link, SightlineApp};
pub use crate::page::link::Fragment;
#[cfg(target_arch = "wasm32")]
pub use page::start::start;
