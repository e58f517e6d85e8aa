//! The marks of a step over its two images: one list, which the viewer, the figures of reports and Rerun recordings draw
//! in their own styles.

use nalgebra::{Matrix2, Vector2};
use sightline_geometry::frames::Pixel;
use sightline_track::locate::features::rows::moved_covariance_px2;
use sightline_track::locate::shape_tracker::rows::{basin, registered_covariance_px2};
use sightline_vision::image::PixelRect;

use crate::step::RunStep;

/// The meaning of a mark; it determines colour and stroke.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MarkName {
    /// Left: the stored part of the image.
    Subframe,
    /// Left: the search window of the template.
    SearchWindow,
    /// Left: the 3σ gate of the prediction.
    PredictionGate,
    /// Left: the prediction.
    PredictedLeft,
    /// Left: the rock's half width about the prediction; with a larger error a registration may converge elsewhere (R155).
    Basin,
    /// Left: the template's window after scale and roll, centred on the prediction.
    PredictedWindow,
    /// Left: the window that was matched with the template.
    MatchedWindow,
    /// Left: the window of the reference image, transformed to the match by scale and roll.
    CarriedWindow,
    /// Left: the match of the template.
    Peak,
    /// Left: the second-best match of the template.
    SecondPeak,
    /// Left: the error of the located position, bias included; at 1σ, 2σ and 3σ for features or shape (R180), else at 3σ.
    LocatedError,
    /// Left: the located position.
    LocatedLeft,
    /// Left: the truth.
    TrueLeft,
    /// Right: the searched part of the epipolar curve.
    Curve,
    /// Right: the prediction.
    PredictedRight,
    /// Right: the 3σ error of the stereo match.
    StereoError,
    /// Right: the stereo match of the template.
    StereoMatch,
    /// Right: the located position.
    LocatedRight,
}

impl MarkName {
    /// Whether the mark is in the left image.
    pub const fn is_left(self) -> bool {
        !matches!(
            self,
            Self::Curve | Self::PredictedRight | Self::StereoError | Self::StereoMatch | Self::LocatedRight
        )
    }
}

/// A shape in an image, px; (0, 0) is the centre of the first pixel.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A position.
    Point(Pixel),
    /// Contours of a covariance.
    Ellipse {
        /// Their centre.
        centre: Pixel,
        /// The covariance, px².
        covariance_px2: Matrix2<f64>,
        /// The multiples of σ, one for each contour.
        sigmas: &'static [f64],
    },
    /// A closed polygon.
    Outline(Vec<Pixel>),
    /// A rectangle of whole pixels.
    Rect(PixelRect),
    /// A polyline; each position with its score, if it has one.
    Curve(Vec<(Pixel, Option<f32>)>),
}

/// A mark over an image of a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Its meaning.
    pub name: MarkName,
    /// Its shape.
    pub shape: Shape,
}

