//! Points of rendered pairs, compared with the true surface at the pixels.

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::Pixel;
use sightline_vision::image::GrayImage;
use sightline_vision::stereo::*;
use sightline_world::camera::rig::Rig;
use sightline_world::scenario::CameraRig;
use sightline_world::truth::pixel_truth;
use sightline_world::{Eye, NoiseSeed, Scenario, World, index, render, true_camera_in_site};

/// The pair of a stop of the demonstration, with noise, and its cameras in the site frame.
fn rendered(rig: Option<CameraRig>, size: u32) -> (World, [GrayImage; 2], [Camera; 2]) {
    let mut scenario = Scenario::demo();
    scenario.camera.image_size = size;
    let world = World::new(&scenario);
    let index = index(&scenario, &world).unwrap();
    let stop = index.stops.last().unwrap();
    let eyes = [Eye::Left, Eye::Right];
    let cameras = match rig {
        Some(rig) => {
            let site_from_rover = stop.truth.as_ref().unwrap().site_from_rover.to_pose();
            let (left, right) = Rig::of(rig, size).cameras_in_rover(None);
            [left.moved(&site_from_rover), right.moved(&site_from_rover)]
        }
        None => eyes.map(|eye| true_camera_in_site(stop, eye).unwrap()),
    };
    let images = [0, 1].map(|k| render(&world, &scenario, &cameras[k], NoiseSeed { step: 0, eye: eyes[k] }));
    (world, images, cameras)
}

#[test]
fn points_of_real_cameras_lie_on_the_surface_that_they_show() {
    for (rig, size, found_min) in [(None, 256, 0.6), (Some(CameraRig::MerFrontHazcam), 512, 0.4)] {
        let (world, [left, right], [left_camera, right_camera]) = rendered(rig, size);
        let settings = StereoSettings { range_min_m: 0.25, ..StereoSettings::default() };
        let stereo = dense_stereo([&left, &right], [&left_camera, &right_camera], &settings).unwrap();
        let (mut off_px, mut seen) = (Vec::new(), 0);
        for y in 0..size {
            let row = stereo.alignment.left_row(y.into());
            for x in 0..size {
                let pixel = row.at(x.into());
                let truth = Some(pixel).filter(|p| p.is_inside(size, size)).and_then(|pixel| {
                    let ray = left_camera.ray(pixel)?;
                    pixel_truth(&world, &left_camera, pixel).map(|hit| ray.at(hit.distance_m))
                });
                let Some(truth) = truth else { continue };
                seen += 1;
                let Some(point) = stereo.point(x, y) else { continue };
                // An error along the ray is measured as the distance of the two projections into the right image.
                let pixels = right_camera.project(&truth).zip(right_camera.project(&point));
                off_px.push(pixels.map_or(99.0, |(a, b): (Pixel, Pixel)| a.distance(b)));
            }
        }
        off_px.sort_by(f64::total_cmp);
        let share = off_px.len() as f64 / f64::from(seen);
        let (median, most) = (off_px[off_px.len() / 2], off_px[off_px.len() * 95 / 100]);
        println!("{rig:?}: {share:.3} found, off by {median:.3} px (median), {most:.3} px (95 %)");
        assert!(share > found_min && median < 0.25 && most < 1.5, "{rig:?}");
    }
}
