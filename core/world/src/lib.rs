//! The simulator: a rocky plain, the rover that drives over it, and the pictures that a rover takes on the way.
//!
//! The geometry is exact: the ground is a tilted, rippled height field, rocks are solids from pebbles to boulders,
//! both are met by rays of the true camera models exactly; shadows are cast; pixels average over their area; noise
//! is that of a detector. Sizes, slopes, light and texture follow published laws or statistics of real frames.
//! Everything follows from a [`Scenario`] with a seed: equal scenarios give equal bits,
//! whatever the number of threads. The truth is exact: poses to rounding, surface points in `f64`.
//!
//! Nothing here knows of any tracker, and no number may be chosen by looking at what one makes of it.
//!
//! In the order in which to read:
//!
//! ```text
//! scenario       every number and its range; scenario_check: from TOML, checked; library: those that come with it
//! ground         value_noise     hashes joined smoothly      texture     its octaves
//!                relief          the fractal and its ripples
//!                terrain, terrain_cast   the ground, tilted, and rays on it
//!                far             where a slope ends
//!                rocks, shape    one rock                    rock_field  where they lie
//!                footing         what wheels stand on
//!                details         grains, drifts, veins, pits
//!                surface         albedo and shading normal   imprint     wheel tracks
//! culling        which rocks a ray can meet                  solids      made things
//! world          cast, shadow, visibility                    construction  of a scenario's world
//! moment         sun, clouds, rover at a stop
//! light          sky             direct and diffuse light    law         laws of reflection
//!                reflection      what a surface sends        openness    contact shadows
//! camera         rig             the pairs of cameras        sampling    rays of a tile, what they meet
//!                shading         the light of that, many at once
//!                optics          point spread, flat field    render      clean radiance, development
//!                exposure        electrons, automatic time   noise       detector, numbers
//!                ghost           reflections in the lenses
//! rover          approach, plan  before there is a world     odometry    where it believes to stand
//!                drive, course   where it truly stands
//!                suspension      how its wheels stand        body        what casts its shadow
//! index          the traverse's index                        truth       ranges, surfaces, visibility
//! targets        the rules that choose targets
//! ```
//!
//! Use: `let world = World::new(&scenario); let index = index(&scenario, &world)?;` then, for a stop and an
//! eye, `render(&world, &scenario, &true_camera_in_site(stop, eye)?, NoiseSeed { step, eye })`.
//!
//! Frames: site (level, x along the drive, origin where the rover frame of a rover on flat ground would be
//! at the start, +z down) and rover; m, px, rad unless a name says otherwise.
//! Sources: domain.md 5, 10, 11; papers.md R104–R106, R21, R227.

pub mod toml_text;
pub mod traverse;
pub mod scenario;
mod scenario_check;
pub mod ground;
mod culling;
pub mod solids;
mod world;
pub mod moment;
mod construction;
mod light;
pub mod camera;
pub mod rover;
pub mod index;
pub mod truth;
pub mod target_truth;
mod targets;
pub mod library;
#[cfg(test)]
mod tests;

pub use camera::dust::add_dust;
pub use camera::ghost::add_ghosts;
pub use camera::picture::{Eye, NoiseSeed, Region};
pub use camera::render::{clean_radiance, develop, develop_until, render};
pub use camera::rig::Rig;
pub use index::{SCENARIO_FILE, index, index_until, true_camera_in_site};
pub use scenario::Scenario;
pub use targets::{Special, choose_special, choose_targets, is_on_boundary, surface_point};
pub use world::{Hit, SurfaceId, World};
