//! Plots and images as tables: the same values as numbers, with units and the current step marked, for reading, screen
//! readers and copying as CSV.
//!
//! | file | what it does |
//! |---|---|
//! | `sheet` | a table: columns with units, rows, CSV |
//! | `of_panel` | the tables of a panel, and the switch between both |
//! | `grid` | a table on the screen and for a screen reader |
//! | `scores` | the score map and the stereo profile |
//! | `steps` | NEES, NIS and coverage |
//! | `places` | the map, the error budget and the template's history |
//! | `features` | residuals, RANSAC iterations and features |
//! | `shape` | registration, depth errors, coarse search and refinement |

pub(crate) mod features;
mod grid;
pub(crate) mod of_panel;
pub(crate) mod places;
pub(crate) mod scores;
pub(crate) mod shape;
pub(crate) mod sheet;
pub(crate) mod steps;

pub(crate) use self::sheet::{Cell, Column, Sheet, SheetRow};
