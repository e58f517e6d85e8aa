//! Charts as SVG text, drawn by `plotters`: lines with their range over the worlds, and values of the paper beside them.
//!
//! Colours are those of Okabe and Ito, told apart by everyone; the paper's values are hollow squares in the colour of the
//! configuration that they belong to.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

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

/// More words than these along the axis stand upright.
const MOST_LEVEL_WORDS: usize = 5;

/// Width and height of a chart, px.
const SIZE: (u32, u32) = (900, 420);

/// A line with its points.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// What it is called.
    pub label: String,
    /// Which colour it has.
    pub colour: usize,
    /// Its points.
    pub points: Vec<(f64, f64)>,
    /// For points of the line: their least and greatest value over the worlds.
    pub ranges: Vec<(f64, [f64; 2])>,
    /// Whether it is thin and without marks: an expectation, not a measurement.
    pub is_thin: bool,
    /// Whether only its marks are drawn: hollow squares.
    pub is_marks: bool,
    /// Whether its points are not joined, because nothing lies between them.
    pub is_apart: bool,
}

/// A chart.
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// Its title.
    pub title: String,
    /// What the axes show, with their units.
    pub axes: [String; 2],
    /// The words along the horizontal axis at 0, 1, 2, …; none for numbers.
    pub words: Vec<String>,
    /// The vertical range, where it does not follow from the data.
    pub y_range: Option<[f64; 2]>,
    /// Its lines.
    pub lines: Vec<Line>,
}

impl Chart {
    /// The chart as the text of an SVG file.
    ///
    /// # Errors
    /// What the drawing library says.
    pub fn svg(&self) -> Result<String, String> {
        let mut text = String::new();
        {
            let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
            area.fill(&WHITE).map_err(|e| e.to_string())?;
            let (plot, legend) = area.split_horizontally(640);
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
        if self.words.len() > MOST_LEVEL_WORDS {
            mesh.x_label_style(("sans-serif", 12).into_font().transform(FontTransform::Rotate90));
        }
        mesh.x_desc(self.axes[0].as_str()).y_desc(self.axes[1].as_str()).light_line_style(TRANSPARENT);
        if !self.words.is_empty() {
            mesh.x_label_formatter(&word).x_labels(2 * self.words.len() + 1);
        }
        mesh.draw().map_err(|e| e.to_string())?;
        self.lines.iter().try_for_each(|line| draw(&mut chart, line, [x, y])).map_err(|e| e.to_string())
    }

    /// What the colours mean, beside the plot so that it hides nothing.
    fn legend(&self, area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>) -> Result<(), String> {
        for (index, line) in self.lines.iter().enumerate() {
            let (y, colour) = (44 + 18 * index as i32, COLOURS[line.colour % COLOURS.len()]);
            let said = if line.is_marks {
                area.draw(&Rectangle::new([(6, y - 4), (14, y + 4)], colour.stroke_width(2)))
            } else {
                let width = if line.is_thin { 1 } else { 3 };
                area.draw(&PathElement::new([(0, y), (20, y)], colour.stroke_width(width)))
            };
            said.map_err(|e| e.to_string())?;
            let text = Text::new(line.label.clone(), (26, y - 7), ("sans-serif", 13));
            area.draw(&text).map_err(|e| e.to_string())?;
        }
        Ok(())
    }

    /// Room below the plot, px.
    fn label_height(&self) -> u32 {
        match self.words.len() {
            0 => 40,
            count if count > MOST_LEVEL_WORDS => 130,
            _ => 56,
        }
    }

    /// The ranges of both axes, with some air.
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

type Plot<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn draw(chart: &mut Plot<'_, '_>, line: &Line, [x, y]: [[f64; 2]; 2]) -> Result<(), String> {
    let colour = COLOURS[line.colour % COLOURS.len()];
    // What left the frame would be bent at its border.
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
    if !line.is_thin {
        let dots = points.iter().map(|&point| Circle::new(point, 4, colour.filled()));
        chart.draw_series(dots).map_err(|e| e.to_string())?;
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
        for word in ["ncc-scale", "paper", "flat", "steep", "<circle", "<polyline", "<rect"] {
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
