//! What the sky in the frame does to the exposure of the targets: full-frame against subframe (R79, R80).
//!
//! On an approach the mast looks down ever more steeply, and the sky leaves the frame. At each stop the left picture is
//! rendered once and exposed twice, each time from the exposure of the stop before, as on a drive: from the whole
//! frame, and from the square around its middle. The level of the targets is the mean recorded number, without noise,
//! of the windows around those targets that are seen there; both levels are those of the same pixels, so that what
//! differs between them is the time of exposure and nothing else.
//!
//! | name | what | unit |
//! |---|---|---|
//! | `sky_share` | part of 64 × 64 rays, spread over the frame, that meet nothing | 0 to 1 |
//! | `full_frame_dn`, `subframe_dn` | level of the targets | DN of 12 bits |
//!
//! Pure computation. Sources: papers.md R79, R80; domain.md 5.2.

use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use sightline_geometry::camera::Camera;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_vision::image::GrayImage;
use sightline_world::camera::exposure::{Rates, automatic};
use sightline_world::camera::render::visible_pixel;
use sightline_world::moment::Moment;
use sightline_world::scenario::{CameraSettings, ExposureMode, FULL_SCALE_DN};
use sightline_world::{
    Eye, Region, Scenario, World, choose_targets, clean_radiance, surface_point, true_camera_in_site,
};

/// Rays along each side of the frame by which the sky's share is measured.
const RAYS: u32 = 64;

/// One stop, exposed both ways.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ExposureRow {
    /// The stop.
    pub stop: usize,
    /// The part of the frame that shows sky, 0 to 1.
    pub sky_share: f64,
    /// Targets that are seen.
    pub targets: usize,
    /// Their mean level when the whole frame is metered, DN.
    pub full_frame_dn: f64,
    /// Their mean level when the square around the middle is metered, DN.
    pub subframe_dn: f64,
}

/// Exposes every stop of a scenario that sees a target both ways.
///
/// # Errors
/// A drive that is impossible in this world.
pub(crate) fn exposure_report(scenario: &Scenario, world: &World) -> Result<Vec<ExposureRow>> {
    let index = sightline_world::index(scenario, world)?;
    let first = index.stops.first().and_then(|stop| true_camera_in_site(stop, Eye::Left));
    let first = first.ok_or_else(|| Error::Request("the scenario has no first stop".to_owned()))?;
    let pixels = choose_targets(world, scenario, &index);
    let targets: Vec<Point3> =
        pixels.iter().filter_map(|pixel| surface_point(world, &first, *pixel)).collect();
    let modes = [ExposureMode::FullFrame, ExposureMode::Subframe]
        .map(|exposure| CameraSettings { exposure, ..scenario.camera.clone() });
    let mut times_s = [scenario.camera.auto_exposure.start_s; 2];
    let mut rows = Vec::new();
    for (number, stop) in index.stops.iter().enumerate() {
        let (Some(camera), Some(moment)) =
            (true_camera_in_site(stop, Eye::Left), Moment::of(number, &index.stops))
        else {
            continue;
        };
        let here = world.at(&moment, scenario);
        let whole = Region::whole(&camera);
        let radiance = clean_radiance(&here, scenario, &camera, whole, &AtomicBool::new(false))?;
        let rates = Rates::new(&radiance, scenario, &camera, Eye::Left, [0, 0]);
        let seen: Vec<Pixel> =
            targets.iter().filter_map(|target| visible_pixel(&here, &camera, target)).collect();
        let mut level = |mode: usize| {
            times_s[mode] = automatic(&rates, &modes[mode], None, times_s[mode]).time_s;
            mean_dn(&rates.levels(times_s[mode], &modes[mode]), &seen, scenario.targets.window_px)
        };
        let levels = [level(0), level(1)];
        if let [Some(full_frame_dn), Some(subframe_dn)] = levels {
            let sky_share = sky_share(&here, &camera);
            rows.push(ExposureRow {
                stop: number,
                sky_share,
                targets: seen.len(),
                full_frame_dn,
                subframe_dn,
            });
        }
    }
    Ok(rows)
}

