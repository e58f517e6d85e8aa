//! Rover and target positions, the error budget, and the template's history, as tables by step.

use sightline_geometry::frames::Point3;

use crate::panels::map::convergence::positions;
use crate::panels::sheets::sheet::state_of;
use crate::panels::sheets::{Cell, Column, Sheet};
use crate::state::{State, row_of};

/// The rover and the target at every stop, in the site frame.
pub(crate) fn map(state: &State) -> Result<Vec<Sheet>, String> {
    let Some(traverse) = &state.traverse else { return Err(state.missing_target()) };
    let columns = [
        "rover east",
        "rover north",
        "rover down",
        "true rover east",
        "true rover north",
        "target east",
        "target north",
        "target down",
        "σ east",
        "σ north",
    ];
    let columns = columns.map(|name| Column::new(name, "m")).to_vec();
    let mut sheet = Sheet::over_steps("Map, site frame", columns);
    let targets = state.run().map(|run| positions(run, &traverse.stops)).unwrap_or_default();
    for (step, stop) in traverse.stops.iter().enumerate() {
        let [north, east, down] = stop.site_from_rover.position_m;
        let truth = stop.true_site_from_rover.map(|pose| pose.position_m);
        let target = targets.iter().find(|target| target.step == step);
        let axis = |k: usize| target.map(|target| Point3::from(target.point_in_site)[k]).into();
        let sigma =
            |k: usize| target.and_then(|target| Some(target.from_above?[(k, k)].max(0.0).sqrt())).into();
        let rover = [east, north, down].map(Cell::Number);
        let true_rover = [truth.map(|at| at[1]).into(), truth.map(|at| at[0]).into()];
        let cells = rover.into_iter().chain(true_rover);
        let cells = cells.chain([axis(1), axis(0), axis(2), sigma(0), sigma(1)]);
        sheet.step(step, state.cursor.step, cells);
    }
    Ok(vec![sheet])
}

/// The errors predicted with and without tracking, and the achieved ones.
pub(crate) fn budget(state: &State) -> Result<Vec<Sheet>, String> {
    let run = state.run().ok_or_else(|| state.missing_target())?;
    let columns =
        [("range", "m"), ("3σ without tracking", "cm"), ("3σ with tracking", "cm"), ("achieved", "cm")];
    let columns = columns.map(|(name, unit)| Column::new(name, unit)).to_vec();
    let mut sheet = Sheet::over_steps("Error budget over range", columns);
    for row in &run.rows {
        let cm = |value: Option<f64>| Cell::from(value.map(|m| m * 100.0));
        let cells = [row.range_m.into(), cm(row.budget_without_m), cm(row.budget_with_m), cm(row.err_m)];
        sheet.step(row.step, state.cursor.step, cells);
    }
    Ok(vec![sheet])
}

/// The score of each earlier template in the current view, and its shift from the position of the step.
pub(crate) fn history(state: &State) -> Result<Vec<Sheet>, String> {
    let run = state.run().ok_or_else(|| state.missing_target())?;
    let columns = vec![Column::new("state", ""), Column::new("score", ""), Column::new("shift", "px")];
    let title = format!("Earlier templates in the view of step {}", state.cursor.step);
    let mut sheet = Sheet::over_steps(title, columns);
    for found in state.earlier_templates().ready().unwrap_or_default() {
        let word = row_of(run, found.template_step).map_or(Cell::Nothing, state_of);
        let cells = [word, Cell::Number(found.score), Cell::Number(found.shift_px())];
        sheet.step(found.template_step, state.cursor.step, cells);
    }
    if sheet.rows.is_empty() {
        return Err(format!(
            "No earlier template is compared with the view of step {}: look at the panel first.",
            state.cursor.step
        ));
    }
    Ok(vec![sheet])
}
