//! What is painted on match scores: the region that they cover, the line of the threshold, prediction, peaks and truth.

use egui::vec2;
use nalgebra::Matrix2;
use sightline_geometry::frames::Pixel;
use sightline_session::step::RunStep;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_vision::image::PixelRect;

use crate::drawing::contour::contour;
use crate::drawing::overlay::{Line, Mark, Overlay};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::Canvas;
use crate::theme;

/// The pixels on which the template's centre lay: the search window less half a template on each side.
pub(crate) fn region_of(search_window: PixelRect, size: [u32; 2]) -> PixelRect {
    let inset = |whole: u32, inner: u32| (whole.saturating_sub(inner) / 2) as i32;
    PixelRect::new(
        search_window.x + inset(search_window.width, size[0]),
        search_window.y + inset(search_window.height, size[1]),
        size[0],
        size[1],
    )
}

/// The line along which the scores have the threshold's height.
pub(crate) fn paint_contour(canvas: &Canvas, raster: &Raster, region: PixelRect, threshold: f32) {
    let (x, y) = (f64::from(region.x), f64::from(region.y));
    let stroke = egui::Stroke::new(1.5, theme::strong());
    for segment in contour(raster.values.as_raw(), raster.values.width() as usize, threshold) {
        let ends = segment.map(|[dx, dy]| canvas.transform.to_screen(Pixel::new(x + dx, y + dy)));
        canvas.painter.line_segment(ends, stroke);
    }
}

/// Prediction, peaks and truth on the scores.
pub(crate) fn paint_marks(canvas: &Canvas, trace: &RunStep, matched: &TemplateMatch, run: egui::Color32) {
    let pointing = &trace.point_mast;
    let predicted = pointing.predicted_left.map(|pixel| (pixel, pointing.predicted_covariance_px2));
    let truth = trace.truth.as_ref().and_then(|t| t.left_pixel);
    paint_peaks(canvas, &Marked { predicted, matched, truth, colour: run });
}

/// What is marked on scores.
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

/// Prediction, peaks and truth.
pub(crate) fn paint_peaks(canvas: &Canvas, marked: &Marked<'_>) {
    let (matched, run) = (marked.matched, marked.colour);
    let overlay = Overlay::new(&canvas.painter, &canvas.transform);
    if let Some((pixel, covariance)) = marked.predicted {
        if let Some(covariance) = &covariance {
            overlay.ellipse(pixel, covariance, 3.0, theme::prediction(), Line::Dotted);
        }
        overlay.mark(pixel, Mark::Cross, theme::prediction());
    }
    if let Some(second) = &matched.second_peak {
        overlay.mark(second.pixel, Mark::Square, theme::strong());
        let words = format!("2nd: {:.0} % at {:.0} px", second.ratio * 100.0, second.distance_px);
        overlay.words(second.pixel, vec2(12.0, 12.0), &words, theme::strong());
    }
    let peak = &matched.peak;
    overlay.ellipse(peak.pixel, &matched.covariance_px2, 3.0, run, Line::Solid);
    overlay.mark(peak.pixel, Mark::Ring, run);
    overlay.words(peak.pixel, vec2(12.0, -12.0), &format!("peak {:.3}", peak.score), theme::strong());
    if let Some(pixel) = marked.truth {
        overlay.mark(pixel, Mark::Plus, theme::truth());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_region_of_the_scores_is_the_window_less_half_a_template() {
        let window = PixelRect::new(100, 50, 143, 143);
        assert_eq!(region_of(window, [123, 123]), PixelRect::new(110, 60, 123, 123));
    }
}
