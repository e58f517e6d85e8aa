//! Marks on the score map of a match: its region, the contour of the threshold, prediction, peaks and truth.

use egui::vec2;
use nalgebra::Matrix2;
use sightline_geometry::frames::Pixel;
use sightline_session::step::RunStep;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_vision::image::PixelRect;

use crate::drawing::contour::contour;
use crate::drawing::overlay::{Mark, Overlay, StrokeStyle};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::Canvas;
use crate::theme;

/// Vertical distance of a label from its mark, points.
const WORDS: f32 = 12.0;
/// Height of a line of text, points.
const LINE: f32 = 15.0;

/// The pixels that the template's centre can take: the search window less half a template on each side.
pub(crate) fn region_of(search_window: PixelRect, size: [u32; 2]) -> PixelRect {
    let inset = |whole: u32, inner: u32| (whole.saturating_sub(inner) / 2) as i32;
    PixelRect::new(
        search_window.x + inset(search_window.width, size[0]),
        search_window.y + inset(search_window.height, size[1]),
        size[0],
        size[1],
    )
}

/// The contour of the score map at the threshold.
pub(crate) fn paint_contour(canvas: &Canvas, raster: &Raster, region: PixelRect, threshold: f32) {
    let (x, y) = (f64::from(region.x), f64::from(region.y));
    let stroke = egui::Stroke::new(1.5, theme::strong());
    for segment in contour(raster.values.as_raw(), raster.values.width() as usize, threshold) {
        let ends = segment.map(|[dx, dy]| canvas.transform.to_screen(Pixel::new(x + dx, y + dy)));
        canvas.painter.line_segment(ends, stroke);
    }
}

/// Paints prediction, peaks and truth on the score map.
pub(crate) fn paint_marks(canvas: &Canvas, trace: &RunStep, matched: &TemplateMatch, run: egui::Color32) {
    let pointing = &trace.point_mast;
    let predicted = pointing.predicted_left.map(|pixel| (pixel, pointing.predicted_covariance_px2));
    let truth = trace.truth.as_ref().and_then(|t| t.left_pixel);
    paint_peaks(canvas, &Marked { predicted, matched, truth, colour: run });
}

/// The marks on a score map.
pub(crate) struct Marked<'a> {
    /// The prediction with its covariance, px and px².
    pub predicted: Option<(Pixel, Option<Matrix2<f64>>)>,
    /// The match.
    pub matched: &'a TemplateMatch,
    /// The truth, px.
    pub truth: Option<Pixel>,
    /// The colour of the match.
    pub colour: egui::Color32,
}

/// Paints prediction, peaks and truth.
pub(crate) fn paint_peaks(canvas: &Canvas, marked: &Marked<'_>) {
    let (matched, run) = (marked.matched, marked.colour);
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    if let Some((pixel, covariance)) = marked.predicted {
        if let Some(covariance) = &covariance {
            overlay.ellipse(pixel, covariance, 3.0, theme::prediction(), StrokeStyle::Dotted);
        }
        overlay.mark(pixel, Mark::Cross, theme::prediction());
    }
    if let Some(second) = &matched.second_peak {
        overlay.mark(second.pixel, Mark::Square, theme::strong());
        let words = format!("second peak: {:.2} of best, {:.0} px away", second.ratio, second.distance_px);
        overlay.words(second.pixel, vec2(12.0, second_offset(canvas, matched)), &words, theme::strong());
    }
    let peak = &matched.peak;
    overlay.ellipse(peak.pixel, &matched.covariance_px2, 3.0, run, StrokeStyle::Solid);
    overlay.mark(peak.pixel, Mark::Ring, run);
    overlay.words(peak.pixel, vec2(12.0, -WORDS), &format!("peak {:.3}", peak.score), theme::strong());
    if let Some(pixel) = marked.truth {
        overlay.mark(pixel, Mark::Plus, theme::truth());
    }
}

/// Vertical offset of the second peak's label, which keeps it clear of the best peak's label, points.
fn second_offset(canvas: &Canvas, matched: &TemplateMatch) -> f32 {
    let y = |pixel: Pixel| canvas.transform.to_screen(pixel).y;
    let second = matched.second_peak.as_ref().map_or(0.0, |second| y(second.pixel));
    clear_of(second, y(matched.peak.pixel) - WORDS)
}

/// Offset of a label at `at` that keeps it one line from the label at `other`: below the mark, else above it.
fn clear_of(at: f32, other: f32) -> f32 {
    if (at + WORDS - other).abs() < LINE { -WORDS - LINE } else { WORDS }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_words_of_two_peaks_are_a_line_apart() {
        for second in (0..60).map(|k| 100.0 + k as f32) {
            let peak = 130.0 - WORDS;
            assert!((second + clear_of(second, peak) - peak).abs() >= LINE, "{second}");
        }
    }

    #[test]
    fn the_region_of_the_scores_is_the_window_less_half_a_template() {
        let window = PixelRect::new(100, 50, 143, 143);
        assert_eq!(region_of(window, [123, 123]), PixelRect::new(110, 60, 123, 123));
    }
}
