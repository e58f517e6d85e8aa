//! An array as an image with its title, its colour bar with unit and limits, and the value under the pointer.
//!
//! Missing values are shown as a checker. The ends of the colour bar are marked ≤ and ≥, because values may lie beyond.

use egui::{Align2, Painter, Pos2, Rect, Response, Sense, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};

use crate::drawing::overlay::{Mark, paint_mark};
use crate::drawing::raster;
use crate::drawing::raster::Raster;
use crate::drawing::view2d;
use crate::theme;

/// Width of the colour bar with its numbers, points.
pub(crate) const BAR: f32 = 70.0;
/// Minimum width and height of an image with its bar, points.
const LEAST: f32 = 110.0;
/// Height of the title, points.
const TITLE: f32 = 16.0;

/// The display unit of values.
#[derive(Clone, Copy)]
pub(crate) struct DisplayUnit {
    /// The name of the unit.
    pub(crate) word: &'static str,
    /// Number of display units in one unit of the array.
    pub(crate) factor: f32,
}

impl DisplayUnit {
    /// A value with its unit.
    pub(crate) fn format(self, value: f32) -> String {
        format!("{} {}", self.number(value), self.word)
    }

    /// A value in the display unit, to three digits, which is the precision of a colour.
    pub(crate) fn number(self, value: f32) -> String {
        let value = f64::from(value * self.factor);
        let decimals = match value.abs() {
            size if size < 1e-9 => 0,
            size if size < 10.0 => 2,
            size if size < 100.0 => 1,
            _ => 0,
        };
        let digits = format!("{value:.decimals$}");
        // Zero after rounding has no sign.
        if digits.trim_matches(['-', '0', '.']).is_empty() { "0".to_owned() } else { digits }
    }
}

/// An array and its presentation.
pub(crate) struct ArrayImage<'a> {
    /// The title above the image.
    pub(crate) title: &'a str,
    /// The values.
    pub(crate) raster: &'a Raster,
    /// The colour map; `None`: grey, without a bar.
    pub(crate) colour_map: Option<raster::ColourMap>,
    /// The unit of the values.
    pub(crate) unit: DisplayUnit,
}

/// An image after layout.
pub(crate) struct Placed {
    /// The screen area of its pixels.
    pub(crate) area: Rect,
    /// The response of the image and its title.
    pub(crate) response: Response,
    painter: Painter,
    scale: f32,
}

impl Placed {
    /// The screen position of an array position; (0, 0) is the centre of the first pixel.
    pub(crate) fn to_screen(&self, x: f64, y: f64) -> Pos2 {
        self.area.min + vec2(x as f32 + 0.5, y as f32 + 0.5) * self.scale
    }

    /// A mark at an array position; nothing outside the image.
    pub(crate) fn mark(&self, x: f64, y: f64, mark: Mark, colour: egui::Color32) {
        let at = self.to_screen(x, y);
        if self.area.contains(at) {
            paint_mark(&self.painter, at, mark, colour, 6.0);
        }
    }
}

impl ArrayImage<'_> {
    /// Shows the image in an area of this size.
    pub(crate) fn show(&self, ui: &mut Ui, size: Vec2) -> Placed {
        let bar = if self.colour_map.is_some() { BAR } else { 0.0 };
        let [width, height] = self.raster.size().map(|side| side.max(1) as f32);
        let scale = ((size.x - bar) / width).min((size.y - TITLE - 2.0) / height).max(0.01);
        let taken = vec2(size.x, TITLE + height * scale + 2.0);
        let (rect, response) = ui.allocate_exact_size(taken, Sense::hover());
        let painter = ui.painter_at(rect);
        painter.text(rect.min, Align2::LEFT_TOP, self.title, theme::image_font(), theme::text());
        let area = Rect::from_min_size(rect.min + vec2(0.0, TITLE), vec2(width, height) * scale);
        view2d::checker(&painter, area);
        if let Some(colour_map) = self.colour_map {
            self.raster.set_colour_map(colour_map);
            let beside = Rect::from_min_size(area.right_top() + vec2(5.0, 0.0), vec2(BAR, area.height()));
            colour_bar(&painter, beside, colour_map, self.unit);
        }
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(self.raster.texture.id(), area, whole, theme::UNTINTED);
        painter.rect_stroke(area, 0.0, Stroke::new(1.0, theme::line()), StrokeKind::Outside);
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, self.words()));
        let placed = Placed { area, response, painter, scale };
        self.hover(&placed);
        placed
    }

    /// Title and limits.
    fn words(&self) -> String {
        let Some(colour_map) = self.colour_map else { return self.title.to_owned() };
        let [low, high] = colour_map.limits();
        format!("{}, from {} to {}", self.title, self.unit.format(low), self.unit.format(high))
    }

    /// Shows the value under the pointer.
    fn hover(&self, placed: &Placed) {
        let Some(at) = placed.response.hover_pos().filter(|at| placed.area.contains(*at)) else { return };
        let [x, y] = ((at - placed.area.min) / placed.scale).into();
        let (x, y) = (x.floor() as i64, y.floor() as i64);
        let value = self.raster.at(x, y).map_or_else(|| "no value here".to_owned(), |v| self.unit.format(v));
        placed.response.clone().on_hover_text_at_pointer(format!("column {x}, row {y}: {value}"));
    }
}

/// The colour bar with the values of its ends and middle.
pub(crate) fn colour_bar(painter: &Painter, area: Rect, colour_map: raster::ColourMap, unit: DisplayUnit) {
    const STEPS: u16 = 48;
    let strip = Rect::from_min_max(area.min, pos2(area.left() + 10.0, area.bottom()));
    let [low, high] = colour_map.limits();
    let mut mesh = egui::Mesh::default();
    for step in 0..STEPS {
        let [from, to] = [step, step + 1].map(|step| f32::from(step) / f32::from(STEPS));
        let y = |share: f32| strip.bottom() - share * strip.height();
        let row = Rect::from_min_max(pos2(strip.left(), y(to)), pos2(strip.right(), y(from)));
        mesh.add_colored_rect(row, colour_map.colour(low + (high - low) * (from + to) / 2.0));
    }
    painter.add(egui::Shape::mesh(mesh));
    let middle = (low + high) / 2.0;
    let text = |y: f32, anchor: Align2, words: String| {
        painter.text(pos2(strip.right() + 4.0, y), anchor, words, theme::digit_font(), theme::text());
    };
    text(strip.top(), Align2::LEFT_TOP, format!("≥ {}", unit.number(high)));
    text(strip.bottom(), Align2::LEFT_BOTTOM, format!("≤ {}", unit.number(low)));
    if strip.height() > 60.0 {
        text(strip.center().y, Align2::LEFT_CENTER, unit.number(middle));
    }
    if strip.height() > 34.0 {
        text(strip.top() + 13.0, Align2::LEFT_TOP, unit.word.to_owned());
    }
}

/// The maximum size of each of `count` images side by side in the available width, at most `height` points high.
pub(crate) fn side_by_side(ui: &Ui, count: usize, height: f32) -> Vec2 {
    let gaps = ui.spacing().item_spacing.x * (count - 1) as f32;
    let width = ((ui.available_width() - gaps) / count as f32 - 1.0).max(LEAST);
    vec2(width, height.max(LEAST))
}

/// The side of a square image with title and bar that fits into an area of this size, points.
pub(crate) fn square(size: Vec2) -> f32 {
    (size.x - BAR).min(size.y - TITLE - 2.0)
}
