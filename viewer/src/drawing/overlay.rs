//! Marks on images: lines of 1.4 points with a dark halo of 1 point, which are visible on any rock.

use egui::{Align2, Color32, Painter, Pos2, Rect, Shape, Stroke, Vec2, pos2, vec2};
use nalgebra::Matrix2;
use sightline_geometry::frames::Pixel;
use sightline_vision::image::PixelRect;

use crate::drawing::ellipse;
use crate::drawing::view2d::Transform;
use crate::theme;

/// Width of a line, points.
const WIDTH: f32 = 1.4;
/// Width of a thin line, points.
const THIN: f32 = 1.0;
/// Width of a line's halo on either side, points.
const HALO: f32 = 1.0;
/// Half the size of a mark, points.
const REACH: f32 = 7.0;

/// The stroke of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrokeStyle {
    /// Without gaps.
    Solid,
    /// Dashes.
    Dashed,
    /// Dots.
    Dotted,
}

/// The shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A ring.
    Ring,
    /// An upright cross.
    Plus,
    /// A diagonal cross.
    Cross,
    /// A square.
    Square,
    /// A diamond.
    Diamond,
    /// A filled circle.
    Dot,
    /// A triangle.
    Triangle,
    /// A short stretch of line.
    Stroke(StrokeStyle),
}

/// The mark of a run, by its number.
pub(crate) fn run_mark(number: usize) -> Mark {
    [Mark::Ring, Mark::Square, Mark::Triangle, Mark::Diamond][number % 4]
}

/// Paints marks given in pixels.
pub(crate) struct Overlay<'a> {
    painter: &'a Painter,
    transform: &'a Transform,
}

impl<'a> Overlay<'a> {
    /// Paints with `painter` through `transform`.
    pub(crate) fn new(painter: &'a Painter, transform: &'a Transform) -> Self {
        Self { painter, transform }
    }

    /// A line through pixels.
    pub(crate) fn line(&self, pixels: &[Pixel], colour: Color32, line: StrokeStyle) {
        let points: Vec<Pos2> = pixels.iter().map(|&pixel| self.transform.to_screen(pixel)).collect();
        paint_line(self.painter, &points, colour, line, WIDTH);
    }

    /// A thin line through pixels.
    pub(crate) fn thin_line(&self, pixels: &[Pixel], colour: Color32, line: StrokeStyle) {
        let points: Vec<Pos2> = pixels.iter().map(|&pixel| self.transform.to_screen(pixel)).collect();
        paint_line(self.painter, &points, colour, line, THIN);
    }

    /// A closed line through pixels.
    pub(crate) fn outline(&self, pixels: &[Pixel], colour: Color32, line: StrokeStyle) {
        let closed: Vec<Pixel> = pixels.iter().chain(pixels.first()).copied().collect();
        self.line(&closed, colour, line);
    }

    /// The border of a rectangle of pixels.
    pub(crate) fn rectangle(&self, region: PixelRect, colour: Color32, line: StrokeStyle) {
        let area = self.transform.area(region);
        let corners =
            [area.left_top(), area.right_top(), area.right_bottom(), area.left_bottom(), area.left_top()];
        paint_line(self.painter, &corners, colour, line, WIDTH);
    }

    /// The ellipse of a covariance (px²) about a pixel.
    pub(crate) fn ellipse(
        &self,
        centre: Pixel,
        covariance: &Matrix2<f64>,
        sigmas: f64,
        colour: Color32,
        line: StrokeStyle,
    ) {
        if let Some(outline) = ellipse::outline(covariance, sigmas) {
            let pixels: Vec<Pixel> = outline.iter().map(|d| centre.offset(d.x, d.y)).collect();
            self.line(&pixels, colour, line);
        }
    }

    /// A mark at a pixel; its size on the screen does not change with the zoom.
    pub(crate) fn mark(&self, pixel: Pixel, mark: Mark, colour: Color32) {
        paint_mark(self.painter, self.transform.to_screen(pixel), mark, colour, REACH);
    }

    /// The distance of two pixels on the screen, points.
    pub(crate) fn length(&self, from: Pixel, to: Pixel) -> f32 {
        self.transform.to_screen(from).distance(self.transform.to_screen(to))
    }

