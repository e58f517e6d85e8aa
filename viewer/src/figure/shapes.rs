//! Converts egui's shapes to inks, clipped to a rectangle.
//!
//! Rectangles and axis-aligned lines are snapped to pixels of the output scale, as egui does on the screen, so that a line
//! one point wide stays sharp. Triangles of a mesh get the mean of their corners' colours; two that form an axis-aligned
//! rectangle are merged.

use std::sync::Arc;

use egui::emath::TSTransform;
use egui::epaint::{
    ClippedShape, ColorMode, CubicBezierShape, Mesh, PathShape, PathStroke, RectShape, StrokeKind, Vertex,
};
use egui::{Color32, ColorImage, Pos2, Rect, Shape, Stroke, TextureId, Vec2, pos2, vec2};

use crate::figure::{Figure, Form, Ink, Piece, words};

/// Returns the pixels of a texture; `None` if unknown.
pub(crate) type Textures<'a> = &'a dyn Fn(TextureId) -> Option<ColorImage>;

/// Width of the line that closes the seam between two triangles, points.
const SEAM: f32 = 0.5;

/// Collects inks.
pub(crate) struct Gatherer<'a> {
    textures: Textures<'a>,
    scale: f32,
    pieces: Vec<Piece>,
    left_out: usize,
    /// The current clip rectangle.
    clip: Rect,
}

/// The figure of the shapes inside `frame`; `scale` is the number of output pixels per point.
pub(crate) fn figure<'s>(
    shapes: impl IntoIterator<Item = &'s ClippedShape>,
    frame: Rect,
    scale: f32,
    textures: Textures<'_>,
) -> Figure {
    let mut gatherer = Gatherer { textures, scale, pieces: Vec::new(), left_out: 0, clip: frame };
    for clipped in shapes {
        gatherer.clip = clipped.clip_rect.intersect(frame);
        if !gatherer.clip.is_positive() {
            continue;
        }
        let transform = clipped.transform_after_tessellation;
        if transform == TSTransform::IDENTITY {
            gatherer.shape(&clipped.shape);
        } else {
            let mut shape = clipped.shape.clone();
            shape.transform(transform);
            gatherer.shape(&shape);
        }
    }
    let by = -frame.min.to_vec2();
    let moved = |piece: Piece| Piece { clip: piece.clip.translate(by), ink: piece.ink.moved(by) };
    Figure {
        size: frame.size(),
        title: String::new(),
        description: String::new(),
        ground: crate::theme::panel(),
        pieces: gatherer.pieces.into_iter().map(moved).collect(),
        left_out: gatherer.left_out,
    }
}

