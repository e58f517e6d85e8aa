//! From radiance to electrons, and the exposure time.
//!
//! ```text
//! rate      q(x, y) = k · F(x, y) · radiance(x, y)              electrons per second
//! charge    S = t q · (1 + response) + s q̄(x) + d t             electrons, mean of the count
//! number    DN = min(S, full well)/g + bias, at most 4095       without response: the clean image
//! ```
//!
//! **Fixed.** t is such that the mean of the first left image is `mean_level` (`render.rs`).
//!
//! **Automatic** (domain.md 5.2, after the parameters of real labels): with h the DN that `pixel_fraction_percent` of the
//! pixels exceed, in the whole image or in a square around the metered pixel (the predicted target in a commanded drive,
//! otherwise the image's centre),
//!
//! ```text
//! repeat up to 6 times:  t' = t (cut − bias)/(h − bias), limited to a factor 1/8 … 8;  t' = t/4 if h saturates
//!                        stop if |t'/t − 1| < change;  t = t' in whole units of 5.12 ms, at least one
//! ```
//!
//! It starts from the exposure of the previous stop, so a stop's exposure depends on the earlier images and on nothing
//! else. It uses the clean image: noise and response change h by less than its tolerance.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | t, s | exposure time, `smear_s` | s |
//! | k | `electrons_per_s` | e⁻/s per unit of radiance |
//! | F | `FlatField` | – |
//! | q̄ | mean rate of the pixel's column over the whole height | e⁻/s |
//! | d | `dark_electrons_per_s` | e⁻/s |
//! | g, bias, cut | `gain_electrons_per_dn`, `bias_dn`, `data_cut_dn` | e⁻/DN, DN, DN |
//!
//! Radiance is in the unit of `light/reflection.rs`. Sources: domain.md 5.2, 11.3; papers.md R79, R80.

use crate::camera::optics::FlatField;
use crate::camera::picture::{Eye, Region};
use crate::camera::render;
use crate::camera::rig::Rig;
use crate::scenario::{CameraSettings, ExposureMode, FULL_SCALE_DN, Scenario};
use crate::world::World;
use sightline_geometry::camera::{Camera, CameraName};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pixel;
use sightline_vision::image::GrayImage;

/// Unit of the exposure time, s (domain.md 5.1).
pub(crate) const UNIT_S: f64 = 0.00512;
/// The longest exposure, s (domain.md 5.1).
const LONGEST_S: f64 = 30.0;
/// Largest factor by which one step of the automatic exposure changes the time (domain.md 5.2).
const LARGEST_FACTOR: f64 = 8.0;
/// Factor on the time if h saturates (domain.md 5.2).
const SATURATED_FACTOR: f64 = 0.25;

/// The electrons per second that an image, or a part of it, collects.
#[derive(Clone, Debug)]
pub struct Rates {
    per_s: GrayImage,
    /// Smear charge of each column while the image is moved, e⁻.
    smear: Vec<f64>,
}

impl Rates {
    /// Rates of a part of an image of clean radiance; `first` is its first pixel in the whole image.
    ///
    /// Smear is computed from the given rows: with `smear_s` above zero, pass the full height.
    pub fn new(
        radiance: &GrayImage,
        scenario: &Scenario,
        camera: &Camera,
        eye: Eye,
        first: [u32; 2],
    ) -> Self {
        let per_radiance = scenario.camera.electrons_per_s as f32;
        let mut per_s = radiance.clone();
        per_s.iter_mut().for_each(|value| *value *= per_radiance);
        FlatField::new(scenario, camera, eye).apply(&mut per_s, first);
        let width = per_s.width() as usize;
        let mut smear = vec![0.0; width];
        if scenario.camera.smear_s > 0.0 {
            for line in per_s.chunks_exact(width.max(1)) {
                smear.iter_mut().zip(line).for_each(|(sum, rate)| *sum += f64::from(*rate));
            }
            let share = scenario.camera.smear_s / f64::from(per_s.height().max(1));
            smear.iter_mut().for_each(|sum| *sum *= share);
        }
        Self { per_s, smear }
    }

    /// Photoelectrons per second, e⁻/s.
    pub(crate) fn per_s(&self) -> &GrayImage {
        &self.per_s
    }

