//! The record of a step: its row, the stages of all trackers in running order, and the comparison with the truth.
//!
//! ```text
//! RunStep ─► step (the row) ─► visual_odometry ─► the stages of `track::records` ─► truth
//! ```
//! Tables, comparisons, expressions, plots, explanations, logs and pages are views of this list.

mod evidence;

pub use evidence::{evidence, is_pixel, rest};

use std::iter::once;
use std::sync::LazyLock;

use sightline_record::{Column, Quantity, Stage, StageRecord, StageSchema, Unit, Value};

use crate::step::{RunStep, StepRow};

static STAGES: LazyLock<Vec<Stage<RunStep>>> = LazyLock::new(|| {
    let row = Stage::computed("step", "What is the result of the step, in one row?", RunStep::row);
    let stages = sightline_track::records::stages();
    let truth =
        Stage::of("truth", "How far is the estimate from the truth?", |step: &RunStep| step.truth.as_ref())
            .at("truth");
    let stages = stages.into_iter().map(|stage| stage.within(|step: &RunStep| Some(&step.trace), &[""]));
    let odometry = Stage::of(
        "visual_odometry",
        "How did the rover move since the stop before, as its cameras see it?",
        |step: &RunStep| step.odometry.as_deref(),
    )
    .at("odometry");
    [row, odometry].into_iter().chain(stages).chain(once(truth)).collect()
});

static ROW: LazyLock<Stage<StepRow>> = LazyLock::new(|| {
    Stage::of("step", "What is the result of the step, in one row?", |row: &StepRow| Some(row))
});

static COLUMNS: LazyLock<Vec<Column>> = LazyLock::new(|| Column::all(STAGES.iter().map(Stage::schema)));

/// The columns of a table of steps: those of [`StepRow`] first, then the quantities of every stage.
pub fn columns() -> &'static [Column] {
    &COLUMNS
}

/// The first of [`columns`]: those of a row alone.
pub fn row_columns() -> &'static [Column] {
    static COUNT: LazyLock<usize> = LazyLock::new(|| Column::all([ROW.schema()]).len());
    &COLUMNS[..*COUNT]
}

/// The record of a row, for the cells of [`row_columns`].
pub fn row_record(row: &StepRow) -> [StageRecord; 1] {
    [ROW.record(row)]
}

/// The stages of all trackers, in running order.
pub fn stages() -> &'static [Stage<RunStep>] {
    &STAGES
}

/// The stage with this name.
pub fn stage(name: &str) -> Option<&'static Stage<RunStep>> {
    STAGES.iter().find(|stage| stage.schema().stage == name)
}

/// The schemas of all stages, in running order.
pub fn schema() -> Vec<StageSchema> {
    STAGES.iter().map(|stage| stage.schema().clone()).collect()
}

/// The records of a step, in the order of [`schema`].
pub fn records(step: &RunStep) -> Vec<StageRecord> {
    STAGES.iter().map(|stage| stage.record(step)).collect()
}

/// The quantity at a path of the serialised step, for any tracker.
pub(crate) fn quantity_at(path: &str) -> Option<&'static Quantity> {
    within(path).find_map(|(schema, name)| schema.quantity(name))
}

/// The unit of the field at a path of the serialised step: the declared one, else the one that follows from its name.
pub fn unit_at(path: &str) -> Option<Unit> {
    let field = |(schema, name): (&'static StageSchema, &str)| {
        schema.fields.iter().find(|(field, _)| field == name).map(|(_, unit)| *unit)
    };
    let declared = quantity_at(path).map(|quantity| quantity.unit).or_else(|| within(path).find_map(field));
    declared.or_else(|| Unit::of_name(path.rsplit('.').next()?))
}

/// The stages whose evidence contains a path, each with the rest of the path.
fn within(path: &str) -> impl Iterator<Item = (&'static StageSchema, &str)> {
    STAGES.iter().map(Stage::schema).flat_map(move |schema| {
        let rest = move |place: &str| path.strip_prefix(place)?.strip_prefix('.');
        schema.paths().filter_map(rest).map(move |rest| (schema, rest))
    })
}

/// The quantity behind a column of [`StepRow`].
pub fn row_quantity(column: &str) -> Option<&'static Quantity> {
    ROW.schema().quantity(column)
}

/// The number in a column of [`StepRow`].
pub fn row_value(row: &StepRow, column: &str) -> Option<f64> {
    ROW.value_of(row, column)?.number()
}

