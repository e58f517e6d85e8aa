//! A real hand-off: Opportunity's navcam, which turned its mast and so saw the ground from two places 6.7 cm apart, and her
//! front hazcam, which looked from the same rover position three sols before.
//!
//! The images are not part of the project: `$SIGHTLINE_DATA` names their folder, without it `../shared/data` beside the
//! workspace. A test whose images are missing says so and passes.

use std::path::{Path, PathBuf};

use nalgebra::Matrix3;

use super::drape::{DrapeInput, drape};
use super::surface::StopSurface;
use super::*;
use crate::camera::Camera;
use crate::frames::{Pixel, Pose};
use crate::image::GrayImage;
use crate::stages::capture::StereoPair;
use crate::stereo::StereoSettings;
use crate::traverse::import::pds3::Product;

const SET: &str = "mer1-navcam-sol4087-pair";
const NAVCAM: [&str; 2] = ["1N491020376ILFCNY9P0706L0M1.IMG", "1N491020519ILFCNY9P0706L0M1.IMG"];
const HAZCAM: &str = "1F490747543EFFCNY9P1214L0M1.IMG";

fn set() -> Option<PathBuf> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent()?;
    let folder = std::env::var_os("SIGHTLINE_DATA")
        .map_or_else(|| workspace.join("../shared/data"), PathBuf::from)
        .join(SET);
    if !folder.is_dir() {
        eprintln!("left out: the real hand-off needs {SET}");
        return None;
    }
    Some(folder)
}

fn frame(path: &Path) -> (Camera, Arc<GrayImage>) {
    let product = Product::read(path).unwrap();
    let raster = product.read_raster().unwrap();
    let full_scale = raster.full_scale_dn.unwrap_or(4095.0) as f32;
    let values = raster.samples.iter().map(|sample| sample / full_scale).collect();
    let image = GrayImage::from_raw(raster.width, raster.height, values).unwrap();
    (product.camera().unwrap(), Arc::new(image))
}

/// Left pixel and point (rover frame, m) of the set's matches, made with OpenCV's SIFT and triangulated with the labels.
fn matches(folder: &Path) -> Vec<(Pixel, Point3)> {
    let text = std::fs::read_to_string(folder.join("reference_matches.csv")).unwrap();
    let row = |line: &str| -> Option<(Pixel, Point3)> {
        let n: Vec<f64> = line.split(',').map_while(|value| value.trim().parse().ok()).collect();
        let [u, v, _, _, x, y, z] = n[..] else { return None };
        Some((Pixel::new(u, v), Point3::new(x, y, z)))
    };
    text.lines().filter_map(row).collect()
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn a_turned_mast_gives_a_surface_whose_disparities_are_those_of_matched_features() {
    let Some(folder) = set() else { return };
    let [(left, left_image), (right, right_image)] = NAVCAM.map(|name| frame(&folder.join(name)));
    let pair = StereoPair { left: left_image, right: right_image };
    let settings = StereoSettings { range_min_m: 2.0, ..StereoSettings::default() };
    let surface = StopSurface::measure(&pair, [&left, &right], &settings).unwrap();
    let alignment = &surface.alignment;
    let (mut off_px, mut asked) = (Vec::new(), 0);
    for (_, point) in matches(&folder) {
        let range_m = (point - surface.viewpoint).norm();
        let (Some(at), Some(partner)) = (alignment.left.project(&point), alignment.right.project(&point))
        else {
            continue;
        };
        if !(2.5..30.0).contains(&range_m) || !at.is_inside(alignment.left.width(), alignment.left.height()) {
            continue;
        }
        asked += 1;
        if let Some(found) = surface.disparities.at(at.x.round() as u32, at.y.round() as u32) {
            off_px.push((f64::from(found) - (at.x - partner.x)).abs());
        }
    }
    let (answered, median_px) = (off_px.len(), median(&mut off_px));
    let p90_px = off_px[answered * 9 / 10];
    println!(
        "baseline {:.4} m; {answered} of {asked} matches have a disparity; off by {median_px:.2} px (median), {p90_px:.2} px (90 %)",
        alignment.baseline_m()
    );
    assert!((alignment.baseline_m() - 0.067).abs() < 0.002);
    assert!(2 * answered > asked, "{answered} of {asked}");
    assert!(median_px < 0.7, "{median_px} px");
}

#[test]
fn the_navcams_ground_draped_over_its_surface_is_looked_for_in_the_hazcam_three_sols_before() {
    let Some(folder) = set() else { return };
    let [(left, left_image), (right, right_image)] = NAVCAM.map(|name| frame(&folder.join(name)));
    let (hazcam, hazcam_image) = frame(&folder.join(HAZCAM));
    let pair = StereoPair { left: Arc::clone(&left_image), right: right_image };
    let stereo = StereoSettings { range_min_m: 2.0, ..StereoSettings::default() };
    let surface = StopSurface::measure(&pair, [&left, &right], &stereo).unwrap();
    let settings = ShapeTrackerSettings { surface_sigma_px: 0.3, mesh_spacing_m: 0.03, ..Default::default() };
    let (mut seen, mut shifts, mut scores, mut why) =
        (0, Vec::new(), Vec::new(), std::collections::BTreeMap::new());
    for (_, point) in matches(&folder) {
        let Some(pixel) = hazcam.project(&point) else { continue };
        let range_m = (point - surface.viewpoint).norm();
        if range_m > 9.0 || !pixel.is_inside(hazcam.width(), hazcam.height()) {
            continue;
        }
        seen += 1;
        let mesh = surface.mesh(&Region { centre: point, radius_m: 1.5 }, &settings);
        let view = View {
            step: 0,
            site_from_rover: Pose::identity(),
            position_in_rover: point,
            covariance_in_rover: Matrix3::identity() * 0.01,
            ray: None,
            half_width_m: 0.5,
            mesh,
            left: left.clone(),
            image: Arc::clone(&left_image),
        };
        let input = DrapeInput {
            view: &view,
            fixed_from_moving: &Pose::identity(),
            registered: &point,
            covariance: &(Matrix3::identity() * 0.01),
            camera: &hazcam,
            image: &hazcam_image,
            window_px: 31,
            score_min: 0.6,
        };
        match drape(&input) {
            Ok((_, _, draped)) => {
                shifts.push(draped.correction_px);
                scores.push(draped.score);
            }
            Err(reason) => {
                let kind = reason.split(|c: char| c.is_ascii_digit()).next().unwrap_or_default().to_owned();
                *why.entry(kind).or_insert(0) += 1;
            }
        }
    }
    println!("{seen} matches within 9 m are in the hazcam's image; {} found", shifts.len());
    if !shifts.is_empty() {
        println!("shift {:.1} px, score {:.2} (medians)", median(&mut shifts), median(&mut scores));
    }
    println!("{why:?}");
    assert!(seen > 0);
    // Every point has an answer or a sentence.
    assert_eq!(seen, shifts.len() + why.values().sum::<usize>());
}
