//! Common parts of charts: axes over the steps, at least three round ticks, and lines broken at missing values.

use egui::Id;
use egui_plot::{GridInput, GridMark, MarkerShape, Plot};

use crate::drawing::decimate;
use crate::drawing::overlay::Mark;
use crate::theme;

/// A plot over the steps, with its x axis linked to the other plots; only the lowest one is labelled with step numbers.
pub(crate) fn over_steps<'a>(plot: Plot<'a>, last: f64, is_last: bool) -> Plot<'a> {
    plot.allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .show_axes([is_last, true])
        .include_x(-0.4)
        .include_x(last + 0.4)
        .grid_color(theme::line())
        .x_grid_spacer(step_marks)
        .y_grid_spacer(few_marks)
        .y_axis_formatter(plain)
        .y_axis_min_width(40.0)
        .x_axis_formatter(|mark: GridMark, _: &std::ops::RangeInclusive<f64>| match mark.value {
            // The first tick names the axis.
            0.0 => "step 0".to_owned(),
            whole if whole.fract() == 0.0 => format!("{whole}"),
            _ => String::new(),
        })
        .link_axis(Id::unique("steps"), [true, false])
}

/// Ticks at the coarsest round spacing that gives at least three, regardless of the plot's height.
pub(crate) fn few_marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let range = (high - low).max(1e-9);
    let decade = 10_f64.powf(range.log10().floor());
    let count = |step: f64| (high / step).floor() - (low / step).ceil() + 1.0;
    let steps = [5.0, 2.5, 2.0, 1.0, 0.5, 0.25, 0.2, 0.1].map(|share| share * decade);
    let step = steps.into_iter().find(|step| count(*step) >= 3.0).unwrap_or(0.1 * decade);
    marks(low, high, step)
}

/// Ticks at whole steps: at most eight, and at least three if the drive has as many steps.
fn step_marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let rounds = (0..9).flat_map(|power| [1.0, 2.0, 5.0].map(|round| round * 10_f64.powi(power)));
    let step = rounds.into_iter().find(|step| (high - low) / step <= 8.0).unwrap_or(1.0);
    marks(low, high, step)
}

fn marks(low: f64, high: f64, step: f64) -> Vec<GridMark> {
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|i| GridMark { value: i as f64 * step, step_size: high - low }).collect()
}

/// The step nearest to a position on the x axis; `None` outside the drive.
pub(crate) fn step_of(x: f64, last: f64) -> Option<usize> {
    let step = x.round();
    (0.0..=last).contains(&step).then_some(step as usize)
}

/// A tick's number without trailing zeros.
pub(crate) fn plain(mark: GridMark, _: &std::ops::RangeInclusive<f64>) -> String {
    format!("{}", (mark.value * 1e6).round() / 1e6)
}

/// The polylines between missing points, each decimated for drawing.
pub(crate) fn polylines(points: &[Option<[f64; 2]>]) -> Vec<Vec<[f64; 2]>> {
    let runs = points.split(Option::is_none);
    let polylines = runs.filter(|run| !run.is_empty()).map(|run| run.iter().copied().flatten().collect());
    polylines.map(decimate::curve).collect()
}

/// The plot marker of a run.
pub(crate) fn shape(mark: Mark) -> MarkerShape {
    match mark {
        Mark::Square => MarkerShape::Square,
        Mark::Triangle => MarkerShape::Up,
        Mark::Diamond => MarkerShape::Diamond,
        _ => MarkerShape::Circle,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_stand_at_few_round_numbers() {
        let values = |low: f64, high: f64| -> Vec<f64> {
            few_marks(GridInput { bounds: (low, high), base_step_size: 1.0 })
                .iter()
                .map(|m| m.value)
                .collect()
        };
        assert_eq!(values(-1.0, 12.3), vec![0.0, 5.0, 10.0]);
        assert_eq!(values(0.0, 1.1), vec![0.0, 0.5, 1.0]);
        assert_eq!(values(-2.0, 43.0), vec![0.0, 20.0, 40.0]);
    }

    #[test]
    fn every_axis_has_three_to_six_ticks() {
        for high in [0.9, 1.05, 1.1, 3.0, 4.9, 9.9, 19.9, 66.0, 238.0, 1e-4] {
            for low in [0.0, -0.1 * high, 0.37 * high] {
                let count = few_marks(GridInput { bounds: (low, high), base_step_size: 1.0 }).len();
                assert!((3..=6).contains(&count), "{low} to {high}: {count}");
            }
        }
        for last in [2.0, 17.0, 59.0, 12_000.0] {
            let count = step_marks(GridInput { bounds: (-0.4, last + 0.4), base_step_size: 1.0 }).len();
            assert!((3..=9).contains(&count), "{last}: {count}");
        }
    }

    #[test]
    fn the_pointer_reads_the_nearest_step() {
        assert_eq!([step_of(3.4, 17.0), step_of(-0.3, 17.0), step_of(18.0, 17.0)], [Some(3), Some(0), None]);
    }

    #[test]
    fn a_line_is_broken_where_there_is_no_value() {
        let points = [None, Some([1.0, 2.0]), Some([2.0, 3.0]), None, Some([4.0, 1.0])];
        assert_eq!(polylines(&points), vec![vec![[1.0, 2.0], [2.0, 3.0]], vec![[4.0, 1.0]]]);
        assert!(polylines(&[None, None]).is_empty());
    }
}
