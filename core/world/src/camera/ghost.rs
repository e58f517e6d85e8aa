//! Reflections in the lenses of a pair: radiance added where a virtual patch fixed to the rover would be seen.
//!
//! ```text
//! L(pixel) ← L(pixel) + brightness · L̄ · n(y, z)      n: blotches, 0 to 1, of the patch at x = at_m[0]
//! ```
//! Both cameras show the same blotches with the disparity of a surface at that distance, so that stereo finds one there.
//!
//! Frame: rover, m. Source: ours, for driving.md 3, incident 10.

use sightline_geometry::camera::{Camera, CameraName};
use sightline_geometry::frames::{Pixel, Pose};
use sightline_vision::image::GrayImage;

use crate::ground::texture::mix;
use crate::scenario::{Ghost, Scenario};

/// Spacing of the blotches' lattice points, m.
const BLOTCH_M: f64 = 0.03;

/// Adds the reflections of a further camera at a stop to the clean radiance of its whole image.
pub fn add_ghosts(
    radiance: &mut GrayImage,
    scenario: &Scenario,
    (name, stop): (CameraName, u32),
    camera_in_site: &Camera,
    site_from_rover: &Pose,
) {
    let is_seen = |ghost: &&Ghost| ghost.camera == name && (ghost.from_stop..=ghost.to_stop).contains(&stop);
    let ghosts: Vec<&Ghost> = scenario.events.ghosts.iter().filter(is_seen).collect();
    if ghosts.is_empty() {
        return;
    }
    let mean = radiance.iter().copied().map(f64::from).sum::<f64>() / radiance.len().max(1) as f64;
    let rover_from_site = site_from_rover.inverse();
    for (x, y, value) in radiance.enumerate_pixels_mut() {
        let Some(ray) = camera_in_site.ray(Pixel::new(f64::from(x), f64::from(y))) else { continue };
        let (origin, direction) = (rover_from_site * ray.origin, rover_from_site * ray.direction);
        for ghost in &ghosts {
            let distance_m = (ghost.at_m[0] - origin.x) / direction.x;
            if direction.x <= 0.0 || distance_m <= 0.0 {
                continue;
            }
            let at = origin + direction * distance_m;
            let from_middle = [at.y - ghost.at_m[1], at.z - ghost.at_m[2]];
            if from_middle[0].abs() < 0.5 * ghost.width_m && from_middle[1].abs() < 0.5 * ghost.height_m {
                value.0[0] += (ghost.brightness * mean * blotches(scenario.seed, from_middle)) as f32;
            }
        }
    }
}

/// Smooth noise over the patch, 0 to 1.
fn blotches(seed: u64, at_m: [f64; 2]) -> f64 {
    let [u, v] = at_m.map(|at| at / BLOTCH_M);
    let corner = |du: f64, dv: f64| {
        let [i, j] = [u.floor() + du, v.floor() + dv].map(|k| k as i64 as u64);
        let drawn = mix(seed ^ mix(i ^ mix(j ^ 0x6057)));
        (drawn >> 11) as f64 / (1u64 << 53) as f64
    };
    let (du, dv) = (u - u.floor(), v - v.floor());
    let row = |v: f64| corner(0.0, v) * (1.0 - du) + corner(1.0, v) * du;
    row(0.0) * (1.0 - dv) + row(1.0) * dv
}
