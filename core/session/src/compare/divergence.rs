//! The first difference of two runs: step, stage and value.
//!
//! Stages are compared in running order, so that the cause is found rather than its consequences: a run forked with another
//! search window differs first in `match_template` of its fork step. Data that stages pass on without recording it (images,
//! stored templates) shows in the first stage that uses it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use utoipa::ToSchema;

use super::differ::{self, Difference, Tolerance};
use super::stages::{PLACES, Place};
use super::{Compared, Moment, RunName};
use crate::step::RunStep;
use sightline_record::{ArrayDecl, ArrayKind, ArrayView};
use sightline_track::records;

/// Maximum number of listed values of a stage.
const VALUES_MAX: usize = 40;

/// The first difference of a run from the first run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FirstDivergence {
    /// The run.
    pub run: RunName,
    /// Number of compared stops.
    pub compared: usize,
    /// The first difference; null if they do not differ.
    pub divergence: Option<Divergence>,
    /// The result as one sentence.
    pub sentence: String,
}

/// The first stage in which two runs differ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Divergence {
    /// The stop of the first run.
    pub step: usize,
    /// The stop of the other run.
    pub other_step: usize,
    /// The stage.
    pub stage: String,
    /// The step of `locate`; null for other stages.
    pub part: Option<String>,
    /// The differing values, the most informative first.
    pub values: Vec<Difference>,
    /// Number of differing values in this stage.
    pub count: usize,
}

/// Finds the first difference of run `other` from run 0.
pub(crate) fn first(
    runs: &[Compared],
    other: usize,
    moments: &[Moment],
    tolerance: &Tolerance,
) -> FirstDivergence {
    let (a, b) = (&runs[0], &runs[other]);
    let mut compared = 0;
    let mut divergence = None;
    for moment in moments {
        let steps =
            moment.steps[0].and_then(|step| a.step(step)).zip(moment.steps[other].and_then(|s| b.step(s)));
        let Some((left, right)) = steps else { continue };
        compared += 1;
        // A fork shares its earlier steps by pointer.
        if !Arc::ptr_eq(left, right) {
            divergence = of_step(left, right, tolerance);
        }
        if divergence.is_some() {
            break;
        }
    }
    let sentence = sentence(divergence.as_ref(), compared);
    FirstDivergence { run: b.name, compared, divergence, sentence }
}

/// Finds the first stage in which two steps differ.
pub(crate) fn of_step(a: &RunStep, b: &RunStep, tolerance: &Tolerance) -> Option<Divergence> {
    PLACES.iter().find_map(|place| {
        let mut values = of_place(place, a, b, tolerance);
        let count = values.len();
        values.truncate(VALUES_MAX);
        (count > 0).then(|| Divergence {
            step: a.step,
            other_step: b.step,
            stage: place.stage.to_owned(),
            part: place.part.map(str::to_owned),
            values,
            count,
        })
    })
}

/// The differing values of a stage, the most informative first.
fn of_place(place: &Place, a: &RunStep, b: &RunStep, tolerance: &Tolerance) -> Vec<Difference> {
    let mut values = differ::differences(&(place.record)(a), &(place.record)(b), tolerance);
    values.extend(place.arrays().filter_map(|array| of_array(array, a, b, tolerance)));
    let rank = |value: &Difference| {
        // A changed limit is more informative than the decisions that follow from it.
        let is_limit = value.path.ends_with(".limit");
        let telling = place.telling().iter().position(|beginning| value.path.starts_with(beginning));
        (!is_limit, telling.unwrap_or(place.telling().len()))
    };
    values.sort_by_key(rank);
    values
}

/// The difference of an array: in size, else in the first differing value.
fn of_array(array: &ArrayDecl, a: &RunStep, b: &RunStep, tolerance: &Tolerance) -> Option<Difference> {
    let (name, unit) = (array.name.as_ref(), array.unit.symbol());
    let path = format!("arrays.{name}");
    let different = |a: Value, b: Value, delta: Option<f64>, path: String| {
        Some(Difference { path, unit: delta.map_or("", |_| unit).to_owned(), a, b, delta })
    };
    let (left, right) = match (records::array(a, name), records::array(b, name)) {
        (Some(left), Some(right)) => (left, right),
        (None, None) => return None,
        (left, right) => {
            let there = |view: Option<ArrayView<'_>>| view.map_or(Value::Null, |view| size_of(&view).into());
            return different(there(left), there(right), None, path);
        }
    };
    if left.size() != right.size() {
        return different(size_of(&left).into(), size_of(&right).into(), None, path);
    }
    // The columns of a table have different units, so only an exact comparison is possible.
    if matches!(array.kind, ArrayKind::Table | ArrayKind::Mesh) && !tolerance.is_exact() {
        return None;
    }
    let is_alike = |a: f32, b: f32| {
        a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()) || tolerance.holds(unit, a.into(), b.into())
    };
    let mut pairs = left.values().iter().zip(right.values());
    let at = pairs.position(|(a, b)| !is_alike(*a, *b))?;
    let (a, b) = (left.values()[at], right.values()[at]);
    let columns = left.size()[0].max(1) as usize;
    let path = format!("{path}.row {} column {}", at / columns, at % columns);
    different(json!(a), json!(b), Some(f64::from(b) - f64::from(a)).filter(|d| d.is_finite()), path)
}

fn size_of(view: &ArrayView<'_>) -> String {
    let [width, height] = view.size();
    format!("{width} × {height}")
}

fn sentence(divergence: Option<&Divergence>, compared: usize) -> String {
    let Some(found) = divergence else {
        return match compared {
            0 => "cannot be compared: no two stops are aligned".to_owned(),
            1 => "do not differ at the one compared stop".to_owned(),
            count => format!("do not differ at any of the {count} compared stops"),
        };
    };
    let place = found.part.as_ref().unwrap_or(&found.stage);
    let beside = match found.step == found.other_step {
        true => String::new(),
        false => format!(" (step {} of the other)", found.other_step),
    };
    let value = found.values.first().map_or_else(String::new, |value| {
        let [a, b] = differ::told_apart(&value.a, &value.b);
        let line = format!(": {} {a} and {b} {}", differ::words_of(&value.path), value.unit);
        line.trim_end().to_owned()
    });
    format!("first differ at step {}{beside} in {place}{value}", found.step)
}