    /// Text beside a pixel, offset by `offset` points.
    pub(crate) fn words(&self, pixel: Pixel, offset: Vec2, words: &str, colour: Color32) {
        let at = self.transform.to_screen(pixel);
        let width = self.painter.layout_no_wrap(words.to_owned(), theme::image_font(), colour).size().x;
        // Text that would leave the canvas on the right is placed left of the pixel.
        let leaves = at.x + offset.x + width > self.transform.rect.right() - 4.0;
        let x = if leaves { -offset.x.abs() - width } else { offset.x };
        paint_words(self.painter, at + vec2(x, offset.y), words, colour);
    }
}

/// A line with its halo. Dashed lines are clipped to the painter's area, so that their cost does not depend on their
/// length.
pub(crate) fn paint_line(painter: &Painter, points: &[Pos2], colour: Color32, line: StrokeStyle, width: f32) {
    if points.len() < 2 {
        return;
    }
    let pieces = match line {
        StrokeStyle::Solid => vec![points.to_vec()],
        StrokeStyle::Dashed | StrokeStyle::Dotted => inside(points, painter.clip_rect().expand(2.0 * width)),
    };
    let shapes = |piece: &[Pos2], colour: Color32, width: f32| -> Vec<Shape> {
        let stroke = Stroke::new(width, colour);
        match line {
            StrokeStyle::Solid => vec![Shape::line(piece.to_vec(), stroke)],
            StrokeStyle::Dashed => Shape::dashed_line(piece, stroke, 7.0, 5.0),
            StrokeStyle::Dotted => Shape::dotted_line(piece, colour, 5.0, width / 2.0),
        }
    };
    for (colour, width) in [(theme::halo(), width + 2.0 * HALO), (colour, width)] {
        pieces.iter().for_each(|piece| painter.extend(shapes(piece, colour, width)));
    }
}

/// The pieces of a line inside an area.
fn inside(points: &[Pos2], area: Rect) -> Vec<Vec<Pos2>> {
    let mut pieces: Vec<Vec<Pos2>> = Vec::new();
    for pair in points.windows(2) {
        let Some([from, to]) = cut([pair[0], pair[1]], area) else { continue };
        match pieces.last_mut().filter(|piece| piece.last() == Some(&from)) {
            Some(piece) => piece.push(to),
            None => pieces.push(vec![from, to]),
        }
    }
    pieces
}

/// The part of a segment inside an area: between the last entry and the first exit over its four sides (Liang and Barsky
/// 1984).
fn cut([from, to]: [Pos2; 2], area: Rect) -> Option<[Pos2; 2]> {
    let along = to - from;
    let (mut enters, mut leaves) = (0.0_f32, 1.0_f32);
    for (step, room) in [
        (-along.x, from.x - area.left()),
        (along.x, area.right() - from.x),
        (-along.y, from.y - area.top()),
        (along.y, area.bottom() - from.y),
    ] {
        match step {
            0.0 if room < 0.0 => return None,
            0.0 => {}
            _ if step < 0.0 => enters = enters.max(room / step),
            _ => leaves = leaves.min(room / step),
        }
    }
    // Ends inside the area are returned unchanged, so that pieces join.
    let at = |t: f32, end: Pos2, is_end: bool| if is_end { end } else { from + along * t };
    (enters <= leaves).then(|| [at(enters, from, enters == 0.0), at(leaves, to, leaves == 1.0)])
}

