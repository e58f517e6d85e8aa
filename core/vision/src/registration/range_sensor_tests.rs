//! Range images compared with rays and planes; edges shared by two triangles.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::super::mesh::Mesh;
use super::super::rasterise::{Canvas, Facets, Picture, rasterise};
use super::*;

/// How often each pixel was written.
struct Counts {
    counts: Vec<u32>,
}

impl Canvas for Counts {
    fn put(&mut self, pixel: usize, _: f32, _: u32, _: [f32; 3]) {
        self.counts[pixel] += 1;
    }
}

fn sensor(side_px: usize) -> RangeSensor {
    RangeSensor::looking_at(&Point3::origin(), &Vector3::x(), 1.0, side_px)
}

/// A square of cells, each split along a random diagonal; vertices in the sensor's frame.
fn patchwork(cells: usize, side_m: f64, mut vertex: impl FnMut(f64, f64) -> Point3, seed: u64) -> Mesh {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut mesh = Mesh::default();
    for k in 0..(cells + 1) * (cells + 1) {
        let [x, y] = [k % (cells + 1), k / (cells + 1)].map(|n| (n as f64 / cells as f64 - 0.5) * side_m);
        mesh.vertices.push(vertex(x, y));
    }
    for k in 0..cells * cells {
        let a = (k / cells * (cells + 1) + k % cells) as u32;
        let (b, c, d) = (a + 1, a + cells as u32 + 1, a + cells as u32 + 2);
        let split = if random.random() { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] };
        mesh.triangles.extend(split);
    }
    mesh
}

/// Renders a mesh given in the sensor's frame.
fn seen(sensor: &RangeSensor, mesh: &Mesh) -> RangeImage {
    sensor.see(mesh, &Pose::identity())
}

#[test]
fn every_pixel_of_a_patchwork_is_drawn_exactly_once() {
    let sensor = sensor(64);
    // Random vertices, and vertices exactly on pixel centres, where edges and corners meet them.
    for (seed, jitter, side_m) in [(1, 0.4, 0.9), (2, 0.0, 0.75), (3, 0.4, 3.0)] {
        let mut random = Pcg64::seed_from_u64(seed);
        let cells = 24;
        let step_m = side_m / cells as f64;
        let mut moved = |x: f64, y: f64| {
            let is_rim = x.abs().max(y.abs()) > 0.499 * side_m;
            let mut by = || if is_rim { 0.0 } else { jitter * step_m * (random.random::<f64>() - 0.5) };
            Point3::new(x + by() + 0.5 / 64.0, y + by() + 0.5 / 64.0, 0.0)
        };
        let mesh = patchwork(cells, side_m, &mut moved, seed);
        let mut canvas = Counts { counts: vec![0; 64 * 64] };
        let facets = Facets::new(&mesh, &Pose::identity());
        rasterise(&sensor, &facets, &Pose::identity(), &mut Picture::default(), &mut canvas);
        let drawn: u32 = canvas.counts.iter().sum();
        assert!(canvas.counts.iter().all(|&count| count <= 1), "{seed}: doubles");
        let inside = |n: usize| {
            let place = (n as f64 - 31.5) / 64.0 - 0.5 / 64.0;
            place >= -0.5 * side_m - 1e-9 && place < 0.5 * side_m - 1e-9
        };
        let expected = (0..64).filter(|&n| inside(n)).count();
        assert_eq!(drawn as usize, expected * expected, "{seed}: gaps");
    }
}

#[test]
fn depth_and_weights_are_those_of_the_ray_s_meeting_with_the_facet() {
    let axis = Vector3::x();
    let sensors = [sensor(48), RangeSensor::pinhole(&Point3::origin(), &axis, 0.4, [60, 40])];
    for sensor in sensors {
        let away = if matches!(sensor.projection, Projection::Pinhole { .. }) { 2.0 } else { 0.0 };
        let plane = |x: f64, y: f64| Point3::new(x, y, away + 0.4 * x - 0.7 * y);
        let mesh = patchwork(12, 1.6, plane, 5);
        let image = seen(&sensor, &mesh);
        let mut pixels = 0;
        for pixel in (0..image.depth_m.len()).filter(|&pixel| image.facet[pixel] != NO_FACET) {
            pixels += 1;
            let there =
                sensor.point(pixel % sensor.width, pixel / sensor.width, f64::from(image.depth_m[pixel]));
            // On the plane to within the effect of 1/256 px at a slope of 0.8.
            assert!((plane(there.x, there.y).z - there.z).abs() < 1e-4);
            let weights = image.weights[pixel].map(f64::from);
            let triangle = mesh.triangles[image.facet[pixel] as usize];
            let sum: Vector3 = (0..3).map(|k| mesh.vertices[triangle[k] as usize].coords * weights[k]).sum();
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-5);
            assert!((sum - there.coords).norm() < 2e-4, "{sum} {there}");
        }
        assert!(pixels > 1500, "{pixels}");
    }
}

#[test]
fn the_nearest_front_is_seen_and_backs_are_not() {
    let wall = |z: f64, side_m: f64| patchwork(4, side_m, move |x, y| Point3::new(x, y, z), 7);
    let mut scene = wall(0.3, 2.0);
    for (z, side_m, is_back) in [(0.1, 0.5, false), (-0.2, 0.25, true)] {
        let part = wall(z, side_m);
        let first = scene.vertices.len() as u32;
        scene.vertices.extend(&part.vertices);
        scene.triangles.extend(part.triangles.iter().map(|&[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|vertex| vertex + first);
            if is_back { [a, c, b] } else { [a, b, c] }
        }));
    }
    let image = seen(&sensor(40), &scene);
    assert!((image.depth_m[20 * 40 + 20] - 0.1).abs() < 1e-6);
    assert!((image.depth_m[2 * 40 + 2] - 0.3).abs() < 1e-6);
    assert_eq!(image.covered(), 1.0);
}

#[test]
fn a_sensor_looks_at_its_target_with_level_columns() {
    let target = Point3::new(3.0, 1.0, 0.2);
    let sensor = RangeSensor::looking_at(&target, &Vector3::new(3.0, 1.0, 1.2), 0.7, 64);
    let at = sensor.sensor_from_fixed * target;
    assert!(at.coords.norm() < 1e-12);
    assert_eq!(sensor.pixel(&at), Some([31.5, 31.5]));
    // Down in the rover frame is down in the image, and right is right.
    let below = sensor.pixel(&(sensor.sensor_from_fixed * (target + Vector3::z() * 0.1))).unwrap();
    assert!((below[0] - 31.5).abs() < 1e-9 && below[1] > 35.0);
    let right = sensor.pixel(&(sensor.sensor_from_fixed * (target + Vector3::y() * 0.1))).unwrap();
    assert!(right[0] > 35.0);
    assert!(
        (sensor.point(40, 12, 0.3) - Point3::new(8.5 * 0.7 / 64.0, -19.5 * 0.7 / 64.0, 0.3)).norm() < 1e-12
    );
}

#[test]
fn facets_behind_a_pinhole_are_not_seen() {
    let pinhole = RangeSensor::pinhole(&Point3::origin(), &Vector3::x(), 0.5, [32, 32]);
    let behind = patchwork(4, 1.0, |x, y| Point3::new(x, y, -1.0), 1);
    assert_eq!(seen(&pinhole, &behind).covered(), 0.0);
}
