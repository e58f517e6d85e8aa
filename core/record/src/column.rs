//! Columns of tables: every quantity of a schema as one column, or one per component.

use super::{Kind, StageRecord, StageSchema, Unit, Value};

/// A column of a table with a row per step.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The path of the value: `stage.quantity.component`; without the stage for quantities of the whole step.
    pub name: String,
    /// The name in files: the path with underscores for dots, followed by the unit.
    pub header: String,
    /// The unit.
    pub unit: Unit,
    /// The kind of a cell; a component is a number.
    pub kind: Kind,
    stage: usize,
    quantity: usize,
    component: Option<usize>,
}

impl Column {
    /// The columns of all quantities of the stages, in declaration order.
    pub fn all<'a>(schema: impl IntoIterator<Item = &'a StageSchema>) -> Vec<Self> {
        let mut columns = Vec::new();
        for (index, stage) in schema.into_iter().enumerate() {
            for (quantity, declared) in stage.quantities.iter().enumerate() {
                let prefix = if stage.path.is_empty() { String::new() } else { format!("{}.", stage.stage) };
                let parts = declared.kind.components();
                for (part, name) in declared.columns().into_iter().enumerate() {
                    let name = prefix.clone() + &name;
                    columns.push(Self {
                        header: header(&name, declared.unit),
                        name,
                        unit: declared.unit,
                        kind: if parts.is_empty() { declared.kind } else { Kind::Number },
                        stage: index,
                        quantity,
                        component: (!parts.is_empty()).then_some(part),
                    });
                }
            }
        }
        columns
    }

    /// The value of this column at a step; non-finite numbers are [`Value::Missing`].
    pub fn cell(&self, records: &[StageRecord]) -> Value {
        let Some(value) = records.get(self.stage).and_then(|record| record.values.get(self.quantity)) else {
            return Value::Missing;
        };
        let value = match self.component {
            Some(component) => value.component(component).map_or(Value::Missing, Value::Number),
            None => value.clone(),
        };
        match value {
            Value::Number(number) if !number.is_finite() => Value::Missing,
            value => value,
        }
    }
}

fn header(name: &str, unit: Unit) -> String {
    let name = name.replace('.', "_");
    let ending = format!("_{}", unit.word());
    let is_name = unit.word().chars().all(char::is_alphanumeric) && unit != Unit::One;
    if is_name && !name.ends_with(&ending) { name + &ending } else { name }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Declaration, Record, Stage};
    use sightline_geometry::frames::Pixel;

    #[derive(serde::Serialize)]
    struct Step {
        pixel: Option<Pixel>,
        roll_deg: f64,
    }

    impl Record for Step {
        fn declare(r: &mut Declaration<Self>) {
            r.quantity("roll_deg", Unit::Degree, |s| s.roll_deg);
            r.quantity("pixel", Unit::Pixel, |s| s.pixel);
        }
    }

    #[test]
    fn a_column_has_the_path_the_unit_and_the_value() {
        let find: fn(&Step) -> Option<&Step> = |step| Some(step);
        let stages = [Stage::of("step", "", find), Stage::of("match", "", find).at("locate.match")];
        let columns = Column::all(stages.iter().map(Stage::schema));
        let names: Vec<_> = columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!(
            names,
            ["roll_deg", "pixel.x", "pixel.y", "match.roll_deg", "match.pixel.x", "match.pixel.y"]
        );
        assert_eq!(columns[0].header, "roll_deg");
        assert_eq!((columns[5].header.as_str(), columns[5].kind), ("match_pixel_y_px", Kind::Number));
        let cells = |step: &Step| {
            let records: Vec<_> = stages.iter().map(|stage| stage.record(step)).collect();
            columns.iter().map(|column| column.cell(&records)).collect::<Vec<_>>()
        };
        let found = cells(&Step { pixel: Some(Pixel::new(1.0, 2.5)), roll_deg: f64::NAN });
        assert_eq!((&found[0], &found[5]), (&Value::Missing, &Value::Number(2.5)));
        assert_eq!(cells(&Step { pixel: None, roll_deg: 3.0 })[1], Value::Missing);
    }
}
