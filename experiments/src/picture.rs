//! What a picture looks like in numbers: levels, local contrast and spectrum, of simulated and real frames alike.
//!
//! * **Levels**: percentiles and a histogram, over the mean, so that exposure and gain drop out.
//! * **Local contrast**: standard deviation over mean in windows of 21 × 21 px, the template of the trackers, 10 px apart.
//! * **Spectrum**: squares of 64 × 64 px, mean removed, tapered by Hann's window, transformed; the power is averaged over
//!   squares and rings of equal frequency; a line through its logarithms between 1/32 and 1/4 cycles/px has the
//!   slope −β. Lower frequencies belong to the taper, higher ones to blur, noise and compression.
//!
//! Only whole windows and squares without invalid pixels (NaN) count, so a mask is a picture with NaN.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | f | `cycles_per_px` | 1/px |
//! | β | `spectrum_slope` | – |
//!
//! Units: px; levels in fractions of full scale. Pure computation. Source: ours.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use sightline_geometry::estimate::quantile::quantile_of_sorted;
use sightline_vision::image::{GrayImage, PixelRect};

/// Side of the windows of local contrast, px.
const WINDOW_PX: u32 = 21;
/// Distance of neighbouring windows, px.
const STRIDE_PX: usize = 10;
/// Side of the squares that are transformed, px.
const SQUARE_PX: usize = 64;
/// Bins of the histogram, over 0 to 2 of the mean.
const BINS: usize = 40;

/// Some points of a distribution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Percentiles {
    /// 1 % lie below.
    pub p1: f64,
    /// 10 % lie below.
    pub p10: f64,
    /// Half lie below.
    pub p50: f64,
    /// 90 % lie below.
    pub p90: f64,
    /// 99 % lie below.
    pub p99: f64,
}

/// The mean power of a ring of frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct SpectrumRow {
    /// Frequency, cycles per pixel.
    pub cycles_per_px: f64,
    /// Power per coefficient, over the squared mean level.
    pub power: f64,
}

/// A picture, or a part of one, in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PictureReport {
    /// Valid pixels.
    pub pixels: usize,
    /// Mean level, fraction of full scale.
    pub mean: f64,
    /// Standard deviation over the mean.
    pub contrast: f64,
    /// Levels over the mean.
    pub levels: Percentiles,
    /// Parts of the pixels in 40 bins of levels over the mean, from 0 to 2; brighter ones count in the last.
    pub histogram: Vec<f64>,
    /// Standard deviation over mean of windows; nothing where no whole window is valid.
    pub local_contrast: Option<Percentiles>,
    /// β; nothing where no whole square is valid.
    pub spectrum_slope: Option<f64>,
    /// Power by frequency.
    pub spectrum: Vec<SpectrumRow>,
}

/// Measures the part of a picture in a rectangle; nothing where no pixel in it is valid or all are black.
pub(crate) fn picture_report(image: &GrayImage, rectangle: &PixelRect) -> Option<PictureReport> {
    let rectangle = rectangle.intersect(&PixelRect::whole(image.width(), image.height()))?;
    let mut levels: Vec<f64> = values(image, &rectangle).filter(|v| v.is_finite()).collect();
    let mean = levels.iter().sum::<f64>() / levels.len() as f64;
    if levels.is_empty() || mean <= 0.0 {
        return None;
    }
    levels.iter_mut().for_each(|level| *level /= mean);
    let mut histogram = vec![0.0; BINS];
    for level in &levels {
        let bin = (level * BINS as f64 / 2.0).max(0.0) as usize;
        histogram[bin.min(BINS - 1)] += 1.0 / levels.len() as f64;
    }
    let variance = levels.iter().map(|level| (level - 1.0).powi(2)).sum::<f64>() / levels.len() as f64;
    let spectrum = spectrum(image, &rectangle, mean);
    Some(PictureReport {
        pixels: levels.len(),
        mean,
        contrast: variance.sqrt(),
        levels: percentiles(&mut levels)?,
        histogram,
        local_contrast: percentiles(&mut local_contrasts(image, &rectangle)),
        spectrum_slope: slope(&spectrum),
        spectrum,
    })
}

/// Levels of a rectangle inside the picture, row by row.
fn values<'a>(image: &'a GrayImage, r: &PixelRect) -> impl Iterator<Item = f64> + 'a {
    let [columns, rows] = [(r.x, r.width), (r.y, r.height)].map(|(first, length)| span(first, length));
    rows.flat_map(move |y| columns.clone().map(move |x| f64::from(image.get_pixel(x, y).0[0])))
}