/// The mean number of the windows around some pixels, DN; nothing where there are none.
fn mean_dn(levels: &GrayImage, pixels: &[Pixel], window_px: u32) -> Option<f64> {
    let half = i64::from(window_px / 2);
    let (mut sum, mut count) = (0.0, 0u32);
    for pixel in pixels {
        for (dx, dy) in (-half..=half).flat_map(|dx| (-half..=half).map(move |dy| (dx, dy))) {
            let place = [pixel.x.round() as i64 + dx, pixel.y.round() as i64 + dy].map(u32::try_from);
            if let [Ok(x), Ok(y)] = place
                && let Some(level) = levels.get_pixel_checked(x, y)
            {
                sum += f64::from(level.0[0]) * FULL_SCALE_DN;
                count += 1;
            }
        }
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// The part of a frame that shows sky.
fn sky_share(world: &World, camera_in_site: &Camera) -> f64 {
    let place = |k: u32, side: u32| (f64::from(k) + 0.5) / f64::from(RAYS) * f64::from(side) - 0.5;
    let at = |k: u32| {
        Pixel::new(place(k % RAYS, camera_in_site.width()), place(k / RAYS, camera_in_site.height()))
    };
    let rays = (0..RAYS * RAYS).filter_map(|k| camera_in_site.ray(at(k)));
    let sky = rays.filter(|ray| world.cast(ray).is_none()).count();
    sky as f64 / f64::from(RAYS * RAYS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_world::library;

    #[test]
    fn as_sky_leaves_the_frame_the_targets_brighten_unless_a_subframe_is_metered() {
        let [full, sub] = ["sky-full-frame", "sky-subframe"].map(|name| library::scenario(name).unwrap());
        assert_eq!(
            [full.camera.exposure, sub.camera.exposure],
            [ExposureMode::FullFrame, ExposureMode::Subframe]
        );
        let mut scenario = full.clone();
        (scenario.name, scenario.description) = (sub.name.clone(), sub.description.clone());
        scenario.camera.exposure = sub.camera.exposure;
        assert_eq!(scenario, sub, "the two differ in the exposure alone");
        let world = World::new(&scenario);
        (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 1);
        (scenario.camera.auto_exposure.subframe_px, scenario.targets.window_px) = (41, 5);
        scenario.drive.step_fraction = 0.3;
        let rows = exposure_report(&scenario, &world).unwrap();
        let (first, last) = (rows.first().unwrap(), rows.last().unwrap());
        assert!(first.sky_share >= 0.30 && last.sky_share == 0.0, "{rows:?}");
        assert!(rows.iter().all(|row| row.targets >= 3), "{rows:?}");
        assert!(first.full_frame_dn < 0.6 * last.full_frame_dn, "{rows:?}");
        let levels = || rows.iter().map(|row| row.subframe_dn);
        let (low, high) = (levels().fold(f64::INFINITY, f64::min), levels().fold(0.0, f64::max));
        assert!(high < 1.25 * low, "{rows:?}");
    }

    #[test]
    fn the_level_is_the_mean_of_the_windows_that_lie_in_the_picture() {
        let picture = GrayImage::from_fn(8, 8, |x, _| image::Luma([x as f32 / 10.0]));
        let found = mean_dn(&picture, &[Pixel::new(0.0, 4.0), Pixel::new(5.2, 4.0)], 3).unwrap();
        // Columns 0 and 1 of the first window, 4 to 6 of the second.
        assert!((found - 4095.0 * 0.1 * (3.0 * (0.0 + 1.0) + 3.0 * (4.0 + 5.0 + 6.0)) / 15.0).abs() < 1e-2);
        assert!(mean_dn(&picture, &[], 3).is_none());
    }
}
