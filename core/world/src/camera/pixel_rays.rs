//! Rays within the pixels of a tile, interpolated from the camera model's rays through the pixels' corners.
//!
//! The rays of a pixel are interpolated bilinearly between those of its corners on the plane d·A = 1, where the rays of a
//! linear camera are evenly spaced, and normalised. The neglected distortion within one pixel is below 5e-5 px (tested).
//!
//! Frame: site. Sources: domain.md 11.3.

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Ray, Vector3};

use crate::culling::Cone;
use crate::ground::packet_cast::RayLanes;
use crate::ground::texture::LANES;

/// The rays of a tile's pixel corners, rows of `width` + 1.
pub(super) struct Corners {
    pub(super) width: usize,
    pub(super) rays: Vec<Option<Ray>>,
    /// The same with their directions scaled to the plane d·A = 1.
    on_image_plane: Vec<Ray>,
}

/// Neighbouring pixels of a tile: the first pixel, and the number of columns and rows.
pub(super) struct Block {
    pub(super) first: [usize; 2],
    pub(super) size: [usize; 2],
}

impl Block {
    /// Its pixels, row by row.
    #[inline(always)]
    pub(super) fn pixels(&self) -> impl Iterator<Item = [usize; 2]> {
        let ([x, y], [columns, rows]) = (self.first, self.size);
        (0..rows * columns).map(move |k| [x + k % columns, y + k / columns])
    }
}

impl Corners {
    /// For the tile whose first pixel is at `first`, through a camera with this axis.
    pub(super) fn new(
        camera: &Camera,
        axis: &Vector3,
        [x0, y0]: [i64; 2],
        [width, height]: [usize; 2],
    ) -> Self {
        let mut rays = Vec::with_capacity((width + 1) * (height + 1));
        for y in 0..=height {
            for x in 0..=width {
                let pixel = Pixel::new((x0 + x as i64) as f64 - 0.5, (y0 + y as i64) as f64 - 0.5);
                rays.push(camera.ray(pixel));
            }
        }
        let nothing = Ray { origin: Point3::origin(), direction: *axis };
        let on_plane = |ray: &Option<Ray>| on_image_plane(ray.as_ref().unwrap_or(&nothing), axis);
        let on_image_plane = rays.iter().map(on_plane).collect();
        Self { width, rays, on_image_plane }
    }

    /// The cone around the corners of a block's pixels; `None` if the camera model has no ray through one.
    #[inline(always)]
    pub(super) fn cone(&self, block: &Block) -> Option<Cone> {
        let [x, y] = block.first;
        let row = |y: usize| &self.rays[y * (self.width + 1) + x..][..=block.size[0]];
        let rows = (y..=y + block.size[1]).map(row);
        if rows.clone().flatten().any(Option::is_none) {
            return None;
        }
        Cone::around(rows.flatten().flatten(), 0.0)
    }

    /// The rays of a pixel's corners: (0,0), (1,0), (0,1), (1,1).
    #[inline(always)]
    pub(super) fn of_pixel(&self, [x, y]: [usize; 2]) -> [Ray; 4] {
        let at = y * (self.width + 1) + x;
        let below = at + self.width + 1;
        [at, at + 1, below, below + 1].map(|corner| self.on_image_plane[corner])
    }
}

/// The ray with its direction scaled to the plane d·A = 1; near and beyond 90°, to another length.
fn on_image_plane(ray: &Ray, axis: &Vector3) -> Ray {
    Ray { origin: ray.origin, direction: ray.direction / ray.direction.dot(axis).max(0.1) }
}

/// The rays at the positions `offsets` (u, v) of each pixel, at most [`LANES`] / `PIXELS`, interpolated between the rays
/// of the pixel's corners (0,0), (1,0), (0,1), (1,1).
#[inline(always)]
pub(super) fn between<const PIXELS: usize>(corners: &[[Ray; 4]; PIXELS], offsets: &[[f64; 2]]) -> RayLanes {
    let lanes = LANES / PIXELS;
    let (mut u, mut v) = ([offsets[0][0]; LANES], [offsets[0][1]; LANES]);
    for pixel in 0..PIXELS {
        for (lane, offset) in offsets.iter().enumerate() {
            [u[pixel * lanes + lane], v[pixel * lanes + lane]] = *offset;
        }
    }
    let mut rays = RayLanes { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3] };
    let mut squares = [0.0; LANES];
    for k in 0..3 {
        for (pixel, [a, b, c, d]) in corners.iter().enumerate() {
            for lane in pixel * lanes..(pixel + 1) * lanes {
                let [u, v] = [u[lane], v[lane]];
                let [wa, wb, wc, wd] = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
                let direction =
                    a.direction[k] * wa + b.direction[k] * wb + c.direction[k] * wc + d.direction[k] * wd;
                let offset = (b.origin[k] - a.origin[k]) * wb
                    + (c.origin[k] - a.origin[k]) * wc
                    + (d.origin[k] - a.origin[k]) * wd;
                rays.origin[k][lane] = a.origin[k] + offset;
                rays.direction[k][lane] = direction;
                squares[lane] += direction * direction;
            }
        }
    }
    let scale = squares.map(|square| 1.0 / square.sqrt());
    for axis in &mut rays.direction {
        for lane in 0..LANES {
            axis[lane] *= scale[lane];
        }
    }
    rays
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::camera::Mast;

    #[test]
    fn rays_within_a_pixel_are_those_of_the_camera_model() {
        let camera = Mast::spirit().left_in_head;
        for (x, y) in [(0.0, 0.0), (511.0, 400.0), (1023.0, 1023.0), (3.0, 900.0)] {
            let corner = |dx: f64, dy: f64| camera.ray(Pixel::new(x + dx - 0.5, y + dy - 0.5)).unwrap();
            let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0), corner(1.0, 1.0)]
                .map(|ray| on_image_plane(&ray, &camera.model.axis()));
            for (u, v) in [(0.5, 0.5), (0.1, 0.7), (0.9, 0.9)] {
                let ray = between(&[corners], &[[u, v]]).ray(0);
                let pixel = camera.project(&ray.at(5.0)).unwrap();
                let wanted = Pixel::new(x + u - 0.5, y + v - 0.5);
                assert!(pixel.distance(wanted) < 5e-5, "{}", pixel.distance(wanted));
            }
        }
    }
}
