//! A real hand-off: Opportunity's navcam, whose mast turned and so saw the ground from two positions 6.7 cm apart, and her
//! front hazcam, from the same rover position three sols earlier.
//!
//! A test without its images is skipped (see `sightline_testdata`).

use sightline_track::locate::shape_tracker::view::View;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Matrix3;

use sightline_track::locate::shape_tracker::drape::{DrapeInput, drape};
use sightline_track::locate::shape_tracker::surface::StopSurface;

use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::estimate::quantile::median;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_recordings::import::pds3::Product;
use sightline_track::stages::capture::StereoPair;
use sightline_vision::image::GrayImage;
use sightline_vision::registration::{Mesh, MeshSettings, PointGrid};
use sightline_vision::stereo::StereoSettings;

const SET: &str = "mer1-navcam-sol4087-pair";
const NAVCAM: [&str; 2] = ["1N491020376ILFCNY9P0706L0M1.IMG", "1N491020519ILFCNY9P0706L0M1.IMG"];
const HAZCAM: &str = "1F490747543EFFCNY9P1214L0M1.IMG";

fn set() -> Option<PathBuf> {
    sightline_testdata::recorded(SET, "the real hand-off")
}

fn frame(path: &Path) -> (Camera, Arc<GrayImage>) {
    let product = Product::read(path).unwrap();
    let raster = product.read_raster().unwrap();
    let full_scale = raster.full_scale_dn.unwrap_or(4095.0) as f32;
    let values = raster.samples.iter().map(|sample| sample / full_scale).collect();
    let image = GrayImage::from_raw(raster.width, raster.height, values).unwrap();
    (product.camera().unwrap(), Arc::new(image))
}

/// Left pixel and point (rover frame, m) of the set's matches, from OpenCV's SIFT and triangulated with the labels.
fn matches(folder: &Path) -> Vec<(Pixel, Point3)> {
    let text = std::fs::read_to_string(folder.join("reference_matches.csv")).unwrap();
    let row = |line: &str| -> Option<(Pixel, Point3)> {
        let n: Vec<f64> = line.split(',').map_while(|value| value.trim().parse().ok()).collect();
        let [u, v, _, _, x, y, z] = n[..] else { return None };
        Some((Pixel::new(u, v), Point3::new(x, y, z)))
    };
    text.lines().filter_map(row).collect()
}

/// Fits the ground z = a x + b y + c to points, without those more than 0.3 m off after a first fit.
fn ground(points: &[Point3]) -> nalgebra::Vector3<f64> {
    let fit = |points: &[&Point3]| {
        let rows = nalgebra::DMatrix::from_fn(points.len(), 3, |i, k| [points[i].x, points[i].y, 1.0][k]);
        let heights = nalgebra::DVector::from_fn(points.len(), |i, _| points[i].z);
        let plane = rows.svd(true, true).solve(&heights, 1e-12).unwrap();
        nalgebra::Vector3::new(plane[0], plane[1], plane[2])
    };
    let all: Vec<&Point3> = points.iter().collect();
    let first = fit(&all);
    let near: Vec<&Point3> = all
        .into_iter()
        .filter(|p| (first.dot(&nalgebra::Vector3::new(p.x, p.y, 1.0)) - p.z).abs() < 0.3)
        .collect();
    fit(&near)
}

/// The ground around a target as seen by the left navcam, with points 2 cm apart.
fn mesh(ground: &nalgebra::Vector3<f64>, target: &Point3, viewpoint: &Point3) -> Mesh {
    let mut grid = PointGrid::empty(101, 101);
    for row in 0..101 {
        for column in 0..101 {
            let (x, y) = (target.x + 0.02 * (50.0 - row as f64), target.y + 0.02 * (column as f64 - 50.0));
            let z = ground.dot(&nalgebra::Vector3::new(x, y, 1.0));
            grid.points[row * 101 + column] = Some(Point3::new(x, y, z));
        }
    }
    let settings = MeshSettings { spacing_m: 0.0, depth_ratio_max: 2.0, grazing_max_deg: 89.9 };
    Mesh::from_grid(&grid, viewpoint, None, &settings)
}

