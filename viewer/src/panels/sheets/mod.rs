//! Plots and surfaces as tables: the same values as numbers, with units, the present step marked, to be read, heard
//! and copied as CSV.
//!
//! | file | what it does |
//! |---|---|
//! | `sheet` | a table: columns with units, rows, CSV |
//! | `of_panel` | the tables of a panel, and the switch between both |
//! | `grid` | a table on the screen and for a screen reader |
//! | `scores` | the surface of scores and the stereo profile |
//! | `steps` | what is plotted over the steps |
//! | `places` | the map, the error budget and the template's history |
//! | `features` | residuals, draws and features |
//! | `shape` | registration, errors of depth, coarse search and refinement |

pub(crate) mod features;
mod grid;
pub(crate) mod of_panel;
pub(crate) mod places;
pub(crate) mod scores;
pub(crate) mod shape;
pub(crate) mod sheet;
pub(crate) mod steps;

pub(crate) use self::sheet::{Cell, Column, Row, Sheet};
