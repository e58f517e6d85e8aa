//! One-off experiments: how single figures and tables of `docs/` were measured. The studies that the product repeats are
//! in `sightline_study`.
//!
//! | module | experiment |
//! |---|---|
//! | `scenery`, `picture`, `exposure` | the simulated scenery against its laws and real frames |
//! | `realism` | the difficulty of simulated worlds for plain correlation |
//! | `real_motion` | motions between recorded frames against their poses |
//! | [`registration`] | registration of rocks by their shape, where the motion is known |
//! | [`cancel`] | how soon each long computation ends once it is cancelled |
//! | `claims` | tracked targets and their NEES in worlds with pointing error |
//! | [`driving`] | closed-loop drives on slopes with slip |
//! | `navigation` | the navigator among rocks without images, beside a planner that knows the ground |
//! | [`spirit137`] | visual odometry along the path that Spirit drove at site 137 |
//! | [`trackability`] | targets drawn where the map says good, risky or bad, tracked against the truth |

#[cfg(feature = "command-line")]
mod scenery;
#[cfg(feature = "command-line")]
mod picture;
#[cfg(feature = "command-line")]
mod exposure;
#[cfg(feature = "command-line")]
mod realism;
#[cfg(feature = "command-line")]
mod real_motion;
pub mod cancel;
#[cfg(feature = "command-line")]
pub mod claims;
pub mod driving;
#[cfg(feature = "command-line")]
mod navigation;
pub mod registration;
pub mod spirit137;
pub mod trackability;
#[cfg(feature = "command-line")]
pub mod cli;