impl Gatherer<'_> {
    fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Noop => {}
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| self.shape(shape)),
            Shape::Circle(circle) => {
                let form = Form::Ellipse(circle.center, Vec2::splat(circle.radius), 0.0);
                self.area(form, circle.fill, circle.stroke);
            }
            Shape::Ellipse(ellipse) => {
                let form = Form::Ellipse(ellipse.center, ellipse.radius, ellipse.angle);
                self.area(form, ellipse.fill, ellipse.stroke);
            }
            Shape::LineSegment { points, stroke } => self.segment(*points, *stroke),
            Shape::Path(path) => self.path(path),
            Shape::Band(band) => {
                let turn = egui::emath::Rot2::from_angle(band.angle);
                let edge = |of: fn(&egui::epaint::BandPoint) -> f32| {
                    band.points.iter().map(move |point| turn * vec2(point.x, of(point))).map(Vec2::to_pos2)
                };
                let lower: Vec<Pos2> = edge(|point| point.y.max).collect();
                let outline = edge(|point| point.y.min).chain(lower.into_iter().rev()).collect();
                self.area(Form::Lines(outline, true), band.fill, band.stroke);
            }
            Shape::Rect(rect) => self.rect(rect),
            Shape::Text(text) => {
                let inks = words::inks(text);
                inks.into_iter().for_each(|ink| self.push(ink));
            }
            Shape::Mesh(mesh) => self.mesh(mesh),
            Shape::QuadraticBezier(curve) => {
                // A quadratic curve is a cubic one with handles of two thirds of the length.
                let [first, handle, last] = curve.points;
                let towards = |end: Pos2| end + (handle - end) * (2.0 / 3.0);
                let points = [first, towards(first), towards(last), last];
                self.curve(points, curve.closed, curve.fill, &curve.stroke);
            }
            Shape::CubicBezier(CubicBezierShape { points, closed, fill, stroke }) => {
                self.curve(*points, *closed, *fill, stroke);
            }
            Shape::Callback(_) => self.left_out += 1,
        }
    }

    fn push(&mut self, ink: Ink) {
        if ink.bounds().expand(1.0).intersects(self.clip) {
            self.pieces.push(Piece { clip: self.clip, ink });
        }
    }

    fn area(&mut self, form: Form, fill: Color32, stroke: Stroke) {
        let is_seen = fill != Color32::TRANSPARENT || !stroke.is_empty();
        let stroke = if stroke.is_empty() { Stroke::NONE } else { stroke };
        if is_seen && form.bounds().is_finite() {
            self.push(Ink::Area { form, fill, stroke });
        }
    }

    /// A line, snapped to pixels if it is horizontal or vertical.
    fn segment(&mut self, [mut from, mut to]: [Pos2; 2], stroke: Stroke) {
        if from.x == to.x {
            stroke.round_center_to_pixel(self.scale, &mut from.x);
            to.x = from.x;
        } else if from.y == to.y {
            stroke.round_center_to_pixel(self.scale, &mut from.y);
            to.y = from.y;
        }
        self.area(Form::Lines(vec![from, to], false), Color32::TRANSPARENT, stroke);
    }

    fn path(&mut self, path: &PathShape) {
        let stroke = plain(&path.stroke, &path.points);
        match path.points[..] {
            [from, to] if !path.closed => self.segment([from, to], stroke),
            _ => self.area(Form::Lines(path.points.clone(), path.closed), path.fill, stroke),
        }
    }

    fn curve(&mut self, points: [Pos2; 4], closed: bool, fill: Color32, stroke: &PathStroke) {
        self.area(Form::Curve(points, closed), fill, plain(stroke, &points));
    }

    fn rect(&mut self, shape: &RectShape) {
        let whole = |v: f32| (v * self.scale).round() / self.scale;
        let on_pixels = |rect: Rect| {
            Rect::from_min_max(
                pos2(whole(rect.min.x), whole(rect.min.y)),
                pos2(whole(rect.max.x), whole(rect.max.y)),
            )
        };
        let rect = if shape.round_to_pixels.unwrap_or(true) { on_pixels(shape.rect) } else { shape.rect };
        if let Some(brush) =
            shape.brush.as_ref().filter(|brush| brush.fill_texture_id != TextureId::default())
        {
            self.picture(brush.fill_texture_id, shape.rect, brush.uv, shape.fill);
        } else if shape.fill != Color32::TRANSPARENT {
            self.area(turned(rect, radii(shape, 0.0), shape.angle), shape.fill, Stroke::NONE);
        }
        if !shape.stroke.is_empty() {
            let half = shape.stroke.width / 2.0;
            let by = match shape.stroke_kind {
                StrokeKind::Inside => -half,
                StrokeKind::Middle => 0.0,
                StrokeKind::Outside => half,
            };
            let form = turned(rect.expand(by), radii(shape, by), shape.angle);
            self.area(form, Color32::TRANSPARENT, shape.stroke);
        }
    }

    fn mesh(&mut self, mesh: &Mesh) {
        let corner = |index: u32| mesh.vertices.get(index as usize).copied();
        let mut left = &mesh.indices[..];
        while left.len() >= 3 {
            let pair: Vec<Vertex> = left.iter().take(6).filter_map(|index| corner(*index)).collect();
            let upright = if pair.len() == 6 { upright(&pair) } else { None };
            if mesh.texture_id != TextureId::default() {
                match upright {
                    Some((place, uv)) => self.picture(mesh.texture_id, place, uv, pair[0].color),
                    None => self.left_out += 1,
                }
            } else if let Some((place, _)) = upright.filter(|_| pair.iter().all(|v| v.color == pair[0].color))
            {
                self.area(Form::Rect(place, [0.0; 4]), pair[0].color, seam(pair[0].color));
            } else {
                self.triangle(&pair[..3.min(pair.len())]);
                left = &left[3..];
                continue;
            }
            left = left.get(6..).unwrap_or_default();
        }
    }

    fn triangle(&mut self, corners: &[Vertex]) {
        let channels = [Color32::r, Color32::g, Color32::b, Color32::a].map(|of| mean_of(corners, of));
        let colour = crate::theme::premultiplied(channels);
        let outline = corners.iter().map(|corner| corner.pos).collect();
        self.area(Form::Lines(outline, true), colour, seam(colour));
    }

    /// A texture in a rectangle; only its visible part is stored.
    fn picture(&mut self, id: TextureId, place: Rect, uv: Rect, tint: Color32) {
        if !place.is_positive() || !place.intersects(self.clip) {
            return;
        }
        let Some(pixels) = (self.textures)(id) else {
            self.left_out += 1;
            return;
        };
        let [width, height] = pixels.size.map(|side| side as f32);
        let seen = place.intersect(self.clip);
        let share = |at: f32, low: f32, high: f32| (at - low) / (high - low);
        let column = |x: f32| (uv.left() + share(x, place.left(), place.right()) * uv.width()) * width;
        let row = |y: f32| (uv.top() + share(y, place.top(), place.bottom()) * uv.height()) * height;
        let whole = |low: f32, high: f32, side: f32| {
            [low.min(high).floor().clamp(0.0, side), low.max(high).ceil().clamp(0.0, side)]
                .map(|v| v as usize)
        };
        let [left, right] = whole(column(seen.left()), column(seen.right()), width);
        let [top, bottom] = whole(row(seen.top()), row(seen.bottom()), height);
        if left >= right || top >= bottom {
            return;
        }
        let rows =
            (top..bottom).flat_map(|y| &pixels.pixels[y * pixels.size[0] + left..y * pixels.size[0] + right]);
        let part: Vec<Color32> = rows
            .map(|colour| if tint == crate::theme::UNTINTED { *colour } else { *colour * tint })
            .collect();
        let at_x = |column: usize| {
            place.left() + share(column as f32 / width, uv.left(), uv.right()) * place.width()
        };
        let at_y =
            |row: usize| place.top() + share(row as f32 / height, uv.top(), uv.bottom()) * place.height();
        let place = Rect::from_min_max(pos2(at_x(left), at_y(top)), pos2(at_x(right), at_y(bottom)));
        let pixels = Arc::new(ColorImage::new([right - left, bottom - top], part));
        self.push(Ink::Picture { pixels, place });
    }
}