/// The number in a column of [`StepRow`], converted to another unit of its dimension.
pub fn row_value_in(row: &StepRow, column: &str, unit: Unit) -> Option<f64> {
    let declared = row_quantity(column)?.unit;
    Some(row_value(row, column)? * (unit.per_base() / declared.per_base()))
}

/// A quantity of a stage, for views that show any number of a step.
#[derive(Clone, Copy)]
pub struct StageQuantity {
    stage: &'static Stage<RunStep>,
    index: usize,
}

impl StageQuantity {
    /// Every quantity of the stages that have their own evidence, in running order.
    pub fn all() -> impl Iterator<Item = Self> {
        let stages = STAGES.iter().filter(|stage| !stage.schema().path.is_empty());
        stages.flat_map(|stage| (0..stage.schema().quantities.len()).map(move |index| Self { stage, index }))
    }

    /// The quantity with the name `stage.quantity`, or `step.column` for columns of the row.
    pub fn named(name: &str) -> Option<Self> {
        let (word, name) = name.split_once('.')?;
        let stage = stage(word)?;
        let index = stage.schema().quantities.iter().position(|quantity| quantity.name == name)?;
        Some(Self { stage, index })
    }

    /// The stage.
    pub fn stage(self) -> &'static Stage<RunStep> {
        self.stage
    }

    /// The declaration.
    pub fn declared(self) -> &'static Quantity {
        &self.stage.schema().quantities[self.index]
    }

    /// Its name in expressions, explanations and tables: `stage.quantity`.
    pub fn name(self) -> String {
        format!("{}.{}", self.stage.schema().stage, self.declared().name)
    }

    /// The value at a step; missing if the stage was not reached.
    pub fn value(self, step: &RunStep) -> Value {
        self.stage.value(step, self.index)
    }

    /// The number at a step; `None` if it is missing, not a number, or not finite.
    pub fn number(self, step: &RunStep) -> Option<f64> {
        self.value(step).number().filter(|value| value.is_finite())
    }
}

impl std::fmt::Debug for StageQuantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use sightline_track::settings::Settings;

    #[test]
    fn names_are_unique_within_a_stage_and_arrays_within_the_record() {
        let (mut stages, mut arrays) = (BTreeSet::new(), BTreeSet::new());
        for schema in schema() {
            assert!(stages.insert(schema.stage.clone()), "{} twice", schema.stage);
            let names: BTreeSet<_> = schema.quantities.iter().map(|q| &q.name).collect();
            assert_eq!(names.len(), schema.quantities.len(), "{}", schema.stage);
            assert!(schema.arrays.iter().all(|array| arrays.insert(array.name.clone())), "{}", schema.stage);
        }
    }

    #[test]
    fn every_quantity_is_described_and_its_inputs_exist() {
        let (all, table) = (schema(), Settings::table());
        let keys: Vec<&str> = table.iter().map(|info| info.key.as_ref()).collect();
        for stage in &all {
            for quantity in &stage.quantities {
                let name = format!("{}.{}", stage.stage, quantity.name);
                assert!(quantity.description.ends_with('.'), "{name}: {}", quantity.description);
                for input in &quantity.inputs {
                    let of_other = |other: &StageSchema| {
                        let rest = input.strip_prefix(other.stage.as_ref()).and_then(|r| r.strip_prefix('.'));
                        rest.is_some_and(|rest| other.quantity(rest).is_some())
                    };
                    let is_setting = input.strip_prefix("setting.").is_some_and(|key| keys.contains(&key));
                    let is_known = stage.quantity(input).is_some() || is_setting || all.iter().any(of_other);
                    assert!(is_known, "{name} ← {input}");
                }
            }
        }
    }

    #[test]
    fn the_unit_of_a_field_is_declared_or_in_its_name() {
        assert_eq!(unit_at("locate.evidence.match_template.pixel"), Some(Unit::Pixel));
        assert_eq!(unit_at("locate.evidence.designation.match_template.pixel"), Some(Unit::Pixel));
        assert_eq!(unit_at("locate.evidence.features.fit_motion.roll_pitch_yaw_deg"), Some(Unit::Degree));
        assert_eq!(unit_at("update.target.memory.appearance.camera.C"), Some(Unit::Metre));
        assert_eq!(unit_at("point_mast.left.size_px"), Some(Unit::Pixel));
        assert_eq!(unit_at("predict.nothing"), None);
    }

    #[test]
    fn a_unit_in_a_name_is_the_declared_unit() {
        for stage in schema() {
            for quantity in &stage.quantities {
                if let Some(unit) = Unit::of_name(&quantity.name) {
                    assert_eq!(unit, quantity.unit, "{}.{}", stage.stage, quantity.name);
                }
            }
        }
    }
}
