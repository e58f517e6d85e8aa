//! The level of detail of the timeline: maps steps to screen columns, so that the drawing cost does not depend on the
//! drive's length.
//!
//! A column shows the most severe of its steps: a single lost step among a hundred stays visible. Neighbouring columns
//! with the same state are merged into one span, so that there are at most as many spans as columns of [`COLUMN`] points.

use egui::Rangef;

use crate::panels::timeline::Cell;

/// Width of a column, points: the smallest distinguishable one.
pub(crate) const COLUMN: f32 = 2.0;

/// The mapping of steps to screen positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    left: f32,
    width: f32,
    count: usize,
}

impl Scale {
    /// The scale of `count` steps, at least one, over a horizontal screen range.
    pub(crate) fn new(stretch: Rangef, count: usize) -> Self {
        Self { left: stretch.min, width: stretch.span().max(1.0), count: count.max(1) }
    }

    /// Width of a step, points.
    pub(crate) fn step_width(&self) -> f32 {
        self.width / self.count as f32
    }

    /// The left end of a step, points.
    pub(crate) fn left_of(&self, step: usize) -> f32 {
        self.left + self.width * (step as f32 / self.count as f32)
    }

    /// The middle of a step, points.
    pub(crate) fn middle_of(&self, step: usize) -> f32 {
        (self.left_of(step) + self.left_of(step + 1)) / 2.0
    }

    /// The step at a screen position; the nearest one outside the drive.
    pub(crate) fn step_at(&self, x: f32) -> usize {
        let share = f64::from((x - self.left) / self.width).clamp(0.0, 1.0);
        ((share * self.count as f64) as usize).min(self.count - 1)
    }

    /// The number of columns; one per step if steps are wide enough.
    fn columns(&self) -> usize {
        ((self.width / COLUMN) as usize).clamp(1, self.count)
    }

    /// The spans of equal cells.
    pub(crate) fn spans(&self, cell: impl Fn(usize) -> Cell) -> Vec<Span> {
        let columns = self.columns();
        let mut spans: Vec<Span> = Vec::new();
        for column in 0..columns {
            let from = column * self.count / columns;
            let to = ((column + 1) * self.count / columns).max(from + 1);
            let worst = (from..to).map(&cell).max_by_key(|cell| cell.weight()).unwrap_or(Cell::Before);
            match spans.last_mut() {
                Some(last) if last.cell == worst => last.to = to,
                _ => spans.push(Span { from, to, cell: worst }),
            }
        }
        spans
    }

    /// Selects from `steps` (ascending) those at least `gap` points apart, each with the number of steps that it
    /// represents.
    pub(crate) fn thinned(&self, steps: impl IntoIterator<Item = usize>, gap: f32) -> Vec<(usize, usize)> {
        let mut kept: Vec<(usize, usize)> = Vec::new();
        for step in steps {
            match kept.last_mut() {
                Some((last, count)) if self.middle_of(step) - self.middle_of(*last) < gap => *count += 1,
                _ => kept.push((step, 1)),
            }
        }
        kept
    }
}

/// A span of steps with the same state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Span {
    /// The first step.
    pub from: usize,
    /// The first step after the span.
    pub to: usize,
    /// The state of its steps.
    pub cell: Cell,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale(count: usize) -> Scale {
        Scale::new(Rangef::new(100.0, 1100.0), count)
    }

    #[test]
    fn a_place_and_its_step_belong_together() {
        for count in [1, 17, 999, 10_000] {
            let scale = scale(count);
            for step in (0..count).step_by(count.div_ceil(50)) {
                assert_eq!(scale.step_at(scale.middle_of(step)), step, "{step} of {count}");
            }
            assert_eq!((scale.step_at(-5.0), scale.step_at(9e9)), (0, count - 1));
        }
    }

    #[test]
    fn spans_cover_every_step_once_and_are_no_more_than_columns() {
        let states = [Cell::Tracking, Cell::Lost, Cell::Failed];
        for count in [1, 60, 499, 501, 10_000, 123_457] {
            let spans = scale(count).spans(|step| states[step % 3]);
            assert!(spans.len() <= 500, "{count}: {}", spans.len());
            assert_eq!((spans[0].from, spans[spans.len() - 1].to), (0, count));
            assert!(spans.windows(2).all(|pair| pair[0].to == pair[1].from));
        }
    }

    #[test]
    fn one_lost_step_among_ten_thousand_is_seen() {
        let spans = scale(10_000).spans(|step| if step == 4321 { Cell::Lost } else { Cell::Tracking });
        assert_eq!(spans.len(), 3);
        assert!(spans[1].cell == Cell::Lost && (spans[1].from..spans[1].to).contains(&4321));
        let few = scale(60).spans(|step| if step == 7 { Cell::Failed } else { Cell::Tracking });
        assert_eq!(few[1], Span { from: 7, to: 8, cell: Cell::Failed });
    }

    #[test]
    fn marks_that_would_touch_are_one_with_their_count() {
        assert_eq!(scale(10).thinned([2, 5], 8.0), [(2, 1), (5, 1)]);
        let thinned = scale(10_000).thinned(0..10_000, 8.0);
        assert!(thinned.len() <= 126, "{}", thinned.len());
        assert_eq!(thinned.iter().map(|(_, count)| count).sum::<usize>(), 10_000);
    }
}
