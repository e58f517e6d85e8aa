//! What charts share: axes over the steps, few round ticks, and lines that are broken where there is no value.

use egui::Id;
use egui_plot::{GridInput, GridMark, MarkerShape, Plot};

use crate::drawing::decimate;
use crate::drawing::overlay::Mark;

/// A plot over the steps, which moves with its neighbours; only the lowest one has numbers of steps.
pub(crate) fn over_steps<'a>(plot: Plot<'a>, last: f64, is_last: bool) -> Plot<'a> {
    plot.allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .show_axes([is_last, true])
        .include_x(-0.4)
        .include_x(last + 0.4)
        .y_axis_min_width(30.0)
        .x_axis_formatter(
            |mark: GridMark, _: &std::ops::RangeInclusive<f64>| {
                if mark.value.fract() == 0.0 { format!("{}", mark.value) } else { String::new() }
            },
        )
        .link_axis(Id::unique("steps"), [true, false])
}

/// Two to four ticks at round numbers, however low a plot is.
pub(crate) fn few_marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let wanted = (high - low).max(1e-9) / 2.5;
    let decade = 10_f64.powf(wanted.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|step| *step >= wanted);
    let step = step.unwrap_or(10.0 * decade);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|i| GridMark { value: i as f64 * step, step_size: high - low }).collect()
}

/// A tick's number with the digits that it needs.
pub(crate) fn plain(mark: GridMark, _: &std::ops::RangeInclusive<f64>) -> String {
    format!("{}", (mark.value * 1e6).round() / 1e6)
}

/// The runs of consecutive points, each no longer than its curve needs.
pub(crate) fn pieces(points: &[Option<[f64; 2]>]) -> Vec<Vec<[f64; 2]>> {
    let runs = points.split(Option::is_none);
    let pieces = runs.filter(|run| !run.is_empty()).map(|run| run.iter().copied().flatten().collect());
    pieces.map(decimate::curve).collect()
}

/// The plotted shape of a run's mark.
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
        assert_eq!(values(-1.0, 12.3), vec![0.0, 10.0]);
        assert_eq!(values(0.0, 1.1), vec![0.0, 0.5, 1.0]);
        assert_eq!(values(-2.0, 43.0), vec![0.0, 20.0, 40.0]);
    }

    #[test]
    fn a_line_is_broken_where_there_is_no_value() {
        let points = [None, Some([1.0, 2.0]), Some([2.0, 3.0]), None, Some([4.0, 1.0])];
        assert_eq!(pieces(&points), vec![vec![[1.0, 2.0], [2.0, 3.0]], vec![[4.0, 1.0]]]);
        assert!(pieces(&[None, None]).is_empty());
    }
}
