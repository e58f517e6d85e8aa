//! Half the width of the rock under a target, from its first surface; the sensor must cover it (R191, R155).
//!
//! ```text
//! ground:   z = a x + b y + c over the vertices within 0.7 m; ten iterations, those more than 2 cm above weighted by 1/50
//! rock:     the vertices more than max(3 cm, ¼ height of the target) above it that facets connect to the target
//! half width = ½ (max − min) of (v − target) · (level direction across the line of sight)
//! ```
//! Objects above the ground bias an unweighted fit upwards. The small weights make it follow the ground, like the
//! lower envelope of asymmetric least squares. A target on the ground has no width.
//!
//! Frame: rover, z down. Source: ours.

use nalgebra::{Matrix3, Vector3};

use sightline_geometry::frames::Point3;
use sightline_vision::registration::Mesh;

/// The ground is fitted within this horizontal distance of the target, m.
const AROUND_M: f64 = 0.7;
/// Vertices more than this above the plane are down-weighted, m.
const ABOVE_M: f64 = 0.02;
/// Weight of these vertices.
const WEIGHT_ABOVE: f64 = 0.02;
/// Number of iterations of the fit.
const ROUNDS: usize = 10;
/// Smallest height of rock: m, and share of the target's height; the larger one applies.
const ROCK_FROM: (f64, f64) = (0.03, 0.25);
/// The connected region starts from rock vertices within this distance of the target, m.
const NEAR_M: f64 = 0.05;
/// Smallest and largest accepted half width, m.
const BELIEVED_M: [f64; 2] = [0.06, 0.5];

/// Half the width of the rock under the target, m; `None` without rock, or if the width is outside the accepted range.
pub(super) fn half_width_m(mesh: &Mesh, target: &Point3) -> Option<f64> {
    let ground = ground(mesh, target)?;
    let height = |point: &Point3| ground[0] * point.x + ground[1] * point.y + ground[2] - point.z;
    let least_m = ROCK_FROM.0.max(ROCK_FROM.1 * height(target));
    if height(target) < least_m {
        return None;
    }
    let is_rock: Vec<bool> = mesh.vertices.iter().map(|vertex| height(vertex) > least_m).collect();
    let mut is_reached: Vec<bool> = (mesh.vertices.iter().zip(&is_rock))
        .map(|(vertex, is_rock)| *is_rock && (vertex - target).norm() < NEAR_M)
        .collect();
    spread(mesh, &is_rock, &mut is_reached);
    let across = Vector3::z().cross(&(target - mesh.viewpoint)).try_normalize(1e-9)?;
    let places = mesh.vertices.iter().zip(&is_reached).filter(|(_, is_reached)| **is_reached);
    let (least, most) = places
        .map(|(vertex, _)| (vertex - target).dot(&across))
        .fold((f64::MAX, f64::MIN), |(least, most), place| (least.min(place), most.max(place)));
    let half_width_m = 0.5 * (most - least);
    (BELIEVED_M[0]..=BELIEVED_M[1]).contains(&half_width_m).then_some(half_width_m)
}

/// Fits the ground z = a x + b y + c; returns (a, b, c).
fn ground(mesh: &Mesh, target: &Point3) -> Option<Vector3<f64>> {
    let near: Vec<&Point3> =
        mesh.vertices.iter().filter(|vertex| (*vertex - target).xy().norm() < AROUND_M).collect();
    let mut plane: Option<Vector3<f64>> = None;
    for _ in 0..ROUNDS {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for point in &near {
            let row = Vector3::new(point.x, point.y, 1.0);
            let is_above = plane.is_some_and(|plane| plane.dot(&row) - point.z > ABOVE_M);
            let weight = if is_above { WEIGHT_ABOVE } else { 1.0 };
            normal += row * row.transpose() * weight;
            right += row * (point.z * weight);
        }
        plane = Some(normal.cholesky()?.solve(&right));
    }
    plane
}

/// Marks all rock vertices that facets connect to marked ones.
fn spread(mesh: &Mesh, is_rock: &[bool], is_reached: &mut [bool]) {
    loop {
        let mut grew = false;
        for triangle in &mesh.triangles {
            let corners = triangle.map(|corner| corner as usize);
            if corners.iter().any(|&corner| is_reached[corner]) {
                for corner in corners {
                    grew |= is_rock[corner] && !is_reached[corner];
                    is_reached[corner] |= is_rock[corner];
                }
            }
        }
        if !grew {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_vision::registration::{MeshSettings, PointGrid};

    /// A camera 1.5 m above sloping ground with a box-shaped rock, `half_m` to each side, of which front and top are
    /// visible.
    fn mesh(half_m: f64, height_m: f64) -> (Mesh, Point3) {
        let viewpoint = Point3::new(0.0, 0.0, -1.2);
        let mut grid = PointGrid::empty(240, 240);
        let ground_at = |x: f64, y: f64| 0.3 + 0.05 * x + 0.02 * y;
        for row in 0..240 {
            for column in 0..240 {
                // Sampled on a map: neighbours in the grid are neighbours on the ground.
                let (x, y) = (2.0 + (120.0 - row as f64) * 0.006, (column as f64 - 120.0) * 0.006);
                let is_rock = (x - 2.0).abs() < half_m && y.abs() < half_m;
                let up = if is_rock { height_m } else { 0.0 };
                grid.points[row * 240 + column] = Some(Point3::new(x, y, ground_at(x, y) - up));
            }
        }
        let settings = MeshSettings { spacing_m: 0.0, depth_ratio_max: 1.5, grazing_max_deg: 89.9 };
        let mesh = Mesh::from_grid(&grid, &viewpoint, None, &settings);
        (mesh, Point3::new(2.0, 0.0, ground_at(2.0, 0.0) - height_m))
    }

    #[test]
    fn a_rock_on_a_slope_is_as_wide_as_it_is() {
        for half_m in [0.1, 0.2, 0.3] {
            let (mesh, target) = mesh(half_m, 0.2);
            let found = half_width_m(&mesh, &target).unwrap();
            assert!((found - half_m).abs() < 0.012, "{half_m}: {found}");
        }
    }

    #[test]
    fn flat_ground_and_a_pebble_have_no_width() {
        let (mesh, target) = mesh(0.2, 0.0);
        assert_eq!(half_width_m(&mesh, &target), None);
        let (mesh, target) = self::mesh(0.03, 0.1);
        assert_eq!(half_width_m(&mesh, &target), None);
        assert_eq!(half_width_m(&Mesh::default(), &target), None);
    }
}
