//! The evidence of the shape tracker at one step as tables: the registration, the depth errors, the coarse search, and the
//! steps of the refinement.

use sightline_track::locate::shape_tracker::evidence::Registered;
use sightline_track::locate::shape_tracker::rows::PathStep;
use sightline_track::trace::ArrayName;

use crate::drawing::raster::Raster;
use crate::panels::shape::search::step_m;
use crate::panels::shape::sensor::error_counts;
use crate::panels::sheets::{Cell, Column, Sheet};
use crate::state::State;

/// The tables of the step's registration; arrays that are not loaded are omitted.
pub(crate) fn shape(state: &State) -> Result<Vec<Sheet>, String> {
    let evidence = state.shape_evidence().ok_or_else(|| state.missing_shape())?;
    let Some(found) = &evidence.registration else {
        let why = evidence.missing.as_ref().unwrap_or(&evidence.why);
        return Err(format!("Nothing was registered at step {}: {why}.", state.cursor.step));
    };
    let mut sheets = vec![numbers(state, found)];
    let array = |name: ArrayName| state.array(name).ready();
    if let Some((before, end)) = array(ArrayName::ERROR_BEFORE).zip(array(ArrayName::ERROR_FINE)) {
        sheets.push(errors(before, end));
    }
    if let Some(raster) = array(ArrayName::COARSE_SEARCH) {
        sheets.push(coarse(raster, step_m(state, found, raster.size()[0])));
    }
    if let Some(path) = state.refine_path().ready().filter(|path| !path.is_empty()) {
        sheets.push(refinement(path));
    }
    Ok(sheets)
}

fn numbers(state: &State, found: &Registered) -> Sheet {
    let columns = ["what", "value", "unit"].map(|name| Column::new(name, "")).to_vec();
    let title = format!("Registration of step {} to step {}", state.cursor.step, found.to_step);
    let mut sheet = Sheet::of(title, columns);
    let mut add = |what: &str, value: Option<f64>, factor: f64, unit: &str| {
        let value = Cell::from(value.map(|value| value * factor));
        sheet.row(false, vec![Cell::Word(what.to_owned()), value, Cell::Word(unit.to_owned())]);
    };
    for (what, mean_m) in
        ["at the start", "after the coarse search", "at the end"].into_iter().zip(found.mean_m)
    {
        add(&format!("mean distance {what}"), mean_m, 1000.0, "mm");
    }
    for (axis, k) in [("Δx", 0), ("Δy", 1), ("Δz", 2)] {
        add(&format!("coarse search, {axis}"), found.coarse_shift_m.map(|shift| shift[k]), 100.0, "cm");
    }
    add("half width of the rock", Some(found.half_width_m), 100.0, "cm");
    add("rotation", Some(found.turn_deg), 1.0, "°");
    add("moved the target by", found.correction_m, 100.0, "cm");
    for (what, k) in [("σ, largest axis", 0), ("σ, middle axis", 1), ("σ, smallest axis", 2)] {
        add(what, found.sigmas_m.map(|sigmas| sigmas[k]), 1000.0, "mm");
    }
    sheet
}

fn errors(before: &Raster, end: &Raster) -> Sheet {
    let columns = [("from", "cm"), ("to", "cm"), ("pixels at the start", ""), ("pixels at the end", "")];
    let columns = columns.map(|(name, unit)| Column::new(name, unit)).to_vec();
    let mut sheet = Sheet::of("Depth errors; the outermost bins include all values beyond them", columns);
    for (from_m, to_m, counts) in error_counts(before, end) {
        let edges = [from_m, to_m].map(|edge_m| Cell::Number(edge_m * 100.0));
        let counts = counts.map(|count| Cell::Number(count as f64));
        sheet.row(false, edges.into_iter().chain(counts).collect());
    }
    sheet
}

fn coarse(raster: &Raster, step_m: f64) -> Sheet {
    let columns = [("Δx", "cm"), ("Δy, down", "cm"), ("mean distance", "mm")];
    let columns = columns.map(|(name, unit)| Column::new(name, unit)).to_vec();
    let mut sheet = Sheet::of("Coarse search: mean distance of the surfaces by shift", columns);
    let [width, height] = raster.size().map(i64::from);
    let places = || (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    let least = places().filter_map(|(x, y)| raster.at(x, y)).fold(f32::INFINITY, f32::min);
    for (column, row) in places() {
        // Shifts with too little overlap have no distance.
        let Some(mean_m) = raster.at(column, row) else { continue };
        let shift = |index: i64, side: i64| Cell::Number((index - side / 2) as f64 * step_m * 100.0);
        let cells = vec![shift(column, width), shift(row, height), Cell::Number(f64::from(mean_m) * 1000.0)];
        sheet.row(mean_m == least, cells);
    }
    sheet
}

fn refinement(path: &[PathStep]) -> Sheet {
    let columns = [
        ("evaluations", ""),
        ("run", ""),
        ("mean distance", "mm"),
        ("shift x", "cm"),
        ("shift y", "cm"),
        ("shift z", "cm"),
        ("rotation x", "°"),
        ("rotation y", "°"),
        ("rotation z", "°"),
    ];
    let columns = columns.map(|(name, unit)| Column::new(name, unit)).to_vec();
    let mut sheet = Sheet::of("Iterations of the refinement, axes of the sensor", columns);
    for (place, step) in path.iter().enumerate() {
        let head = [f64::from(step.evaluations), f64::from(step.run), step.mean_m * 1000.0];
        let values =
            head.into_iter().chain(step.shift_m.map(|m| m * 100.0)).chain(step.turn_rad.map(f64::to_degrees));
        sheet.row(place + 1 == path.len(), values.map(Cell::Number).collect());
    }
    sheet
}