#[test]
fn mast_rotation_along_the_view_prevents_rectification() {
    let Some(folder) = set() else { return };
    let [(left, left_image), (right, right_image)] = NAVCAM.map(|name| frame(&folder.join(name)));
    let (from, to) = (left.model.centre(), right.model.centre());
    let along = (to - from).normalize().dot(&right.model.axis()).acos().to_degrees();
    println!("baseline {:.1} mm, {along:.0} deg off the second view's axis", 1000.0 * (to - from).norm());
    assert!(((to - from).norm() - 0.067).abs() < 0.002 && along < 15.0);
    // The epipole is inside the image: no rotation of the cameras aligns the rows, and no surface is returned.
    let pair = StereoPair { left: left_image, right: right_image };
    let settings = StereoSettings { range_min_m: 2.0, ..StereoSettings::default() };
    let found = StopSurface::measure(&pair, [&left, &right], &settings, Cancel::default())
        .map_or(0, |surface| surface.points_m.iter().filter(|point| point[0].is_finite()).count());
    assert!(found < 1000, "{found} points");
}

/// The view of a target by the left navcam, with a 1σ of 10 cm.
fn view(target: Point3, mesh: Mesh, left: &Camera, image: &Arc<GrayImage>) -> View {
    View {
        step: 0,
        site_from_rover: Pose::identity(),
        position_in_rover: target,
        covariance_in_rover: Matrix3::identity() * 0.01,
        ray: None,
        half_width_m: 0.5,
        mesh,
        left: left.clone(),
        image: Arc::clone(image),
    }
}

#[test]
fn no_false_hand_off_on_ground_seen_edge_on() {
    let Some(folder) = set() else { return };
    let (left, left_image) = frame(&folder.join(NAVCAM[0]));
    let (hazcam, hazcam_image) = frame(&folder.join(HAZCAM));
    let viewpoint = left.model.centre();
    let is_near = |point: &Point3| (point - viewpoint).norm() < 9.0 && point.x > 0.0;
    let near: Vec<(Pixel, Point3)> =
        matches(&folder).into_iter().filter(|(_, point)| is_near(point)).collect();
    let ground = ground(&near.iter().map(|(_, point)| *point).collect::<Vec<_>>());
    println!("ground z = {:.3} x + {:.3} y + {:.3}", ground[0], ground[1], ground[2]);
    let (mut seen, mut shifts, mut scores, mut why) = (0, Vec::new(), Vec::new(), BTreeMap::new());
    for (pixel, _) in &near {
        // The target is the intersection of the line of sight with the ground: stereo with a baseline of 6.7 cm is no better
        // than 0.3 m.
        let ray = left.ray(*pixel).unwrap();
        let normal = nalgebra::Vector3::new(ground[0], ground[1], -1.0);
        let distance_m = -(normal.dot(&ray.origin.coords) + ground[2]) / normal.dot(&ray.direction);
        let target = ray.at(distance_m);
        let Some(in_hazcam) = hazcam.project(&target) else { continue };
        if !is_near(&target) || !in_hazcam.is_inside(hazcam.width(), hazcam.height()) {
            continue;
        }
        seen += 1;
        let view = view(target, mesh(&ground, &target, &viewpoint), &left, &left_image);
        let input = DrapeInput {
            view: &view,
            fixed_from_moving: &Pose::identity(),
            registered: &target,
            covariance: &view.covariance_in_rover,
            camera: &hazcam,
            image: &hazcam_image,
            window_px: 31,
            score_min: 0.7,
        };
        match drape(&input) {
            Ok((_, _, draped)) => {
                shifts.push(draped.correction_px);
                scores.push(draped.score);
            }
            Err(reason) => {
                let kind = reason
                    .to_string()
                    .split(|c: char| c.is_ascii_digit())
                    .next()
                    .unwrap_or_default()
                    .to_owned();
                *why.entry(kind).or_insert(0) += 1;
            }
        }
    }
    println!("{seen} targets within 9 m are in the hazcam's image; {} found", shifts.len());
    println!("shift {:?} px, score {:?} (medians); else {why:?}", median(&shifts), median(&scores));
    assert!(seen > 50, "{seen}");
    // Every target has a result or a reason. The hazcam is half a metre above ground that is 5 m away and slopes down.
    assert_eq!(seen, shifts.len() + why.values().sum::<usize>());
    let edge_on: usize =
        why.iter().filter(|(kind, _)| kind.contains("edge-on")).map(|(_, count)| count).sum();
    assert!(10 * edge_on > 9 * seen, "{why:?}");
}
