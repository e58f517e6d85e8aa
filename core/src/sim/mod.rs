//! The simulator: a rocky plain, a straight approach, and the pictures that a rover takes on the way.
//!
//! The scenery is simple, the geometry is not: the ground is a height field, rocks are solids, both are met
//! by rays of the true camera models exactly; shadows are cast; pixels average over their area; noise is
//! that of a detector. Everything follows from a [`Scenario`] with a seed: equal scenarios give equal bits,
//! whatever the number of threads. The truth is exact: poses to rounding, surface points in `f64`.
//!
//! Nothing here knows of any tracker, and no number may be chosen by looking at what one makes of it.
//!
//! In the order in which to read:
//!
//! ```text
//! scenario, scenario_check                     every number, from and to TOML, and its range
//! texture        seeded noise                          terrain, terrain_cast   the ground
//! rocks          one rock                              rock_field              where they lie
//! culling        which rocks a ray can meet            world                   cast, shadow, visibility
//! surface        albedo and shading normal             light, openness         sun, sky, contact shadows
//! rig            which cameras, and where              sampling                rays of a tile, their radiance
//! optics         point spread, flat field              render                  clean radiance, development
//! exposure       electrons, automatic exposure         noise                   detector, numbers
//! drive          true poses, estimates                 index                   the traverse's index
//! targets        the rule that chooses them
//! ```
//!
//! Use: `let world = World::new(&scenario); let index = index(&scenario, &world)?;` then, for a stop and an
//! eye, `render(&world, &scenario, &true_camera_in_site(stop, eye)?, NoiseSeed { step, eye })`.
//!
//! Frames: site (level, x along the drive, origin where the rover frame of a rover on flat ground would be
//! at the start, +z down) and rover; m, px, rad unless a name says otherwise.
//! Sources: domain.md 5, 10, 11; papers.md R104–R106, R21, R227.

pub mod scenario;
pub mod ground;
pub mod culling;
pub mod world;
pub mod light;
pub mod camera;
pub mod rover;
pub mod index;
pub mod targets;
#[cfg(test)]
mod tests;

pub use camera::render::{Eye, NoiseSeed, Region, clean_radiance, develop, render};
pub use camera::rig::Rig;
pub use index::{SCENARIO_FILE, index, true_camera_in_site};
pub use scenario::Scenario;
pub use targets::{choose_targets, share_on_rocks, surface_point};
pub use world::{Hit, SurfaceId, World};