/// A mark with its halo, `reach` points to either side.
pub(crate) fn paint_mark(painter: &Painter, at: Pos2, mark: Mark, colour: Color32, reach: f32) {
    let to = |x: f32, y: f32| at + vec2(x, y) * reach;
    let lines: Vec<Vec<Pos2>> = match mark {
        Mark::Ring => {
            painter.circle_stroke(at, reach * 0.75, Stroke::new(WIDTH + 2.0 * HALO, theme::halo()));
            painter.circle_stroke(at, reach * 0.75, Stroke::new(WIDTH, colour));
            return;
        }
        Mark::Dot => {
            painter.circle_filled(at, reach * 0.6 + HALO, theme::halo());
            painter.circle_filled(at, reach * 0.6, colour);
            return;
        }
        Mark::Plus => vec![vec![to(-1.0, 0.0), to(1.0, 0.0)], vec![to(0.0, -1.0), to(0.0, 1.0)]],
        Mark::Cross => vec![vec![to(-0.7, -0.7), to(0.7, 0.7)], vec![to(-0.7, 0.7), to(0.7, -0.7)]],
        Mark::Square => {
            vec![vec![to(-0.7, -0.7), to(0.7, -0.7), to(0.7, 0.7), to(-0.7, 0.7), to(-0.7, -0.75)]]
        }
        Mark::Diamond => {
            vec![vec![to(0.0, -0.9), to(0.9, 0.0), to(0.0, 0.9), to(-0.9, 0.0), to(0.05, -0.95)]]
        }
        Mark::Triangle => {
            vec![vec![to(0.0, -0.9), to(0.85, 0.65), to(-0.85, 0.65), to(0.0, -0.9), to(0.08, -0.77)]]
        }
        Mark::Stroke(line) => {
            paint_line(painter, &[to(-1.0, 0.0), to(1.0, 0.0)], colour, line, WIDTH);
            return;
        }
    };
    for (colour, width) in [(theme::halo(), WIDTH + 2.0 * HALO), (colour, WIDTH)] {
        for line in &lines {
            painter.add(Shape::line(line.clone(), Stroke::new(width, colour)));
        }
    }
}

/// Text on a dark background, its left middle at `at`. Returns its area.
pub(crate) fn paint_words(painter: &Painter, at: Pos2, words: &str, colour: Color32) -> Rect {
    let galley = painter.layout_no_wrap(words.to_owned(), theme::image_font(), colour);
    let area = Align2::LEFT_CENTER.anchor_rect(Rect::from_min_size(at, galley.size()));
    painter.rect_filled(area.expand2(vec2(3.0, 1.0)), 2.0, theme::scrim());
    painter.galley(area.min, galley, colour);
    area
}

/// A row of the legend at `at`: the mark, then its label. Returns the row's area.
pub(crate) fn paint_legend_row(
    painter: &Painter,
    at: Pos2,
    mark: Mark,
    colour: Color32,
    word: &str,
    shown: bool,
) -> Rect {
    let faded = |c: Color32| if shown { c } else { c.gamma_multiply(0.35) };
    paint_mark(painter, at + vec2(9.0, 7.0), mark, faded(colour), 6.0);
    let galley = painter.layout_no_wrap(word.to_owned(), theme::image_font(), faded(theme::text()));
    let size = galley.size();
    painter.galley(pos2(at.x + 22.0, at.y + 7.0 - size.y / 2.0), galley, faded(theme::text()));
    Rect::from_min_size(at, vec2(26.0 + size.x, 15.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_line_only_what_is_in_the_area_is_left() {
        let area = Rect::from_min_max(pos2(0.0, 0.0), pos2(100.0, 50.0));
        let line = |points: &[(f32, f32)]| -> Vec<Pos2> { points.iter().map(|&(x, y)| pos2(x, y)).collect() };
        assert_eq!(inside(&line(&[(-1e6, 10.0), (1e6, 10.0)]), area), [line(&[(0.0, 10.0), (100.0, 10.0)])]);
        let there = line(&[(10.0, 10.0), (20.0, 40.0), (90.0, 5.0)]);
        assert_eq!(inside(&there, area), [there]);
        // Out over one side and in again over another one: two pieces.
        let bent = line(&[(50.0, 25.0), (50.0, 75.0), (75.0, 75.0), (75.0, 25.0)]);
        let pieces = [line(&[(50.0, 25.0), (50.0, 50.0)]), line(&[(75.0, 50.0), (75.0, 25.0)])];
        assert_eq!(inside(&bent, area), pieces);
        assert!(inside(&line(&[(-5.0, 60.0), (105.0, 60.0)]), area).is_empty());
        assert!(inside(&line(&[(-20.0, 40.0), (10.0, 80.0)]), area).is_empty(), "past a corner");
    }
}
