//! The consistency of the covariances as tables: NEES and NIS by step, and the coverage.

use std::collections::BTreeMap;

use sightline_session::compare::RunName;
use sightline_session::metrics::uncertainty::{Consistency, Uncertainty};

use crate::panels::sheets::{Cell, Column, Sheet};
use crate::state::State;

/// NEES and NIS of the run and the runs compared with it, and the share of errors within k σ.
pub(crate) fn uncertainty(state: &State) -> Result<Vec<Sheet>, String> {
    let own = state.own_name().ok_or_else(|| state.missing_target())?;
    let names: Vec<RunName> =
        std::iter::once(own).chain(state.others().iter().map(|other| other.name)).collect();
    let shown: Vec<(RunName, &Uncertainty)> =
        names.iter().filter_map(|&name| Some((name, &state.metrics(name)?.uncertainty))).collect();
    if shown.is_empty() {
        let why = state.metrics_problem(own).unwrap_or("The metrics of the run are being computed …");
        return Err(why.to_owned());
    }
    Ok(vec![over_steps(state, &shown), coverage(state, &shown)])
}

fn over_steps(state: &State, shown: &[(RunName, &Uncertainty)]) -> Sheet {
    type CovariancePart = (&'static str, fn(&Uncertainty) -> &Consistency);
    const PARTS: [CovariancePart; 2] = [("NEES", |found| &found.nees), ("NIS", |found| &found.nis)];
    let mut columns = Vec::new();
    let mut values: BTreeMap<usize, Vec<Cell>> = BTreeMap::new();
    let count = 2 * PARTS.len() * shown.len();
    for (name, found) in shown {
        for (title, of) in PARTS {
            let [low, high] = of(found).band_of_one;
            let run = state.run_label(*name);
            columns.push(Column::new(format!("{title}, {run}"), ""));
            columns.push(Column::new(format!("in {low:.2} to {high:.1}"), ""));
            for step in &of(found).steps {
                let Some(own) = state.own_aligned_step(*name, step.step) else { continue };
                let row = values.entry(own).or_insert_with(|| vec![Cell::Nothing; count]);
                let is_inside = (low..=high).contains(&step.value);
                row[columns.len() - 2] = Some(step.value).into();
                row[columns.len() - 1] = Cell::Word(if is_inside { "yes" } else { "no" }.to_owned());
            }
        }
    }
    let mut sheet = Sheet::over_steps("NEES and NIS by step", columns);
    for (step, cells) in values {
        sheet.step(step, state.cursor.step, cells);
    }
    sheet
}

fn coverage(state: &State, shown: &[(RunName, &Uncertainty)]) -> Sheet {
    let mut columns = vec![Column::new("within", "σ"), Column::new("expected", "%")];
    columns.extend(shown.iter().map(|(name, _)| Column::new(state.run_label(*name), "%")));
    let mut sheet = Sheet::of("Coverage: share of the steps", columns);
    let longest = shown.iter().map(|(_, found)| &found.coverage).max_by_key(|coverage| coverage.len());
    for point in longest.into_iter().flatten() {
        let share = |found: &Uncertainty| {
            found.coverage.iter().find(|other| other.sigmas == point.sigmas).map(|other| other.share * 100.0)
        };
        let mut cells = vec![Cell::Number(point.sigmas), Cell::Number(point.expected * 100.0)];
        cells.extend(shown.iter().map(|(_, found)| Cell::from(share(found))));
        sheet.row(false, cells);
    }
    sheet
}
