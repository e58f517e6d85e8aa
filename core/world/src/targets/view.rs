//! The view in which targets are chosen: the world at the first stop, its left camera, and the last stop's pair.

use rand::RngExt;
use rand_pcg::Pcg64;

use crate::camera::picture::Eye;
use crate::index::true_camera_in_site;
use crate::moment::Moment;
use crate::scenario::{PlacedRock, Scenario, TargetRule};
use crate::traverse::TraverseIndex;
use crate::world::World;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3};

/// Draws per target before the search stops.
const DRAWS_PER_TARGET: u32 = 2000;

/// The world and the left camera at the first stop, and the cameras from which targets must still be visible.
pub(super) struct View<'a> {
    pub(super) world: World,
    pub(super) camera: Camera,
    pub(super) last: [Camera; 2],
    pub(super) rule: &'a TargetRule,
    /// Rocks that the scenario places.
    pub(super) placed: &'a [PlacedRock],
}

/// The surface point under a pixel of a camera in the site: the truth of a target.
pub fn surface_point(world: &World, camera_in_site: &Camera, pixel: Pixel) -> Option<Point3> {
    Some(world.cast(&camera_in_site.ray(pixel)?)?.point)
}

impl<'a> View<'a> {
    pub(super) fn of(world: &World, scenario: &'a Scenario, index: &TraverseIndex) -> Option<Self> {
        let (first, last) = (index.stops.first()?, index.stops.last()?);
        Some(Self {
            world: world.at(&Moment::of(0, &index.stops)?, scenario),
            camera: true_camera_in_site(first, Eye::Left)?,
            last: [true_camera_in_site(last, Eye::Left)?, true_camera_in_site(last, Eye::Right)?],
            rule: &scenario.targets,
            placed: &scenario.rocks.placed,
        })
    }

    /// Up to `count` different pixels, drawn uniformly near the targets' centre, that satisfy `accepts`.
    pub(super) fn drawn(
        &self,
        count: u32,
        random: &mut Pcg64,
        accepts: &dyn Fn(Pixel) -> bool,
    ) -> Vec<Pixel> {
        let Some([columns, rows]) = self.bounds() else { return Vec::new() };
        let mut chosen: Vec<Pixel> = Vec::new();
        for _ in 0..count.saturating_mul(DRAWS_PER_TARGET) {
            if chosen.len() >= count as usize {
                break;
            }
            let x = f64::from(random.random_range(columns[0]..=columns[1]));
            let y = f64::from(random.random_range(rows[0]..=rows[1]));
            let pixel = Pixel::new(x, y);
            if !chosen.contains(&pixel) && accepts(pixel) {
                chosen.push(pixel);
            }
        }
        chosen
    }
}
