//! All tests that cross crates.

// A test says what went wrong by panicking, in its helpers too.
#![allow(clippy::unwrap_used)]

mod api;
mod api_security;
mod attack;
mod bounds;
mod cameras;
mod cli;
mod compare;
mod copied;
mod drill;
mod driving;
mod stage_pause;
mod odometry;
mod ending;
mod exports;
mod expressions;
mod fairness;
mod identity;
mod imports;
mod keeping;
mod opening;
mod page_jobs;
mod page_linked;
mod page_numbers;
mod page_open;
mod page;
mod page_access;
mod page_cameras;
mod page_compare;
mod page_debugger;
mod page_driving;
mod page_odometry;
mod page_exports;
mod page_figures;
mod page_first;
mod page_panels;
mod page_picking;
mod page_removal;
mod page_speed;
mod page_travel;
mod page_trackers;
mod page_trouble;
mod page_undo;
mod recorded_cameras;
mod recorded_tracking;
mod records;
mod removal;
mod repeated;
mod rerun_export;
mod studies;
mod surviving;
mod trackability;
mod why;
mod zncc_reference;
