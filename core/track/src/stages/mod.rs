//! The five stages that all trackers share, in running order; the fourth of the loop, `locate`, is where they
//! differ and lives in `crate::locate`.

pub mod prediction;
pub mod predict;
pub mod point_mast;
pub mod capture;
pub mod judge;
pub mod update;
