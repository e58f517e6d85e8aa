//! First stages for comparison: pyramidal Lucas–Kanade from the prediction (R217, R218).
//!
//! The window has the template's side at every pyramid level, so that coarse levels cover more of the surroundings,
//! and starts at the predicted pixel. Gain and offset are not estimated, as in the trackers of the sources. A descent
//! that leaves the search window is no match. `judge` uses the normalised correlation at the resulting position.

use nalgebra::Matrix2;

use super::failure::TemplateFailure;
pub use super::first_match::Descent;
use super::first_match::FirstMatch;
use super::scale_roll::Prepared;
use super::settings::{FirstStage, TemplateSettings};
use sightline_geometry::frames::Pixel;
use sightline_vision::correlate::lucas_kanade::{Descend, Footprint, Placed, descend};
use sightline_vision::correlate::peak::Peak;
use sightline_vision::correlate::{Surface, zncc};
use sightline_vision::image::{GrayImage, PixelRect, patch};

/// Descends from the prediction.
///
/// # Errors
/// Why there is no match.
pub(super) fn first_match(
    prepared: &Prepared<'_>,
    image: &GrayImage,
    search_window: PixelRect,
    predicted: Pixel,
    settings: &TemplateSettings,
) -> Result<FirstMatch, TemplateFailure> {
    let size = settings.template_size_px;
    let (footprint, levels) = (Footprint::SamePixels(size), settings.klt_levels as usize);
    let wide = footprint.wide_px(levels);
    let options = Descend {
        affine: settings.first_stage == FirstStage::KltAffine,
        photometric: false,
        iterations: settings.descent_iterations,
        stop_px: settings.descent_stop_px,
    };
    let (part, cut) = around(image, predicted, search_window.width.max(search_window.height) + wide)
        .ok_or(TemplateFailure::PredictionOutside)?;
    let start = Placed::at(predicted.offset(-f64::from(cut[0]), -f64::from(cut[1])));
    let found = descend(&prepared.window(wide), footprint, levels, &part, start, &options)?;
    let placed = Placed { centre: found.centre.offset(f64::from(cut[0]), f64::from(cut[1])), ..found };
    if !search_window.contains(placed.centre) {
        return Err(TemplateFailure::DescentLeftWindow);
    }
    let score = |centre: Pixel| {
        let window = Placed { centre, ..placed }.window(image, size, settings.kernel);
        zncc(&prepared.rolled, &window).map_or(0.0, f64::from)
    };
    let integer = [placed.centre.x.round() as i32, placed.centre.y.round() as i32];
    let peak = Peak {
        pixel: placed.centre,
        score: score(placed.centre),
        integer,
        integer_score: score(Pixel::new(f64::from(integer[0]), f64::from(integer[1]))),
        covariance_px2: Matrix2::zeros(),
        at_edge: false,
    };
    let record = Descent { iterations: placed.iterations, residual: placed.residual, map: placed.map };
    Ok(FirstMatch {
        search_window,
        positions: 0,
        surface: Surface::default(),
        peak,
        coarse: None,
        descent: Some((record, placed)),
        weighed: Vec::new(),
    })
}

/// Crops the part of an image about a pixel; also returns the first pixel of that part.
pub(super) fn around(image: &GrayImage, centre: Pixel, side: u32) -> Option<(GrayImage, [i32; 2])> {
    let part =
        PixelRect::centred(centre, side).intersect(&PixelRect::whole(image.width(), image.height()))?;
    Some((patch::crop(image, &part), [part.x, part.y]))
}
