//! The simulator: rocky terrain, the rover that drives over it, and the images that its cameras take.
//!
//! The geometry is exact: the ground is a tilted, rippled height field, rocks are solids from pebbles to boulders,
//! and rays of the true camera models intersect both exactly. Shadows are cast, pixels average over their area, and
//! noise follows a detector model. Sizes, slopes, light and texture follow published laws or statistics of real
//! images. Everything follows from a [`Scenario`] with a seed: equal scenarios give equal bits for any number of
//! threads. The ground truth is exact: poses to rounding, surface points in `f64`.
//!
//! Nothing here depends on a tracker, and no parameter may be tuned on a tracker's results.
//!
//! Modules in reading order:
//!
//! ```text
//! scenario       every parameter and its range; scenario_check: reads and checks TOML; library: built-in scenarios
//! ground         value_noise     smoothed lattice noise      texture     sums of its octaves
//!                relief          fractal height field and ripples
//!                terrain, terrain_cast   the tilted ground and its ray casting
//!                far             the ground beyond a slope
//!                rocks, shape    one rock                    rock_field  where rocks are
//!                footing         height under the wheels
//!                details         grains, drifts, veins, pits
//!                surface         albedo and shading normal   imprint     wheel tracks
//! culling        candidate rocks of a ray                    solids      boxes and spheres (boards, rover body)
//! world          ray casting, shadow, visibility             construction  of a scenario's world
//! moment         sun, clouds, rover at a stop
//! light          sky             direct and diffuse light    law         laws of reflection
//!                reflection      reflected radiance          openness    contact shadows
//! camera         rig             the camera pairs            sampling    rays of a tile and their hits
//!                shading         radiance of these, in lanes
//!                optics          point spread, flat field    render      clean radiance, development
//!                exposure        electrons, automatic time   noise       detector, digital numbers
//!                ghost           reflections in the lenses
//! rover          approach, plan  the plan on flat ground     odometry    the estimated poses
//!                drive, course   the true poses
//!                suspension      how the wheels settle       body        the parts that cast shadows
//! index          the traverse's index                        truth       ranges, surfaces, visibility
//! targets        the rules that choose targets
//! ```
//!
//! Use: `let world = World::new(&scenario); let index = index(&scenario, &world)?;` then, for a stop and an `eye`
//! (left or right), `render(&world, &scenario, &true_camera_in_site(stop, eye)?, NoiseSeed { step, eye })`.
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
