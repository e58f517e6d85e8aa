//! The map of a stop: a verdict for every cell of the left image, computed row by row.
//!
//! It is serialised as letters and short numbers, one a cell, row by row from the top: `verdicts` with `g`, `r` and `b`,
//! `reasons` with a letter of [`Aspect`] or `-`, and the measured values. A cell has the verdict of the pixel nearest its
//! centre.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::ground::{Assessment, Ground};
use super::{Aspect, Verdict};
use sightline_geometry::frames::Pixel;
use sightline_track::settings::Changes;

/// The letter of a cell without a reason.
const NONE: char = '-';

/// A map, possibly with only its first rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TrackabilityMap {
    /// The stop.
    pub step: usize,
    /// Side of a cell, px.
    pub cell_px: u32,
    /// Cells in a row.
    pub columns: usize,
    /// Rows of cells.
    pub rows: usize,
    /// The limits that differ from the defaults, by name.
    #[serde(default)]
    #[schema(value_type = Object)]
    pub limits: Changes,
    /// Side of the rated window, px.
    pub template_size_px: u32,
    /// Verdicts of the computed rows: `g` good, `r` risky, `b` bad.
    pub verdicts: String,
    /// Reasons: the letters of `words`, or `-`.
    pub reasons: String,
    /// Measured values of the reasons, in their units.
    pub values: Vec<Option<f32>>,
    /// Distances from the left camera, m.
    pub ranges_m: Vec<Option<f32>>,
    /// The longest safe steps, m.
    pub longest_steps_m: Vec<Option<f32>>,
    /// Names of the letters of the reasons.
    pub words: BTreeMap<String, String>,
}

/// Progress of a map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MapProgress {
    /// Rows of cells done.
    pub k: usize,
    /// Total number of rows of cells; 0 before stereo is done.
    pub n: usize,
    /// Whether the computation has ended.
    pub ended: bool,
    /// Why it ended early, as one sentence.
    pub failed: Option<String>,
    /// The map so far.
    pub map: Option<TrackabilityMap>,
}

/// A cell of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The rated pixel.
    pub pixel: Pixel,
    /// The verdict.
    pub verdict: Verdict,
    /// The reason; `None` if the cell is good.
    pub reason: Option<Aspect>,
    /// The measured value of the reason.
    pub value: Option<f64>,
    /// Distance from the left camera, m.
    pub range_m: Option<f64>,
    /// The longest safe step, m.
    pub longest_step_m: Option<f64>,
}

impl Cell {
    /// Explains the reason in one sentence; `None` if the cell is good.
    pub fn sentence(&self) -> Option<String> {
        self.reason.map(|aspect| aspect.sentence(self.value, self.verdict))
    }
}

/// Rounds to three digits, for short JSON.
fn short(value: Option<f64>) -> Option<f32> {
    let value = value.filter(|value| value.is_finite())?;
    let unit = 10_f64.powi(2 - value.abs().max(1e-6).log10().floor() as i32);
    Some(((value * unit).round() / unit) as f32)
}

impl TrackabilityMap {
    /// A map without rows.
    pub fn empty(ground: &Ground) -> Self {
        let [width, height] = ground.size();
        let cell_px = ground.limits.cell_px.max(2);
        let words = Aspect::ALL.iter().map(|aspect| (aspect.letter().to_string(), aspect.word().to_owned()));
        Self {
            step: ground.step,
            cell_px,
            columns: width.div_ceil(cell_px) as usize,
            rows: height.div_ceil(cell_px) as usize,
            limits: ground.limits.changes(),
            template_size_px: ground.settings.template.template_size_px,
            words: words.collect(),
            ..Self::default()
        }
    }

    /// The whole map of a stop.
    pub fn of(ground: &Ground) -> Self {
        let mut map = Self::empty(ground);
        while map.rows_done() < map.rows {
            let row = map.judge_row(ground, map.rows_done());
            map.add(&row);
        }
        map
    }

    /// Number of computed rows.
    pub fn rows_done(&self) -> usize {
        self.verdicts.len().checked_div(self.columns).unwrap_or(0)
    }

    /// Rates a row of cells.
    pub fn judge_row(&self, ground: &Ground, row: usize) -> Vec<Assessment> {
        let size = ground.size();
        (0..self.columns)
            .into_par_iter()
            .map(|column| ground.assess(self.pixel_of([column, row], size), false))
            .collect()
    }

    /// Adds the next row.
    pub fn add(&mut self, row: &[Assessment]) {
        for cell in row {
            self.verdicts.push(cell.verdict.letter());
            self.reasons.push(cell.reason.map_or(NONE, Aspect::letter));
            self.values.push(short(cell.reason.and(cell.value())));
            self.ranges_m.push(short(cell.range_m));
            self.longest_steps_m.push(short(cell.longest_step_m));
        }
    }

    fn pixel_of(&self, cell: [usize; 2], size: [u32; 2]) -> Pixel {
        let at = |cell: usize, size: u32| {
            let middle = cell as u32 * self.cell_px + self.cell_px / 2;
            f64::from(middle.min(size.saturating_sub(1)))
        };
        Pixel::new(at(cell[0], size[0]), at(cell[1], size[1]))
    }

    /// The cell in a column and a row; `None` if it is not computed.
    pub fn cell(&self, column: usize, row: usize) -> Option<Cell> {
        if column >= self.columns {
            return None;
        }
        let at = row * self.columns + column;
        let number = |values: &[Option<f32>]| values.get(at).copied().flatten().map(f64::from);
        let middle = |cell: usize| f64::from(cell as u32 * self.cell_px + self.cell_px / 2);
        Some(Cell {
            pixel: Pixel::new(middle(column), middle(row)),
            verdict: Verdict::of_letter(*self.verdicts.as_bytes().get(at)?)?,
            reason: self.reasons.as_bytes().get(at).and_then(|letter| Aspect::of_letter(*letter)),
            value: number(&self.values),
            range_m: number(&self.ranges_m),
            longest_step_m: number(&self.longest_steps_m),
        })
    }

    /// The cell of a pixel.
    pub fn at(&self, pixel: Pixel) -> Option<Cell> {
        let index =
            |v: f64| (v >= -0.5 && self.cell_px > 0).then(|| ((v + 0.5) / f64::from(self.cell_px)) as usize);
        self.cell(index(pixel.x)?, index(pixel.y)?)
    }

    /// All computed cells.
    pub fn cells(&self) -> impl Iterator<Item = Cell> {
        (0..self.rows_done())
            .flat_map(move |row| (0..self.columns).filter_map(move |column| self.cell(column, row)))
    }

    /// The good cell nearest to a pixel, among the computed rows.
    pub fn nearest_good(&self, pixel: Pixel) -> Option<Pixel> {
        let good = self.cells().filter(|cell| cell.verdict == Verdict::Good).map(|cell| cell.pixel);
        good.min_by(|a, b| a.distance(pixel).total_cmp(&b.distance(pixel)))
    }

    /// Fractions of good, risky and bad cells among the computed ones.
    pub fn shares(&self) -> [f64; 3] {
        let all = self.verdicts.len().max(1) as f64;
        Verdict::ALL.map(|verdict| self.verdicts.matches(verdict.letter()).count() as f64 / all)
    }
}