/// The pixels of a side that starts inside a picture.
fn span(first: i32, length: u32) -> std::ops::Range<u32> {
    first.unsigned_abs()..first.unsigned_abs() + length
}

/// The squares of a side inside a rectangle whose corners lie a stride apart.
fn squares(r: &PixelRect, side: u32, stride: usize) -> impl Iterator<Item = PixelRect> {
    let starts = move |first: i32, length: u32| {
        (0..(length + 1).saturating_sub(side)).step_by(stride).map(move |offset| first + offset as i32)
    };
    let r = *r;
    starts(r.y, r.height)
        .flat_map(move |y| starts(r.x, r.width).map(move |x| PixelRect::new(x, y, side, side)))
}

fn percentiles(values: &mut [f64]) -> Option<Percentiles> {
    values.sort_by(f64::total_cmp);
    let at = |share| quantile_of_sorted(values, share);
    Some(Percentiles { p1: at(0.01)?, p10: at(0.10)?, p50: at(0.50)?, p90: at(0.90)?, p99: at(0.99)? })
}

fn local_contrasts(image: &GrayImage, rectangle: &PixelRect) -> Vec<f64> {
    let contrast = |window: PixelRect| {
        let count = f64::from(window.width * window.height);
        let (sum, squares) = values(image, &window).fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
        let mean = sum / count;
        (mean > 0.0).then(|| (squares / count - mean * mean).max(0.0).sqrt() / mean)
    };
    squares(rectangle, WINDOW_PX, STRIDE_PX).filter_map(contrast).collect()
}

/// The power of the squares of a rectangle by frequency, over the squared mean.
fn spectrum(image: &GrayImage, rectangle: &PixelRect, mean: f64) -> Vec<SpectrumRow> {
    let half = SQUARE_PX / 2;
    let (mut power, mut count) = (vec![0.0; half], vec![0.0; half]);
    for square in squares(rectangle, SQUARE_PX as u32, SQUARE_PX) {
        let levels: Vec<f64> = values(image, &square).map(|level| level / mean).collect();
        if !levels.iter().all(|level| level.is_finite()) {
            continue;
        }
        for (index, coefficient) in transform(&levels).into_iter().enumerate() {
            let signed = |k: usize| if k > half { k as f64 - SQUARE_PX as f64 } else { k as f64 };
            let ring = signed(index % SQUARE_PX).hypot(signed(index / SQUARE_PX)).round() as usize;
            if (1..half).contains(&ring) {
                power[ring] += coefficient[0].powi(2) + coefficient[1].powi(2);
                count[ring] += 1.0;
            }
        }
    }
    let row = |ring: usize| SpectrumRow {
        cycles_per_px: ring as f64 / SQUARE_PX as f64,
        power: power[ring] / count[ring],
    };
    (1..half).filter(|ring| count[*ring] > 0.0).map(row).collect()
}

/// The discrete Fourier transform of a tapered square without its mean: real and imaginary parts.
fn transform(levels: &[f64]) -> Vec<[f64; 2]> {
    let n = SQUARE_PX;
    let mean = levels.iter().sum::<f64>() / levels.len() as f64;
    let taper = |k: usize| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / n as f64).cos();
    let turns: Vec<[f64; 2]> =
        (0..n).map(|k| TAU * k as f64 / n as f64).map(|a| [a.cos(), -a.sin()]).collect();
    let mut table: Vec<[f64; 2]> = levels
        .iter()
        .enumerate()
        .map(|(k, level)| [(level - mean) * taper(k % n) * taper(k / n), 0.0])
        .collect();
    // Rows, then columns: each pass transforms the rows and turns the square over.
    for _ in 0..2 {
        let mut turned = vec![[0.0; 2]; n * n];
        for (row, line) in table.chunks(n).enumerate() {
            for frequency in 0..n {
                turned[frequency * n + row] =
                    line.iter().enumerate().fold([0.0; 2], |[re, im], (k, [a, b])| {
                        let [cos, sin] = turns[frequency * k % n];
                        [re + a * cos - b * sin, im + a * sin + b * cos]
                    });
            }
        }
        table = turned;
    }
    table
}