    /// The electrons of a pixel that its own response does not scale: smear and dark, e⁻.
    #[inline(always)]
    pub fn others(&self, column: usize, time_s: f64, camera: &CameraSettings) -> f64 {
        self.smear[column] + camera.dark_electrons_per_s * time_s
    }

    /// The clean image: the expected recorded value without response, fractions of full scale.
    pub fn levels(&self, time_s: f64, camera: &CameraSettings) -> GrayImage {
        let mut levels = self.per_s.clone();
        for line in levels.chunks_exact_mut(self.smear.len().max(1)) {
            for (column, value) in line.iter_mut().enumerate() {
                let electrons = f64::from(*value) * time_s + self.others(column, time_s, camera);
                *value = (number(electrons, camera) / FULL_SCALE_DN) as f32;
            }
        }
        levels
    }

    /// The clean DN that `above_percent` of a region's pixels exceed.
    fn high_dn(&self, region: Region, time_s: f64, camera: &CameraSettings, above_percent: f64) -> f64 {
        let rows = region.y..region.y + region.height;
        let columns = region.x..region.x + region.width;
        let mut electrons: Vec<f64> = rows
            .flat_map(|y| columns.clone().map(move |x| (x, y)))
            .map(|(x, y)| {
                f64::from(self.per_s.get_pixel(x, y).0[0]) * time_s + self.others(x as usize, time_s, camera)
            })
            .collect();
        let above = (above_percent / 100.0 * electrons.len() as f64) as usize;
        let place = electrons.len().saturating_sub(1 + above);
        if electrons.is_empty() {
            return camera.bias_dn;
        }
        let (_, high, _) = electrons.select_nth_unstable_by(place, f64::total_cmp);
        number(*high, camera)
    }
}

/// Output of the 12-bit converter for a charge, not rounded, DN.
#[inline(always)]
fn number(electrons: f64, camera: &CameraSettings) -> f64 {
    let held = electrons.clamp(0.0, camera.full_well_electrons);
    (held / camera.gain_electrons_per_dn + camera.bias_dn).min(FULL_SCALE_DN)
}

/// Result of the automatic exposure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoExposure {
    /// Exposure time, s, in whole units of 5.12 ms.
    pub time_s: f64,
    /// Number of trial exposures.
    pub tried: u32,
}

/// Exposure time of a world with fixed exposure, s.
pub fn fixed_s(world: &World, scenario: &Scenario) -> f64 {
    world.exposure * FULL_SCALE_DN * scenario.camera.gain_electrons_per_dn / scenario.camera.electrons_per_s
}

/// [`fixed_s`] of a further camera: its first left image has the mean level. `None` if the scenario has no camera of this
/// name; meaningless soon after `cancel` is requested.
pub fn fixed_of_further_s(
    world: &World,
    scenario: &Scenario,
    name: CameraName,
    cancel: Cancel<'_>,
) -> Option<f64> {
    let camera = scenario.camera.further.iter().find(|camera| camera.name == name)?;
    let exposure = render::exposure_of(world, scenario, &Rig::of(camera.rig, camera.image_size), cancel);
    Some(fixed_s(&World { exposure, ..world.clone() }, scenario))
}

/// The automatic exposure (header) of a whole left image, starting from `start_s`; a subframe is metered around `centre`,
/// px, or around the image's centre.
pub fn automatic(
    rates: &Rates,
    camera: &CameraSettings,
    centre: Option<Pixel>,
    start_s: f64,
) -> AutoExposure {
    let auto = &camera.auto_exposure;
    let region = metered(rates, camera, centre);
    let mut time_s = whole_units_s(start_s);
    for tried in 1..=auto.iterations {
        let high_dn = rates.high_dn(region, time_s, camera, auto.pixel_fraction_percent);
        let factor = if high_dn >= number(f64::INFINITY, camera) {
            SATURATED_FACTOR
        } else {
            // Darkness gives no signal: h = bias requests the largest step.
            let wanted = (auto.data_cut_dn - camera.bias_dn) / (high_dn - camera.bias_dn).max(1e-9);
            wanted.clamp(1.0 / LARGEST_FACTOR, LARGEST_FACTOR)
        };
        if (factor - 1.0).abs() < auto.change_percent / 100.0 {
            return AutoExposure { time_s, tried };
        }
        time_s = whole_units_s(time_s * factor);
    }
    AutoExposure { time_s, tried: auto.iterations }
}

