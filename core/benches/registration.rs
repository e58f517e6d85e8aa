//! Speed of a registration; the goal is well below half a second on two cores, of the two that a hand-off may take.
//!
//! **The bound.** A rock of 0.5 m in a sensor of 64 × 64 pixels, vertices 7 mm apart: 20,000 facets near the sensor, 55,000
//! in reach of the search, which covers 47 × 47 shifts:
//!
//! | what | work | at what the processor can do |
//! |---|---|---|
//! | meshes | 2 × 130,000 points, a square root and a median of 4 each, 20 ns | 5 ms |
//! | a picture of depths | 10,000 vertices of 20 operations, 16 at a time: 10 µs; 20,000 facets of 40 whole-number operations, 3 a cycle: 100 µs | 0.11 ms |
//! | coarse search | 2,209 shifts × 1,024 pixels, a difference, a median and a sum: 3 ns on two cores | 4 ms |
//! | simplex | 500 pictures, one after the other | 55 ms |
//! | point to plane | 18 pictures with normals' products, 4,096 × 60 operations more | 4 ms |
//! | covariance | normals of 4,096 windows of 25 pixels, 144 lags of 4,096 products | 1.5 ms |
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench registration` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use divan::Bencher;
use sightline_experiments::registration::views::Stereo;
use sightline_experiments::registration::{Case, Staging, rock_cases};
use sightline_geometry::frames::Pose;
use sightline_vision::registration::{Mesh, Method, ShapeSettings, SimplexSettings};

fn main() {
    divan::main();
}

/// The first rock of the study, its start and its meshes.
fn scene(settings: &ShapeSettings) -> (Case, Pose, [Mesh; 2]) {
    let staging = Staging::default();
    let case = rock_cases(1, &staging, &Stereo::default(), 1000).remove(0);
    let start = case.start(0.5, &staging, 1);
    let meshes = case.meshes(&start, settings);
    (case, start, meshes)
}

fn registration(bencher: Bencher<'_, '_>, settings: ShapeSettings) {
    let (case, start, [fixed, moving]) = scene(&settings);
    bencher.bench_local(|| case.register([&fixed, &moving], &start, &settings));
}

/// As in the paper: coarse search, then the simplex with two restarts.
#[divan::bench(sample_count = 20)]
fn simplex_l1(bencher: Bencher<'_, '_>) {
    registration(bencher, ShapeSettings { method: Method::SimplexL1, ..ShapeSettings::default() });
}

/// Coarse search, then robust least squares.
#[divan::bench(sample_count = 50)]
fn point_to_plane(bencher: Bencher<'_, '_>) {
    registration(bencher, ShapeSettings { method: Method::PointToPlane, ..ShapeSettings::default() });
}

/// All but the refinement: pictures, coarse search, covariance.
#[divan::bench(sample_count = 50)]
fn without_refinement(bencher: Bencher<'_, '_>) {
    let simplex = SimplexSettings { restarts: 0, evaluations_max: 0, ..SimplexSettings::default() };
    registration(bencher, ShapeSettings { method: Method::SimplexL1, simplex, ..ShapeSettings::default() });
}

/// The two meshes from their points.
#[divan::bench(sample_count = 50)]
fn both_meshes(bencher: Bencher<'_, '_>) {
    let settings = ShapeSettings::default();
    let (case, start, _) = scene(&settings);
    bencher.bench_local(|| case.meshes(&start, &settings));
}