/// β of a line through the logarithms of power and frequency.
fn slope(spectrum: &[SpectrumRow]) -> Option<f64> {
    let points: Vec<[f64; 2]> = spectrum
        .iter()
        .filter(|row| (1.0 / 32.0..=0.25).contains(&row.cycles_per_px) && row.power > 0.0)
        .map(|row| [row.cycles_per_px.ln(), row.power.ln()])
        .collect();
    let count = points.len() as f64;
    let [mx, my] = points.iter().fold([0.0; 2], |[a, b], [x, y]| [a + x / count, b + y / count]);
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|[x, y]| f(x - mx, y - my)).sum::<f64>();
    (points.len() > 2).then(|| -sum(&|x, y| x * y) / sum(&|x, _| x * x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_world::ground::texture::{OctaveSettings, Octaves, mix};

    fn picture(side: u32, level: impl Fn(u32, u32) -> f32) -> (GrayImage, PixelRect) {
        let rectangle = PixelRect::whole(side, side);
        (GrayImage::from_fn(side, side, |x, y| image::Luma([level(x, y)])), rectangle)
    }

    #[test]
    fn white_noise_has_a_flat_spectrum_and_its_contrast() {
        let (image, all) = picture(512, |x, y| {
            let unit = (mix(u64::from(x) << 32 | u64::from(y)) >> 40) as f32 / (1u32 << 24) as f32;
            0.4 + 0.1 * (unit - 0.5)
        });
        let report = picture_report(&image, &all).unwrap();
        // A uniform number of width 0.1 has the standard deviation 0.1/√12.
        let contrast = 0.1 / 12f64.sqrt() / 0.4;
        assert!((report.contrast / contrast - 1.0).abs() < 0.01, "{}", report.contrast);
        assert!((report.local_contrast.unwrap().p50 / contrast - 1.0).abs() < 0.01);
        assert!(report.spectrum_slope.unwrap().abs() < 0.06, "{:?}", report.spectrum_slope);
        // Power per coefficient: variance, times the pixels, times the taper's mean square (3/8)².
        let power = contrast * contrast * 4096.0 * (3.0f64 / 8.0).powi(2);
        assert!(
            (report.spectrum[10].power / power - 1.0).abs() < 0.05,
            "{}",
            report.spectrum[10].power / power
        );
    }

    #[test]
    fn octaves_of_a_stated_slope_have_it() {
        for wanted in [2.0, 2.8] {
            let settings = OctaveSettings {
                longest_m: 120.0,
                shortest_m: 0.9,
                ratio: 1.5,
                albedo_exponent: 0.5 * (wanted - 2.0),
                albedo_std: 0.1,
                slope_std: 0.0,
            };
            let noise = Octaves::<2>::new(&settings, 3);
            let (image, all) =
                picture(512, |x, y| 0.5 * (1.0 + noise.at([f64::from(x), f64::from(y)], 1e-3).albedo));
            let report = picture_report(&image, &all).unwrap();
            assert!(
                (report.spectrum_slope.unwrap() - wanted).abs() < 0.25,
                "{wanted} {:?}",
                report.spectrum_slope
            );
        }
    }

    #[test]
    fn invalid_pixels_and_what_lies_outside_do_not_count() {
        let level = |x: u32, y: u32| if (x + y).is_multiple_of(2) { 0.3 } else { 0.5 };
        let (plain, all) = picture(64, level);
        let (wide, _) = picture(128, |x, y| if x < 64 && y < 64 { level(x, y) } else { f32::NAN });
        let everything = PixelRect::whole(500, 500);
        let (a, b) = (picture_report(&plain, &all).unwrap(), picture_report(&wide, &everything).unwrap());
        assert_eq!((a.pixels, a.mean, &a.histogram), (b.pixels, b.mean, &b.histogram));
        assert_eq!(a.spectrum, b.spectrum);
        assert!((a.contrast - 0.25).abs() < 1e-6 && a.local_contrast.is_some());
        assert_eq!(picture_report(&wide, &PixelRect::new(70, 70, 9, 9)), None);
    }

    #[test]
    fn simulated_soil_looks_like_that_of_opportunity_and_spirit() {
        use sightline_world;
        use sightline_world::{Eye, Region, Scenario, World};
        let scenario = Scenario::demo();
        let world = World::new(&scenario);
        let index = sightline_world::index(&scenario, &world).unwrap();
        let camera = sightline_world::true_camera_in_site(&index.stops[8], Eye::Left).unwrap();
        // Soil with pebbles, 6 m away, beside the drive.
        let region = Region { x: 100, y: 700, width: 256, height: 256 };
        let stop = std::sync::atomic::AtomicBool::new(false);
        let image = sightline_world::clean_radiance(&world, &scenario, &camera, region, &stop).unwrap();
        let report = picture_report(&image, &PixelRect::whole(256, 256)).unwrap();
        // Medians of five squares of 256 px of soil in each of six real frames.
        let local = report.local_contrast.unwrap();
        assert!((0.037..0.085).contains(&local.p50), "{local:?}");
        assert!((0.06..0.18).contains(&report.contrast), "{}", report.contrast);
        let slope = report.spectrum_slope.unwrap();
        assert!((1.7..2.8).contains(&slope), "{slope}");
    }
}
