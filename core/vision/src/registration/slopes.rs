//! Normals of a range image: planes fitted to the neighbours of every pixel.
//!
//! ```text
//! z = a (x − x_i) + b (y − y_i) + c    least squares over the pixels of the (2 k + 1)² window around i that have a depth
//!                                      within a slope of 3 of pixel i's
//! n = (−a, −b, 1) / √(a² + b² + 1)     away from the sensor
//! ```
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | x, y, z | point of a pixel | m, sensor |
//! | k | `radius_px` | px |
//! | n | [`Slopes::normals`] | –, sensor |
//!
//! Source: ours; least squares.

use super::range_sensor::{RangeImage, RangeSensor};
use sightline_geometry::frames::Vector3;

/// Steepest slope between a pixel and the neighbours of its plane.
const STEEPEST: f64 = 3.0;
/// Least number of points of a plane, the pixel itself included.
const LEAST: usize = 6;
/// Least ratio of the fitted points' scatter to that of a full window.
const SPREAD_MIN: f64 = 0.1;

/// The normals of a range image.
#[derive(Clone, Debug, Default)]
pub(super) struct Slopes {
    /// Unit normals, away from the sensor; `None` with too few neighbours.
    pub(super) normals: Vec<Option<Vector3>>,
}

impl Slopes {
    /// Fits the normals of a range image, in windows of `radius_px` to each side.
    pub(super) fn of(sensor: &RangeSensor, image: &RangeImage, radius_px: usize) -> Self {
        let (width, height) = (image.width, image.height);
        let mut normals = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let depth_m = image.depth_m[y * width + x];
                let normal =
                    if depth_m.is_finite() { normal(sensor, image, [x, y], radius_px) } else { None };
                normals.push(normal);
            }
        }
        Self { normals }
    }
}

/// The normal at a pixel that has a depth.
fn normal(sensor: &RangeSensor, image: &RangeImage, [x, y]: [usize; 2], radius_px: usize) -> Option<Vector3> {
    let depth_m = f64::from(image.depth_m[y * image.width + x]);
    let at = sensor.point(x, y, depth_m);
    let pixel_m = sensor.pixel_m(depth_m);
    let gate_m = STEEPEST * radius_px as f64 * pixel_m;
    let rows = y.saturating_sub(radius_px)..=(y + radius_px).min(image.height - 1);
    let columns = x.saturating_sub(radius_px)..=(x + radius_px).min(image.width - 1);
    let (mut count, mut sx, mut sy, mut sz) = (0, 0.0, 0.0, 0.0);
    let (mut xx, mut xy, mut yy, mut xz, mut yz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for row in rows {
        for column in columns.clone() {
            let there_m = f64::from(image.depth_m[row * image.width + column]);
            if (there_m - depth_m).abs() > gate_m {
                continue;
            }
            let d = sensor.point(column, row, there_m) - at;
            count += 1;
            sx += d.x;
            sy += d.y;
            sz += d.z;
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
            xz += d.x * d.z;
            yz += d.y * d.z;
        }
    }
    if count < LEAST {
        return None;
    }
    let n = count as f64;
    let (xx, xy, yy) = (xx - sx * sx / n, xy - sx * sy / n, yy - sy * sy / n);
    let (xz, yz) = (xz - sx * sz / n, yz - sy * sz / n);
    let determinant = xx * yy - xy * xy;
    let reach = radius_px as f64 * pixel_m;
    // The scatter of a full window in x and in y is n reach² (1 + 1/k) / 3.
    let full = n * reach * reach / 3.0;
    if determinant < (SPREAD_MIN * full).powi(2) {
        return None;
    }
    let slope = [(xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant];
    Some(Vector3::new(-slope[0], -slope[1], 1.0).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::frames::Point3;

    #[test]
    fn the_normal_of_a_tilted_plane_is_found_up_to_its_edge() {
        let sensor = RangeSensor::looking_at(&Point3::origin(), &Vector3::x(), 0.4, 20);
        let depth_m: Vec<f32> = (0..400)
            .map(|i| {
                let at = sensor.point(i % 20, i / 20, 0.0);
                // A step of half a metre in the middle: each side keeps its own slope.
                (0.5 * at.x - 0.25 * at.y + if i % 20 < 10 { 0.0 } else { 0.5 }) as f32
            })
            .collect();
        let image = RangeImage { width: 20, height: 20, depth_m, ..RangeImage::default() };
        let expected = Vector3::new(-0.5, 0.25, 1.0).normalize();
        for normal in Slopes::of(&sensor, &image, 2).normals {
            assert!((normal.unwrap() - expected).norm() < 1e-5);
        }
    }
}
