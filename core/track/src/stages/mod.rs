//! The five stages that all trackers share, in running order. The fourth stage, `locate`, differs between trackers
//! and is in `crate::locate`.

pub mod prediction;
pub mod predict;
pub mod point_mast;
pub mod capture;
pub mod judge;
pub mod update;