/// The part of the left image that the automatic exposure meters; near a border the subframe is moved into the image.
fn metered(rates: &Rates, camera: &CameraSettings, centre: Option<Pixel>) -> Region {
    let [width, height] = [rates.per_s.width(), rates.per_s.height()];
    if camera.exposure != ExposureMode::Subframe {
        return Region { x: 0, y: 0, width, height };
    }
    let side = camera.auto_exposure.subframe_px;
    let [w, h] = [width.min(side), height.min(side)];
    let Some(centre) = centre else {
        return Region { x: (width - w) / 2, y: (height - h) / 2, width: w, height: h };
    };
    let from = |centre_px: f64, side: u32, picture: u32| {
        let first_px = (centre_px - 0.5 * f64::from(side.saturating_sub(1))).round();
        first_px.clamp(0.0, f64::from(picture - side)) as u32
    };
    Region { x: from(centre.x, w, width), y: from(centre.y, h, height), width: w, height: h }
}

/// The nearest exposure time that the camera supports, s.
fn whole_units_s(time_s: f64) -> f64 {
    (time_s / UNIT_S).round().clamp(1.0, (LONGEST_S / UNIT_S).floor()) * UNIT_S
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::camera::Mast;

    const SIDE: u32 = 256;

    fn scenario(mode: ExposureMode) -> Scenario {
        let mut scenario = Scenario::demo();
        scenario.camera.image_size = SIDE;
        scenario.camera.flat_field_residue = 0.0;
        scenario.camera.exposure = mode;
        scenario.camera.auto_exposure.subframe_px = 41;
        scenario
    }

    fn rates(radiance: &GrayImage, scenario: &Scenario) -> Rates {
        let camera = Mast::spirit().left_in_head.downsampled(4);
        Rates::new(radiance, scenario, &camera, Eye::Left, [0, 0])
    }

    /// Ground between 0.15 and 0.25 below a sky that gets brighter from 0.30 at the top of a full frame to 0.45
    /// at its horizon.
    fn ground_below_sky(sky_rows: u32) -> GrayImage {
        GrayImage::from_fn(SIDE, SIDE, |x, y| {
            let ground = 0.15 + 0.1 * ((x * 37 + y * 101) % 64) as f32 / 63.0;
            let to_horizon = (sky_rows.saturating_sub(y)) as f32 / SIDE as f32;
            image::Luma([if y < sky_rows { 0.45 - 0.3 * to_horizon } else { ground }])
        })
    }

    /// Mean DN of the central 41 × 41 px, which show ground.
    fn window_dn(picture: &GrayImage) -> f64 {
        let places = (0..41 * 41).map(|k| (107 + k % 41, 107 + k / 41));
        let sum: f64 = places.map(|(x, y)| f64::from(picture.get_pixel(x, y).0[0])).sum();
        FULL_SCALE_DN * sum / 1681.0
    }

    /// Mean DN of the ground window as the sky fills more and more of the frame.
    fn windows_dn(mode: ExposureMode) -> Vec<f64> {
        let scenario = scenario(mode);
        let of_share = |rows: u32| {
            let rates = rates(&ground_below_sky(rows), &scenario);
            let time_s = automatic(&rates, &scenario.camera, None, 0.43).time_s;
            window_dn(&rates.levels(time_s, &scenario.camera))
        };
        [0, 1, 8, 26, 51, 102].map(of_share).to_vec()
    }

    #[test]
    fn the_sky_in_the_frame_darkens_the_target_unless_a_subframe_is_metered() {
        let full = windows_dn(ExposureMode::FullFrame);
        let sub = windows_dn(ExposureMode::Subframe);
        // One row of 256 is below the fraction of 1 %; from 8 rows on the sky sets the exposure. The cut goes
        // from ground at 0.25 to sky at 0.45: the window falls to 0.25/0.45 = 56 %.
        assert!((full[1] / full[0] - 1.0).abs() < 0.005, "{full:?}");
        for dn in &full[2..] {
            assert!((dn / full[0] - 0.25 / 0.45).abs() < 0.05, "{full:?}");
        }
        assert!(sub.iter().all(|dn| dn == &sub[0]), "{sub:?}");
    }

    #[test]
    fn the_brightest_percent_ends_at_the_data_cut_from_any_start() {
        for mode in [ExposureMode::FullFrame, ExposureMode::Subframe] {
            let scenario = scenario(mode);
            let rates = rates(&ground_below_sky(60), &scenario);
            for start_s in [0.1, 0.43, 2.0, 10.0] {
                let found = automatic(&rates, &scenario.camera, None, start_s);
                let high_dn = rates.high_dn(
                    metered(&rates, &scenario.camera, None),
                    found.time_s,
                    &scenario.camera,
                    1.0,
                );
                assert!((high_dn / 2000.0 - 1.0).abs() < 0.05, "{start_s}: {found:?} {high_dn}");
                let units = found.time_s / UNIT_S;
                assert!((units - units.round()).abs() < 1e-9 && found.tried <= 6);
            }
        }
    }

    #[test]
    fn a_subframe_is_metered_around_its_pixel() {
        let scenario = scenario(ExposureMode::Subframe);
        // The left half of the image is twice as bright as the right one.
        let halves = GrayImage::from_fn(SIDE, SIDE, |x, _| image::Luma([if x < 128 { 0.4 } else { 0.2 }]));
        let rates = rates(&halves, &scenario);
        let time_s = |centre: Option<Pixel>| automatic(&rates, &scenario.camera, centre, 0.43).time_s;
        let [left_s, right_s] = [60.0, 200.0].map(|x| time_s(Some(Pixel::new(x, 90.0))));
        assert!((right_s / left_s - 2.0).abs() < 0.1, "{left_s} {right_s}");
        // The central square extends into both halves: its brightest hundredth is on the left.
        assert!((time_s(None) / left_s - 1.0).abs() < 0.05);
        // A pixel beyond the border meters the square at the border.
        assert_eq!(time_s(Some(Pixel::new(900.0, -50.0))), right_s);
        let region = metered(&rates, &scenario.camera, Some(Pixel::new(60.0, 90.0)));
        assert_eq!((region.x, region.y, region.width, region.height), (40, 70, 41, 41));
    }

    #[test]
    fn one_step_changes_the_time_by_the_ratio_of_cut_and_number() {
        let mut scenario = scenario(ExposureMode::FullFrame);
        scenario.camera.auto_exposure.iterations = 1;
        let even = rates(&GrayImage::from_pixel(SIDE, SIDE, image::Luma([0.2])), &scenario);
        // 600 000 e⁻/s · 0.2 · 0.512 s / 42 = 1462.9 DN above the bias; the cut is 1980 above it.
        let found = automatic(&even, &scenario.camera, None, 0.512);
        assert_eq!(found.time_s, (100.0 * 1980.0 / (120_000.0 * 0.512 / 42.0_f64)).round() * UNIT_S);
        // At 10 s everything is saturated: a quarter; 1 unit gives almost no signal: eight times as long.
        assert!((automatic(&even, &scenario.camera, None, 10.24).time_s - 2.56).abs() < 1e-9);
        assert!((automatic(&even, &scenario.camera, None, UNIT_S).time_s - 8.0 * UNIT_S).abs() < 1e-9);
    }

    #[test]
    fn smear_adds_the_mean_of_the_column_and_dark_grows_with_time() {
        let mut scenario = scenario(ExposureMode::Fixed);
        (scenario.camera.smear_s, scenario.camera.dark_electrons_per_s) = (0.00512, 1000.0);
        let radiance = GrayImage::from_fn(SIDE, SIDE, |x, y| {
            image::Luma([if x == 10 && y < SIDE / 2 { 0.4 } else { 0.0 }])
        });
        let rates = rates(&radiance, &scenario);
        let dn = |x: u32, y: u32| {
            FULL_SCALE_DN * f64::from(rates.levels(0.5, &scenario.camera).get_pixel(x, y).0[0])
        };
        // Dark: 500 e⁻. Smear of column 10: half of its rows at 240 000 e⁻/s for 5.12 ms.
        assert!((dn(9, 200) - (20.0 + 500.0 / 42.0)).abs() < 0.01);
        assert!((dn(10, 200) - dn(9, 200) - 120_000.0 * 0.00512 / 42.0).abs() < 0.01);
        assert!((dn(10, 20) - dn(10, 200) - 240_000.0 * 0.5 / 42.0).abs() < 0.1);
    }
}
