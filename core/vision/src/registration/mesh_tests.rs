//! Meshes of analytic surfaces: cuts, level of detail, error of thinning.

use super::*;

/// Points on the rays of a pinhole at a depth that depends on the pixel.
fn grid(side: usize, depth_m: impl Fn(f64, f64) -> f64) -> PointGrid {
    let middle = (side as f64 - 1.0) / 2.0;
    let point = |i: usize| {
        let [u, v] = [i % side, i / side].map(|n| (n as f64 - middle) / 500.0);
        let z = depth_m(u, v);
        z.is_finite().then(|| Point3::new(u * z, v * z, z))
    };
    PointGrid {
        width: side,
        height: side,
        points: (0..side * side).map(point).collect(),
        range_sigma_m: None,
    }
}

fn mesh(grid: &PointGrid, spacing_m: f64) -> Mesh {
    let settings = MeshSettings { spacing_m, ..MeshSettings::default() };
    Mesh::from_grid(grid, &Point3::origin(), None, &settings)
}

/// Returns whether a mesh has facets across x = 0.
fn bridges(mesh: &Mesh) -> bool {
    mesh.triangles.iter().any(|triangle| {
        let sides = triangle.map(|vertex| mesh.vertices[vertex as usize].x > 0.0);
        sides.contains(&true) && sides.contains(&false)
    })
}

#[test]
fn a_jump_of_more_than_five_percent_is_cut_and_a_smaller_one_is_not() {
    let step = |ratio: f64| grid(40, move |u, _| if u > 0.0 { 2.0 * ratio } else { 2.0 });
    let settings = MeshSettings { spacing_m: 0.0, grazing_max_deg: 90.0, ..MeshSettings::default() };
    let of = |ratio: f64| Mesh::from_grid(&step(ratio), &Point3::origin(), None, &settings);
    assert!(bridges(&of(1.045)));
    let cut = of(1.055);
    assert!(!bridges(&cut));
    assert_eq!(cut.triangles.len(), 2 * 39 * 38);
}

#[test]
fn facets_that_are_seen_edge_on_are_left_out() {
    // 4 cm over the 4 mm between neighbours: a ratio of 1.02, but an angle of 84°.
    let rim = grid(40, |u, _| if u > 0.0 { 2.04 } else { 2.0 });
    assert!(!bridges(&mesh(&rim, 0.0)));
}

#[test]
fn all_facets_go_round_clockwise_for_the_viewpoint() {
    let mesh = mesh(&grid(60, |u, v| 2.0 + 0.1 * (20.0 * u).sin() * (15.0 * v).cos()), 0.01);
    assert!(mesh.triangles.len() > 500);
    for [a, b, c] in
        mesh.triangles.iter().map(|triangle| triangle.map(|vertex| mesh.vertices[vertex as usize]))
    {
        assert!((b - a).cross(&(c - a)).dot(&a.coords) > 0.0);
    }
}

#[test]
fn a_hole_stays_a_hole_and_a_missing_corner_leaves_one_facet() {
    let holed = grid(10, |u, v| if u.abs() < 0.002 && v.abs() < 0.002 { f64::NAN } else { 2.0 });
    // Four points are missing: nine cells lose corners. The four at the corners of the hole keep one facet each unless
    // their diagonal ends at the missing point.
    let triangles = mesh(&holed, 0.0).triangles.len();
    assert_eq!(holed.count(), 96);
    assert!((2 * 81 - 18..=2 * 81 - 14).contains(&triangles), "{triangles}");
}

#[test]
fn thinning_tells_what_it_loses_and_a_wrong_point_does_not_count() {
    // A ball of radius R = 0.5 m, spacing s: between four corners the mesh is s²/(6 R) too deep on average, the median
    // of a block s²/(12 R), and a slant of up to 28° increases both by up to half: 0.25 to 0.38 s²/R.
    let ball = |u: f64, v: f64| {
        let sight = Vector3::new(u, v, 1.0);
        let (a, b, c) = (sight.norm_squared(), 2.0 * sight.z, 4.0 - 0.25);
        (b - (b * b - a * c).sqrt()) / a
    };
    let mut exact = grid(120, ball);
    let fine = mesh(&exact, 0.0);
    assert!(fine.detail.worst_m < 1e-12 && fine.detail.stride == 1);
    let thin = mesh(&exact, 0.03);
    let spacing_m = 1.5 / 500.0 * thin.detail.stride as f64;
    let sag_m = spacing_m * spacing_m / 0.5;
    assert!(thin.detail.stride >= 9 && thin.detail.points > 10_000);
    assert!((0.25 * sag_m..0.38 * sag_m).contains(&thin.detail.rms_m), "{} {sag_m}", thin.detail.rms_m);
    assert!(thin.detail.worst_m < 1.5 * sag_m);
    if let Some(point) = &mut exact.points[60 * 120 + 60] {
        point.coords *= 1.5;
    }
    let vertices = mesh(&exact, 0.03).vertices;
    let moved = vertices.iter().zip(&thin.vertices).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(moved < 0.05 * sag_m, "{moved}");
}

#[test]
fn only_the_region_is_meshed() {
    let wall = grid(100, |_, _| 2.0);
    let region = Region { centre: Point3::new(0.1, 0.0, 2.0), radius_m: 0.05 };
    let mesh = Mesh::from_grid(&wall, &Point3::origin(), Some(&region), &MeshSettings::default());
    assert!(mesh.vertices.iter().all(|vertex| (vertex - region.centre).norm() <= 0.05));
    let area: f64 = mesh
        .triangles
        .iter()
        .map(|triangle| triangle.map(|vertex| mesh.vertices[vertex as usize]))
        .map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm())
        .sum();
    assert!((area / (std::f64::consts::PI * 0.0025) - 1.0).abs() < 0.35, "{area}");
}