/// The stroke that closes the seam between opaque parts of a mesh, through which the background would be visible.
fn seam(colour: Color32) -> Stroke {
    if colour.is_opaque() { Stroke::new(SEAM, colour) } else { Stroke::NONE }
}

/// The mean of one channel.
fn mean_of(corners: &[Vertex], of: fn(&Color32) -> u8) -> u8 {
    let sum: usize = corners.iter().map(|corner| usize::from(of(&corner.color))).sum();
    (sum / corners.len().max(1)) as u8
}

/// The stroke of a path in one colour; for a varying colour, that of its first point.
fn plain(stroke: &PathStroke, points: &[Pos2]) -> Stroke {
    let colour = match &stroke.color {
        ColorMode::Solid(colour) => *colour,
        ColorMode::UV(of) => {
            points.first().map_or(Color32::TRANSPARENT, |at| of(Rect::from_points(points), *at))
        }
    };
    Stroke::new(stroke.width, colour)
}

fn radii(shape: &RectShape, more: f32) -> [f32; 4] {
    let radius = shape.corner_radius;
    let most = shape.rect.size().min_elem() / 2.0;
    [radius.nw, radius.ne, radius.se, radius.sw]
        .map(|radius| if radius == 0 { 0.0 } else { (f32::from(radius) + more).clamp(0.0, most.max(0.0)) })
}

fn turned(rect: Rect, radii: [f32; 4], angle: f32) -> Form {
    if angle == 0.0 {
        return Form::Rect(rect, radii);
    }
    let turn = egui::emath::Rot2::from_angle(angle);
    let corners = [rect.left_top(), rect.right_top(), rect.right_bottom(), rect.left_bottom()];
    Form::Lines(corners.map(|corner| rect.center() + turn * (corner - rect.center())).to_vec(), true)
}

/// The axis-aligned rectangle that two triangles form, with its texture coordinates; `None` if they form none.
fn upright(pair: &[Vertex]) -> Option<(Rect, Rect)> {
    let place = Rect::from_points(&pair.iter().map(|corner| corner.pos).collect::<Vec<_>>());
    let is_corner = |corner: &Vertex| {
        let at = corner.pos;
        (at.x == place.left() || at.x == place.right()) && (at.y == place.top() || at.y == place.bottom())
    };
    let mut corners: Vec<[u32; 2]> =
        pair.iter().map(|corner| [corner.pos.x.to_bits(), corner.pos.y.to_bits()]).collect();
    corners.sort_unstable();
    corners.dedup();
    if corners.len() != 4 || !pair.iter().all(is_corner) {
        return None;
    }
    let uv_at = |at: Pos2| pair.iter().find(|corner| corner.pos == at).map(|corner| corner.uv);
    Some((place, Rect::from_min_max(uv_at(place.min)?, uv_at(place.max)?)))
}