/// The marks of a step, in painting order. The windows of the template have `template_size_px` px a side.
pub fn marks(step: &RunStep, template_size_px: u32) -> Vec<Mark> {
    let mut list = List(Vec::new());
    let pointing = &step.point_mast;
    let evidence = step.template();
    let matched = evidence.and_then(|e| e.match_template.as_ref());
    let prepared = evidence.and_then(|e| e.scale_roll.as_ref());
    let stereo = evidence.and_then(|e| e.point_stereo.as_ref());
    let window = |at: Pixel, map: &Matrix2<f64>| Shape::Outline(square(at, template_size_px, map).to_vec());

    list.add(MarkName::Subframe, step.capture().and_then(|c| c.subframe).map(Shape::Rect));
    list.add(MarkName::SearchWindow, matched.map(|m| Shape::Rect(m.search_window)));
    if let Some(predicted) = pointing.predicted_left.filter(|_| step.prediction().is_some()) {
        let gate = pointing
            .predicted_covariance_px2
            .map(|covariance_px2| ellipse(predicted, covariance_px2, &[3.0]));
        list.add(MarkName::PredictionGate, gate);
        list.add(MarkName::PredictedLeft, Some(Shape::Point(predicted)));
        list.add(MarkName::PredictedWindow, prepared.map(|p| window(predicted, &p.prepared_from_template())));
    }
    list.add(MarkName::Basin, basin_of(step).map(|(outline, _)| Shape::Outline(outline)));
    list.add(MarkName::MatchedWindow, matched.map(|m| window(m.pixel, &Matrix2::identity())));
    let carried = matched.zip(prepared).map(|(m, p)| window(m.pixel, &p.prepared_from_template()));
    list.add(MarkName::CarriedWindow, carried);
    list.add(MarkName::Peak, matched.map(|m| Shape::Point(m.pixel)));
    list.add(MarkName::SecondPeak, matched.and_then(|m| Some(Shape::Point(m.second_peak.as_ref()?.pixel))));
    if let Some((located, pixel)) = step.located().and_then(|l| Some((l, l.left_pixel?))) {
        let moved = moved_covariance_px2(located, &pointing.left)
            .or_else(|| registered_covariance_px2(located, &pointing.left));
        let error = match moved {
            Some(moved) => ellipse(pixel, moved, &[1.0, 2.0, 3.0]),
            None => ellipse(pixel, located.left_error.mean_square_px2(), &[3.0]),
        };
        list.add(MarkName::LocatedError, Some(error));
        list.add(MarkName::LocatedLeft, Some(Shape::Point(pixel)));
    }
    let truth = step.truth.as_ref().and_then(|truth| truth.left_pixel);
    list.add(MarkName::TrueLeft, truth.map(Shape::Point));

    let curve =
        stereo.map(|s| Shape::Curve(s.curve.iter().map(|point| (point.pixel, point.score)).collect()));
    list.add(MarkName::Curve, curve);
    let predicted = pointing.predicted_right.filter(|_| step.prediction().is_some());
    list.add(MarkName::PredictedRight, predicted.map(Shape::Point));
    list.add(MarkName::StereoError, stereo.map(|s| ellipse(s.right_pixel, s.covariance_px2, &[3.0])));
    list.add(MarkName::StereoMatch, stereo.map(|s| Shape::Point(s.right_pixel)));
    list.add(MarkName::LocatedRight, step.located().and_then(|l| l.right_pixel).map(Shape::Point));
    list.0
}

/// The outline of the rock's half width about the prediction, px, and that half width, m.
pub fn basin_of(step: &RunStep) -> Option<(Vec<Pixel>, f64)> {
    let half_width_m = step.shape()?.registration.as_ref()?.half_width_m;
    let predicted = &step.prediction()?.position_in_rover;
    Some((basin(predicted, half_width_m, &step.point_mast.left), half_width_m))
        .filter(|(outline, _)| !outline.is_empty())
}

/// The corners of a square window of `side_px` whole pixels about `centre`, transformed by `image_from_window`.
pub fn square(centre: Pixel, side_px: u32, image_from_window: &Matrix2<f64>) -> [Pixel; 4] {
    let half = f64::from(side_px) / 2.0;
    [(-half, -half), (half, -half), (half, half), (-half, half)].map(|(x, y)| {
        let corner = image_from_window * Vector2::new(x, y);
        centre.offset(corner.x, corner.y)
    })
}

fn ellipse(centre: Pixel, covariance_px2: Matrix2<f64>, sigmas: &'static [f64]) -> Shape {
    Shape::Ellipse { centre, covariance_px2, sigmas }
}

struct List(Vec<Mark>);

impl List {
    fn add(&mut self, name: MarkName, shape: Option<Shape>) {
        self.0.extend(shape.map(|shape| Mark { name, shape }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_of_one_pixel_covers_exactly_that_pixel() {
        let corners = square(Pixel::new(10.0, 20.0), 1, &Matrix2::identity());
        assert_eq!(corners.map(|c| [c.x, c.y]), [[9.5, 19.5], [10.5, 19.5], [10.5, 20.5], [9.5, 20.5]]);
    }

    #[test]
    fn a_rolled_window_turns_clockwise_on_the_screen_and_grows_with_the_scale() {
        let turn = nalgebra::Rotation2::new(10.0_f64.to_radians()).into_inner() * 1.5;
        let corners = square(Pixel::new(0.0, 0.0), 20, &turn);
        // The top edge runs right and down when content turns clockwise (y points down).
        assert!(corners[1].y > corners[0].y);
        assert!((corners[0].distance(corners[1]) - 30.0).abs() < 1e-9);
    }
}
