//! Stage 9, `select_path`, on a goodness map: the navigator that avoids hazards, and the explanation of its vetoes.
//!
//! ```text
//! goodness map ─► ground (bad cells, clearance) ─► route, way to the goal ─► paths: veto, votes ─► choice ─► counterfactual
//! ```
//! | file | content |
//! |---|---|
//! | `settings` | settings and the presets `gestalt` and `morphin` |
//! | `limits`, `ground` | limits of the terms, bad cells, clearance |
//! | `route` | goal layer: least cost to the goal |
//! | `path` | footprint along a path, its veto and its hazard |
//! | `navigator` | candidates, votes, choice |
//! | `stand` | whether the rover can stand at its goal, and the nearest place where it can |
//! | `reachable` | cells that no closed bad ground separates from the rover |
//! | `moves` | motions of the search: footprint and cost |
//! | `search` | search for a way, over positions and headings |
//! | `way` | the motions of a way, and the part of it that the rover follows |
//! | `clear_way` | whether the path of an approach after arrival is clear |
//! | `counterfactual` | smallest change of a limit that opens paths |
//!
//! Frame: site, horizontal. Source: domain.md 8.

pub mod settings;
mod limits;
mod ground;
mod route;
mod path;
pub mod navigator;
mod reachable;
pub mod stand;
mod moves;
mod search;
mod way;
pub(crate) mod clear_way;
pub mod counterfactual;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod enclosed_tests;
#[cfg(test)]
mod drive_tests;

pub use counterfactual::{LimitChange, counterfactual};
pub use navigator::HazardNavigator;
pub use search::way;
pub use settings::{NavigatorPreset, NavigatorSettings};
