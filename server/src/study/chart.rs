//! Charts as SVG text, drawn by `plotters`: lines with their range over the worlds, and the paper's values.
//!
//! Colours are those of Okabe and Ito, distinguishable with any colour vision, each with its own marker shape; the paper's
//! values are hollow squares in the colour of their configuration. Coinciding lines are merged into one, with all labels.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Okabe and Ito's colours, without yellow, which vanishes on white.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(90, 90, 90),
];

/// If there are more words than this along the axis, they alternate between two rows.
const MOST_LEVEL_WORDS: usize = 5;

/// Spacing of rows of words along the axis, px.
const WORD_ROW: i32 = 15;

/// Width and minimum height of a chart, px.
const SIZE: (u32, u32) = (1000, 420);

/// Width of the plot, px; the rest is the legend.
const PLOT_WIDTH: u32 = 640;

/// Maximum number of letters in a row of the legend.
const LEGEND_LETTERS: usize = 46;

/// Spacing of legend rows, and distance of the first from the top, px.
const LEGEND_ROW: i32 = 18;
const LEGEND_TOP: i32 = 44;

/// Maximum number of points of a line drawn with markers.
const MOST_MARKS: usize = 40;

/// A line with its points.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// Label in the legend.
    pub label: String,
    /// Index of the colour.
    pub colour: usize,
    /// Points (x, y).
    pub points: Vec<(f64, f64)>,
    /// Minimum and maximum over the worlds at some x.
    pub ranges: Vec<(f64, [f64; 2])>,
    /// Whether the line is thin and without markers: an expected value or gate, not a measurement.
    pub is_thin: bool,
    /// Whether only hollow square markers are drawn.
    pub is_marks: bool,
    /// Whether the points are not connected, because intermediate values have no meaning.
    pub is_apart: bool,
}

/// A chart.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Axis labels with units, horizontal and vertical.
    pub axes: [String; 2],
    /// Words along the horizontal axis at 0, 1, 2, …; empty for numbers.
    pub words: Vec<String>,
    /// Vertical range; `None` to derive it from the data.
    pub y_range: Option<[f64; 2]>,
    /// Lines.
    pub lines: Vec<Line>,
}

impl Chart {
    /// Renders the chart as SVG.
    ///
    /// # Errors
    /// The message of the drawing library.
    pub fn svg(&self) -> Result<String, String> {
        let mut text = String::new();
        {
            let rows: usize = self.lines.iter().map(|line| rows_of(&line.label).len()).sum();
            let height = SIZE.1.max((2 * LEGEND_TOP + LEGEND_ROW * rows as i32) as u32);
            let area = SVGBackend::with_string(&mut text, (SIZE.0, height)).into_drawing_area();
            area.fill(&WHITE).map_err(|e| e.to_string())?;
            let (plot, legend) = area.split_horizontally(PLOT_WIDTH);
            let (plot, _) = plot.split_vertically(SIZE.1);
            self.plot(&plot)?;
            self.legend(&legend)?;
            area.present().map_err(|e| e.to_string())?;
        }
        Ok(text)
    }

    fn plot(&self, area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>) -> Result<(), String> {
        let [x, y] = self.ranges();
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", 16))
            .margin(12)
            .x_label_area_size(self.label_height())
            .y_label_area_size(58)
            .build_cartesian_2d(x[0]..x[1], y[0]..y[1])
            .map_err(|e| e.to_string())?;
        let word = |x: &f64| {
            let whole = (x.round() - x).abs() < 1e-6 && *x > -0.5;
            whole.then(|| self.words.get(x.round() as usize).cloned()).flatten().unwrap_or_default()
        };
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(self.axes[0].as_str()).y_desc(self.axes[1].as_str()).light_line_style(TRANSPARENT);
        let short = |v: &f64| number(*v);
        mesh.x_label_formatter(&short).y_label_formatter(&short);
        if !self.words.is_empty() {
            mesh.x_label_formatter(&word).x_labels(2 * self.words.len() + 1);
        }
        let in_two_rows = self.words.len() > MOST_LEVEL_WORDS;
        if in_two_rows {
            mesh.x_labels(0);
        }
        mesh.draw().map_err(|e| e.to_string())?;
        if in_two_rows {
            let style =
                TextStyle::from(("sans-serif", 12).into_font()).pos(Pos::new(HPos::Center, VPos::Top));
            for (i, word) in self.words.iter().enumerate() {
                let (column, row) = chart.backend_coord(&(i as f64, y[0]));
                let position = (column, row + 6 + WORD_ROW * (i % 2) as i32);
                let text = Text::new(word.as_str(), position, style.clone());
                area.draw(&text).map_err(|e| e.to_string())?;
            }
        }
        self.lines.iter().try_for_each(|line| draw(&mut chart, line, [x, y])).map_err(|e| e.to_string())
    }

