//! Epipolar curves: the line of sight of one camera projected into the image of the other, with ticks at round ranges.
//!
//! Pixel p at range R is the point P(R) = C + R ê(p), in the rover frame, m; it projects to π(P(R)) in the other camera.
//! Lens distortion bends the line to a curve (R73). It is sampled at equal steps of inverse range 1/R, in which disparity
//! is linear.

use egui::{Color32, vec2};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Ray};

use crate::drawing::overlay::{Overlay, StrokeStyle};
use crate::drawing::view2d::Canvas;

/// Ranges with a tick, m.
const TICKS_M: [f64; 12] = [0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 50.0, 100.0];

/// Nearest and farthest range of a curve, m.
const CURVE_M: (f64, f64) = (0.4, 1000.0);

/// Samples of a curve.
const SAMPLES: usize = 160;

/// Two ticks are at least this far apart, points.
const TICK_GAP: f32 = 34.0;

/// The epipolar curve of a pixel of one camera in the image of the other.
pub(crate) struct Curve<'a> {
    /// The line of sight; the lens distortion is removed once, not at every range.
    ray: Ray,
    to: &'a Camera,
}

impl<'a> Curve<'a> {
    /// The curve of a pixel of `from` in the image of `to`; `None` if the lens distortion cannot be inverted.
    pub(crate) fn new(from: &Camera, to: &'a Camera, pixel: Pixel) -> Option<Self> {
        Some(Self { ray: from.ray(pixel)?, to })
    }

    /// The pixel of the curve at a range, m; `None` behind the camera and far outside its image, where the lens model is
    /// not valid.
    pub(crate) fn at(&self, range_m: f64) -> Option<Pixel> {
        let pixel = self.to.project(&self.ray.at(range_m))?;
        let (width, height) = (f64::from(self.to.width()), f64::from(self.to.height()));
        let is_near = (-width..2.0 * width).contains(&pixel.x) && (-height..2.0 * height).contains(&pixel.y);
        is_near.then_some(pixel)
    }

    /// The pixels of the curve with their ranges, m, the far end first.
    fn points(&self) -> impl Iterator<Item = (f64, Pixel)> {
        ranges().filter_map(|range_m| Some((range_m, self.at(range_m)?)))
    }

    /// The range, m, of the curve's point nearest to a pixel, and its distance from the pixel, px.
    pub(crate) fn nearest(&self, pixel: Pixel) -> Option<(f64, f64)> {
        let points: Vec<(f64, Pixel)> = self.points().collect();
        let between = |pair: &[(f64, Pixel)]| {
            let [(far_m, a), (near_m, b)] = [pair[0], pair[1]];
            let (dx, dy) = (b.x - a.x, b.y - a.y);
            let along = ((pixel.x - a.x) * dx + (pixel.y - a.y) * dy) / (dx * dx + dy * dy).max(1e-12);
            let along = along.clamp(0.0, 1.0);
            let inverse = (1.0 - along) / far_m + along / near_m;
            (1.0 / inverse, pixel.distance(a.offset(along * dx, along * dy)))
        };
        points.windows(2).map(between).min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Paints the curve with its ticks.
    pub(crate) fn paint(&self, canvas: &Canvas, colour: Color32, line: StrokeStyle) {
        let overlay = Overlay::new(&canvas.painter, &canvas.transform);
        let whole: Vec<Pixel> = self.points().map(|(_, pixel)| pixel).collect();
        overlay.line(&whole, colour, line);
        self.paint_ticks(canvas, &overlay, colour);
    }

    /// Ticks across the curve with their range; ticks that would crowd are omitted.
    pub(crate) fn paint_ticks(&self, canvas: &Canvas, overlay: &Overlay<'_>, colour: Color32) {
        let mut last: Option<egui::Pos2> = None;
        for range_m in TICKS_M {
            let (Some(at), Some(beyond)) = (self.at(range_m), self.at(range_m * 1.01)) else { continue };
            let screen = canvas.transform.to_screen(at);
            if !canvas.transform.rect.contains(screen)
                || last.is_some_and(|last| last.distance(screen) < TICK_GAP)
            {
                continue;
            }
            let length = at.distance(beyond).max(1e-9);
            let across = (-(beyond.y - at.y) / length, (beyond.x - at.x) / length);
            let reach = 5.0 / canvas.transform.scale;
            let ends = [-reach, reach].map(|t| at.offset(across.0 * t, across.1 * t));
            overlay.line(&ends, colour, StrokeStyle::Solid);
            overlay.words(at, vec2(-8.0, 15.0), &format!("{range_m}"), colour);
            last = Some(screen);
        }
    }
}

/// Ranges at equal steps of inverse range, far end first.
fn ranges() -> impl Iterator<Item = f64> {
    let (near, far) = (1.0 / CURVE_M.0, 1.0 / CURVE_M.1);
    (0..SAMPLES).map(move |i| 1.0 / (far + (near - far) * i as f64 / (SAMPLES - 1) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::camera::Mast;

    #[test]
    fn the_curve_is_sampled_from_far_to_near() {
        let all: Vec<f64> = ranges().collect();
        assert!((all[0] - CURVE_M.1).abs() < 1e-6 && (all[SAMPLES - 1] - CURVE_M.0).abs() < 1e-9);
        assert!(all.windows(2).all(|pair| pair[0] > pair[1]));
    }

    #[test]
    fn the_curve_of_two_parallel_eyes_ends_at_the_same_pixel_far_away() {
        let mast = Mast::spirit();
        let pixel = mast.left_in_head.centre_pixel();
        let curve = Curve::new(&mast.left_in_head, &mast.right_in_head, pixel).unwrap();
        assert!(curve.at(1000.0).unwrap().x > curve.at(2.0).unwrap().x, "nearer points lie further left");
    }

    #[test]
    fn a_pixel_near_the_curve_is_told_the_range_of_its_point() {
        let mast = Mast::spirit();
        let (from, to) = (&mast.left_in_head, &mast.right_in_head);
        let curve = Curve::new(from, to, Pixel::new(600.0, 700.0)).unwrap();
        for range_m in [1.3, 2.7, 6.0, 14.0] {
            let on_it = curve.at(range_m).unwrap();
            let (found_m, off_px) = curve.nearest(on_it.offset(0.0, 3.0)).unwrap();
            assert!((found_m / range_m - 1.0).abs() < 0.01, "{found_m} m for {range_m} m");
            assert!((off_px - 3.0).abs() < 0.05, "{off_px} px");
        }
    }

    #[test]
    fn from_the_right_eye_the_curve_leads_back_to_the_left_pixel() {
        let mast = Mast::spirit();
        let (left, right) = (&mast.left_in_head, &mast.right_in_head);
        let pixel = Pixel::new(400.0, 800.0);
        let there = Curve::new(left, right, pixel).unwrap().at(3.0).unwrap();
        let (_, off_px) = Curve::new(right, left, there).unwrap().nearest(pixel).unwrap();
        assert!(off_px < 0.02, "{off_px} px");
    }
}
