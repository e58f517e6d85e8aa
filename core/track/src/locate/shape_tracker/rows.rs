//! The tables of the shape tracker, read row by row, and quantities derived from its numbers alone, for the page and
//! the recording (R155, R200–R203).
//!
//! They are read from the trace or, as arrays, from the network, with the same numbers. Points: current rover frame, m.

use nalgebra::Matrix2;

use super::evidence::{MESH_COLUMNS, PATH_COLUMNS, Registered};
use crate::locate::Located;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Vector3};

/// A step of the refinement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathStep {
    /// Number of evaluations of the objective so far.
    pub evaluations: u32,
    /// Run of the refinement, from 0; the simplex is restarted for each run.
    pub run: u32,
    /// J: mean distance of the surfaces, m.
    pub mean_m: f64,
    /// Shift of the moving surface from its start, m, along the axes of the sensor.
    pub shift_m: [f64; 3],
    /// Rotation of the moving surface from its start, rad, about the same axes.
    pub turn_rad: [f64; 3],
}

/// The corners of a facet, m.
pub type Facet = [[f32; 3]; 3];

/// Reads the steps of a refinement from its values.
pub fn path(values: &[f32]) -> impl Iterator<Item = PathStep> {
    values.chunks_exact(PATH_COLUMNS).map(|row| {
        let three = |first: usize| [row[first], row[first + 1], row[first + 2]].map(f64::from);
        PathStep {
            evaluations: row[0] as u32,
            run: row[1] as u32,
            mean_m: f64::from(row[2]),
            shift_m: three(3),
            turn_rad: three(6),
        }
    })
}

/// Reads the facets of a mesh from its values.
pub fn facets(values: &[f32]) -> impl Iterator<Item = Facet> {
    values.chunks_exact(MESH_COLUMNS).map(|row| {
        let corner = |first: usize| [row[first], row[first + 1], row[first + 2]];
        [corner(0), corner(3), corner(6)]
    })
}

/// The covariance in the left image of a target that the shape tracker registered, px²: `J Σ Jᵀ` with the camera's
/// Jacobian at the target; `None` if it was not registered.
pub fn registered_covariance_px2(located: &Located, left: &Camera) -> Option<Matrix2<f64>> {
    located.evidence.shape()?.registration.as_ref()?;
    let (_, jacobian) = left.model.project_with_jacobian(located.position_in_rover.as_ref()?)?;
    Some(jacobian * located.covariance_in_rover? * jacobian.transpose())
}

/// The outline in an image of a ball about a point of the rover frame (m), as a circle across the line of sight: the
/// basin of the registration, whose radius is the rock's half width (R155). Empty if any of it is behind the camera.
pub fn basin(centre: &Point3, half_width_m: f64, camera: &Camera) -> Vec<Pixel> {
    const POINTS: usize = 48;
    let sight = centre - camera.model.centre();
    let across = sight.cross(&Vector3::z());
    let Some(across) = across.try_normalize(1e-9) else { return Vec::new() };
    let down = sight.cross(&across).normalize();
    let place = |i: usize| {
        let (sin, cos) = (std::f64::consts::TAU * i as f64 / POINTS as f64).sin_cos();
        camera.project(&(centre + (across * cos + down * sin) * half_width_m))
    };
    (0..POINTS).map(place).collect::<Option<Vec<_>>>().unwrap_or_default()
}

/// Side of a pixel of the virtual sensor, which is a step of the coarse search, m; `columns`: width of the sensor, px.
pub fn sensor_pixel_m(registered: &Registered, columns: u32) -> Option<f64> {
    Some(registered.sensor_side_m? / f64::from(columns.max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn rows_give_their_columns_back() {
        let values = [40.0, 1.0, 0.003, 0.01, -0.02, 0.03, 0.001, 0.002, -0.003, 41.0];
        let read: Vec<PathStep> = path(&values).collect();
        assert_eq!(read.len(), 1, "what is no whole row is left out");
        assert_eq!((read[0].evaluations, read[0].run), (40, 1));
        assert!((read[0].mean_m - 0.003).abs() < 1e-9 && (read[0].shift_m[1] + 0.02).abs() < 1e-8);
        assert!((read[0].turn_rad[2] + 0.003).abs() < 1e-9);
        let corners: Vec<f32> = (0..18).map(|value| value as f32).collect();
        let read: Vec<Facet> = facets(&corners).collect();
        assert_eq!(read[1], [[9.0, 10.0, 11.0], [12.0, 13.0, 14.0], [15.0, 16.0, 17.0]]);
    }

    #[test]
    fn the_basin_of_a_rock_is_as_wide_in_the_image_as_the_rock() {
        let camera = testing::camera();
        let ray = camera.ray(camera.centre_pixel()).unwrap();
        let (near, far) = (ray.at(3.0), ray.at(6.0));
        let width = |centre: &Point3| {
            let outline = basin(centre, 0.2, &camera);
            assert_eq!(outline.len(), 48);
            let across = outline.iter().map(|pixel| pixel.x);
            across.clone().fold(f64::MIN, f64::max) - across.fold(f64::MAX, f64::min)
        };
        let focal_px = camera.model.focal_length_px(camera.centre_pixel()).unwrap();
        assert!((width(&near) / (focal_px * 0.4 / 3.0) - 1.0).abs() < 0.01, "{}", width(&near));
        assert!((width(&near) / width(&far) - 2.0).abs() < 0.01);
        assert!(basin(&ray.at(-3.0), 0.2, &camera).is_empty());
    }
}