    /// Draws the legend next to the plot, where it hides nothing.
    fn legend(&self, area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>) -> Result<(), String> {
        let mut y = LEGEND_TOP;
        for line in &self.lines {
            let colour = COLOURS[line.colour % COLOURS.len()];
            if line.is_marks {
                let square = Rectangle::new([(6, y - 4), (14, y + 4)], colour.stroke_width(2));
                area.draw(&square).map_err(|e| e.to_string())?;
            } else {
                let width = if line.is_thin { 1 } else { 3 };
                let stroke = PathElement::new([(0, y), (20, y)], colour.stroke_width(width));
                area.draw(&stroke).map_err(|e| e.to_string())?;
                if line.has_marks() {
                    let mark = Polygon::new(mark(line.colour, (10, y)), colour.filled());
                    area.draw(&mark).map_err(|e| e.to_string())?;
                }
            }
            for row in rows_of(&line.label) {
                let text = Text::new(row, (26, y - 7), ("sans-serif", 13));
                area.draw(&text).map_err(|e| e.to_string())?;
                y += LEGEND_ROW;
            }
        }
        Ok(())
    }

    /// Height of the labels below the plot, px.
    fn label_height(&self) -> u32 {
        match self.words.len() {
            0 => 40,
            count if count > MOST_LEVEL_WORDS => 76,
            _ => 56,
        }
    }

    /// The ranges of both axes, with a margin.
    fn ranges(&self) -> [[f64; 2]; 2] {
        let of = |values: &mut dyn Iterator<Item = f64>| {
            let [low, high] = values
                .filter(|value| value.is_finite())
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
            if low > high { [0.0, 1.0] } else { [low, high] }
        };
        let points = || self.lines.iter().flat_map(|line| line.points.iter());
        let [low, high] = of(&mut points().map(|point| point.0));
        let air = if self.words.is_empty() { 0.04 * (high - low).max(1e-9) } else { 0.5 };
        let y = self.y_range.unwrap_or_else(|| {
            let ends = self.lines.iter().flat_map(|line| line.ranges.iter().flat_map(|(_, ends)| *ends));
            let [low, high] = of(&mut points().map(|point| point.1).chain(ends));
            let air = 0.06 * (high - low).max(1e-9);
            [if low >= 0.0 && low < 0.5 * high { 0.0 } else { low - air }, high + air]
        });
        [[low - air, high + air], y]
    }
}

impl Line {
    fn has_marks(&self) -> bool {
        !self.is_thin && self.points.len() <= MOST_MARKS
    }

    /// Whether another line has the same points.
    fn coincides(&self, other: &Self) -> bool {
        let same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * a.abs().max(1.0);
        !self.points.is_empty()
            && self.points.len() == other.points.len()
            && self.points.iter().zip(&other.points).all(|(a, b)| same(a.0, b.0) && same(a.1, b.1))
    }
}

/// Merges coinciding lines and joins their labels.
pub fn merged(lines: Vec<Line>) -> Vec<Line> {
    let mut found: Vec<Line> = Vec::new();
    for line in lines {
        match found.iter_mut().find(|other| other.coincides(&line)) {
            Some(other) => other.label = format!("{}, {}", other.label, line.label),
            None => found.push(line),
        }
    }
    for (colour, line) in found.iter_mut().enumerate() {
        line.colour = colour;
    }
    found
}

/// Wraps a label into rows of the legend.
fn rows_of(label: &str) -> Vec<String> {
    let mut rows: Vec<String> = vec![String::new()];
    for word in label.split(' ') {
        let Some(row) = rows.last_mut() else { break };
        if !row.is_empty() && row.len() + word.len() >= LEGEND_LETTERS {
            rows.push(word.to_owned());
        } else {
            let space = if row.is_empty() { "" } else { " " };
            row.push_str(&format!("{space}{word}"));
        }
    }
    rows
}

/// A number on an axis, without trailing decimals.
fn number(value: f64) -> String {
    let rounded = (value * 1000.0).round() / 1000.0;
    if rounded == 0.0 { "0".to_owned() } else { rounded.to_string() }
}

/// The corners of a line's marker around a point, px: a hexagon, a square, a triangle, a diamond, and so on.
fn mark(colour: usize, (x, y): (i32, i32)) -> Vec<(i32, i32)> {
    let corners: &[(i32, i32)] = match colour % 5 {
        0 => &[(-5, 0), (-3, -4), (3, -4), (5, 0), (3, 4), (-3, 4)],
        1 => &[(-4, -4), (4, -4), (4, 4), (-4, 4)],
        2 => &[(0, -5), (5, 4), (-5, 4)],
        3 => &[(0, -6), (6, 0), (0, 6), (-6, 0)],
        _ => &[(-5, -4), (5, -4), (0, 5)],
    };
    corners.iter().map(|(dx, dy)| (x + dx, y + dy)).collect()
}

type Plot<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn draw(chart: &mut Plot<'_, '_>, line: &Line, [x, y]: [[f64; 2]; 2]) -> Result<(), String> {
    let colour = COLOURS[line.colour % COLOURS.len()];
    // Points outside the frame would be clamped to its border.
    let is_inside =
        |point: &&(f64, f64)| (x[0]..=x[1]).contains(&point.0) && (y[0]..=y[1]).contains(&point.1);
    let points: Vec<(f64, f64)> = line.points.iter().filter(is_inside).copied().collect();
    if line.is_marks {
        let half = [0.008 * (x[1] - x[0]), 0.014 * (y[1] - y[0])];
        let squares = points.iter().map(|&(px, py)| {
            let corners = [(px - half[0], py - half[1]), (px + half[0], py + half[1])];
            Rectangle::new(corners, colour.stroke_width(2))
        });
        return chart.draw_series(squares).map(|_| ()).map_err(|e| e.to_string());
    }
    let width = if line.is_thin { 1 } else { 2 };
    if !line.is_apart {
        let joined = LineSeries::new(points.iter().copied(), colour.stroke_width(width));
        chart.draw_series(joined).map_err(|e| e.to_string())?;
    }
    if line.has_marks() {
        let marks = points
            .iter()
            .map(|&point| EmptyElement::at(point) + Polygon::new(mark(line.colour, (0, 0)), colour.filled()));
        chart.draw_series(marks).map_err(|e| e.to_string())?;
    }
    let bars = line.ranges.iter().map(|&(px, [low, high])| {
        let clip = |v: f64| v.clamp(y[0], y[1]);
        PathElement::new([(px, clip(low)), (px, clip(high))], colour.mix(0.45).stroke_width(3))
    });
    chart.draw_series(bars).map(|_| ()).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_draws_lines_ranges_words_and_the_papers_squares() {
        let line = Line {
            label: "ncc-scale".to_owned(),
            points: vec![(0.0, 100.0), (1.0, 95.0)],
            ranges: vec![(0.0, [90.0, 100.0])],
            ..Line::default()
        };
        let paper = Line { label: "paper".to_owned(), is_marks: true, ..line.clone() };
        let words = vec!["flat".to_owned(), "steep".to_owned()];
        let chart = Chart { lines: vec![line.clone(), paper], words, ..Chart::default() };
        let svg = chart.svg().unwrap();
        for word in ["ncc-scale", "paper", "flat", "steep", "<polygon", "<polyline", "<rect"] {
            assert!(svg.contains(word), "{word}");
        }
        assert!(
            Chart {
                lines: vec![Line { points: Vec::new(), ranges: Vec::new(), ..line }],
                ..Chart::default()
            }
            .svg()
            .is_ok()
        );
    }
}
