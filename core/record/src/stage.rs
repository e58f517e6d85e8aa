//! A stage of a step: declarations of evidence types, with functions that get the evidence from the step.

use std::borrow::Cow;

use serde::Serialize;

use super::{ArrayView, Declaration, Record, StageRecord, StageSchema, Value};

/// A stage of the step type `S`; the evidence types are erased.
pub struct Stage<S> {
    schema: StageSchema,
    parts: Vec<Part<S>>,
    evidence: Option<Evidence<S>>,
}

/// Serialises the evidence of a step.
type Evidence<S> = Box<dyn Fn(&S) -> Option<serde_json::Value> + Send + Sync>;

/// One declaration of the stage, with the indices of its first quantity and array in the schema.
struct Part<S> {
    first_quantity: usize,
    first_array: usize,
    reader: Box<dyn Read<S> + Send + Sync>,
}

/// Reads one declaration from a step of type `S`; erases the evidence type.
trait Read<S> {
    fn is_reached(&self, step: &S) -> bool;
    fn value(&self, step: &S, index: usize) -> Option<Value>;
    fn array<'a>(&self, step: &'a S, index: usize) -> Option<ArrayView<'a>>;
    fn record(&self, step: Option<&S>) -> StageRecord;
}

/// Evidence that is a part of the step.
struct Borrowed<S, E> {
    find: for<'a> fn(&'a S) -> Option<&'a E>,
    declaration: Declaration<E>,
}

/// Evidence that is computed from the step.
struct Computed<S, E> {
    make: fn(&S) -> E,
    declaration: Declaration<E>,
}

/// Evidence of a step of type `S` that is a part of a `T`.
struct Within<T, S> {
    find: for<'a> fn(&'a T) -> Option<&'a S>,
    reader: Box<dyn Read<S> + Send + Sync>,
}

impl<S: 'static> Stage<S> {
    /// A stage whose evidence is a part of the step.
    pub fn of<E: Record + Serialize>(
        name: &'static str,
        question: &'static str,
        find: for<'a> fn(&'a S) -> Option<&'a E>,
    ) -> Self {
        let evidence: Evidence<S> = Box::new(move |step| serde_json::to_value(find(step)?).ok());
        Self { evidence: Some(evidence), ..Self::of_parts(name, question).with(find, E::declare) }
    }

    /// A stage whose quantities are computed from the step; it has no arrays.
    pub fn computed<E: Record>(name: &'static str, question: &'static str, make: fn(&S) -> E) -> Self {
        let declaration = Declaration::by(E::declare);
        let mut stage = Self::of_parts(name, question);
        let schema = declaration.schema.clone();
        stage.add(schema, Box::new(Computed { make, declaration }));
        stage
    }

    /// Adds a declaration of evidence that is stored elsewhere in the step.
    #[must_use]
    pub fn with<E: 'static>(
        mut self,
        find: for<'a> fn(&'a S) -> Option<&'a E>,
        declare: fn(&mut Declaration<E>),
    ) -> Self {
        let declaration = Declaration::by(declare);
        let schema = declaration.schema.clone();
        self.add(schema, Box::new(Borrowed { find, declaration }));
        self
    }

    /// Sets the path of its evidence in the serialised step; a second call adds a path for the steps of another tracker.
    #[must_use]
    pub fn at(mut self, path: impl Into<Cow<'static, str>>) -> Self {
        if self.schema.path.is_empty() {
            self.schema.path = path.into();
        } else {
            self.schema.other_paths.push(path.into());
        }
        self
    }

    /// A stage without declarations; [`Self::with`] adds them.
    pub fn of_parts(name: &'static str, question: &'static str) -> Self {
        let schema = StageSchema { stage: name.into(), question: question.into(), ..StageSchema::default() };
        Self { schema, parts: Vec::new(), evidence: None }
    }

    /// The same stage for a type `T` that contains `S` at one of the paths `at`; an empty path means that it is not nested.
    #[must_use]
    pub fn within<T: 'static>(
        self,
        find: for<'a> fn(&'a T) -> Option<&'a S>,
        at: &[&'static str],
    ) -> Stage<T> {
        let parts = self.parts.into_iter().map(|Part { first_quantity, first_array, reader }| {
            let reader = Box::new(Within { find, reader });
            Part { first_quantity, first_array, reader }
        });
        let evidence =
            self.evidence.map(|evidence| -> Evidence<T> { Box::new(move |step| evidence(find(step)?)) });
        let paths: Vec<Cow<'static, str>> = at
            .iter()
            .flat_map(|at| self.schema.paths().map(move |path| joined(at, path)))
            .map(Cow::Owned)
            .collect();
        let mut stage = Stage { schema: self.schema, parts: parts.collect(), evidence };
        let mut paths = paths.into_iter();
        stage.schema.path = paths.next().unwrap_or_default();
        stage.schema.other_paths = paths.collect();
        stage
    }

    fn add(&mut self, part: StageSchema, reader: Box<dyn Read<S> + Send + Sync>) {
        let schema = &mut self.schema;
        let (first_quantity, first_array) = (schema.quantities.len(), schema.arrays.len());
        schema.quantities.extend(part.quantities);
        schema.fields.extend(part.fields);
        schema.arrays.extend(part.arrays);
        schema.gates.extend(part.gates);
        self.parts.push(Part { first_quantity, first_array, reader });
    }

    /// The schema.
    pub fn schema(&self) -> &StageSchema {
        &self.schema
    }

    /// Whether the step reached the stage, which means that the evidence of its first declaration exists.
    pub fn is_reached(&self, step: &S) -> bool {
        self.parts.first().is_some_and(|part| part.reader.is_reached(step))
    }

    /// The value of the quantity at `index` of the schema; missing if the stage was not reached.
    pub fn value(&self, step: &S, index: usize) -> Value {
        let part = self.parts.iter().rev().find(|part| part.first_quantity <= index);
        part.and_then(|part| part.reader.value(step, index - part.first_quantity)).unwrap_or_default()
    }

    /// The value of the quantity with this name; `None` if the stage declares no such quantity.
    pub fn value_of(&self, step: &S, name: &str) -> Option<Value> {
        let index = self.schema.quantities.iter().position(|quantity| quantity.name == name)?;
        Some(self.value(step, index))
    }

    /// The serialised evidence of a step, without arrays; `None` if the stage was not reached or has no evidence of its own.
    pub fn evidence(&self, step: &S) -> Option<serde_json::Value> {
        self.evidence.as_ref()?(step)
    }

    /// The array with this name; `None` if it is not declared or does not exist at this step.
    pub fn array<'a>(&self, step: &'a S, name: &str) -> Option<ArrayView<'a>> {
        let index = self.schema.arrays.iter().position(|array| array.name == name)?;
        let part = self.parts.iter().rev().find(|part| part.first_array <= index)?;
        part.reader.array(step, index - part.first_array)
    }

    /// The plain values of a step.
    pub fn record(&self, step: &S) -> StageRecord {
        let mut whole = StageRecord { reached: self.is_reached(step), ..StageRecord::default() };
        for part in &self.parts {
            let record = part.reader.record(Some(step));
            whole.values.extend(record.values);
            whole.arrays.extend(record.arrays);
            whole.gates.extend(record.gates);
            whole.reason = whole.reason.or(record.reason);
        }
        whole
    }
}

impl<E: 'static> Declaration<E> {
    fn by(declare: fn(&mut Self)) -> Self {
        let mut declaration = Self::default();
        declare(&mut declaration);
        declaration
    }

    /// The record of an instance, or of a stage that was not reached.
    fn record(&self, evidence: Option<&E>) -> StageRecord {
        let Some(evidence) = evidence else {
            return StageRecord {
                values: vec![Value::Missing; self.values.len()],
                arrays: vec![None; self.arrays.len()],
                ..StageRecord::default()
            };
        };
        StageRecord {
            reached: true,
            values: self.values.iter().map(|value| value(evidence)).collect(),
            arrays: self.arrays.iter().map(|array| array(evidence).map(|view| view.size())).collect(),
            gates: self.gates.iter().flat_map(|gates| gates(evidence)).collect(),
            reason: self.reason.as_ref().and_then(|reason| reason(evidence)),
        }
    }
}

impl<S: 'static, E: 'static> Read<S> for Borrowed<S, E> {
    fn is_reached(&self, step: &S) -> bool {
        (self.find)(step).is_some()
    }

    fn value(&self, step: &S, index: usize) -> Option<Value> {
        Some(self.declaration.values.get(index)?((self.find)(step)?))
    }

    fn array<'a>(&self, step: &'a S, index: usize) -> Option<ArrayView<'a>> {
        self.declaration.arrays.get(index)?((self.find)(step)?)
    }

    fn record(&self, step: Option<&S>) -> StageRecord {
        self.declaration.record(step.and_then(self.find))
    }
}

impl<S: 'static, E: 'static> Read<S> for Computed<S, E> {
    fn is_reached(&self, _: &S) -> bool {
        true
    }

    fn value(&self, step: &S, index: usize) -> Option<Value> {
        Some(self.declaration.values.get(index)?(&(self.make)(step)))
    }

    fn array<'a>(&self, _: &'a S, _: usize) -> Option<ArrayView<'a>> {
        None
    }

    fn record(&self, step: Option<&S>) -> StageRecord {
        self.declaration.record(step.map(self.make).as_ref())
    }
}

impl<T: 'static, S: 'static> Read<T> for Within<T, S> {
    fn is_reached(&self, step: &T) -> bool {
        (self.find)(step).is_some_and(|found| self.reader.is_reached(found))
    }

    fn value(&self, step: &T, index: usize) -> Option<Value> {
        self.reader.value((self.find)(step)?, index)
    }

    fn array<'a>(&self, step: &'a T, index: usize) -> Option<ArrayView<'a>> {
        self.reader.array((self.find)(step)?, index)
    }

    fn record(&self, step: Option<&T>) -> StageRecord {
        self.reader.record(step.and_then(self.find))
    }
}

/// Joins two paths, either of which may be empty.
fn joined(at: &str, path: &str) -> String {
    match (at, path) {
        ("", path) => path.to_owned(),
        (at, "") => at.to_owned(),
        (at, path) => format!("{at}.{path}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArrayKind, GateRecord, Kind, Side, Unit};
    use sightline_geometry::frames::Pixel;

    #[derive(Serialize)]
    struct Found {
        pixel: Pixel,
        #[serde(skip)]
        scores: Vec<f32>,
    }

    struct Step {
        found: Option<Found>,
    }

    impl Record for Found {
        fn declare(r: &mut Declaration<Self>) {
            r.quantity("pixel", Unit::Pixel, |f| f.pixel).describe("The match.");
            r.quantity("best", Unit::One, |f| f.scores.iter().copied().reduce(f32::max))
                .formula("max score", &["scores"]);
            r.array("scores", ArrayKind::ScoreMap, "Scores.", |f| ArrayView::new(2, &f.scores));
            r.gate("best", Unit::One, Side::AtLeast, "limits.best_min");
            r.gates(|f| {
                vec![GateRecord {
                    name: "best".to_owned(),
                    value: f.scores.first().map(|&s| s.into()),
                    limit: 0.5,
                }]
            });
        }
    }

    fn stage() -> Stage<Step> {
        Stage::of("find", "Where is it?", |step: &Step| step.found.as_ref()).at("locate.find")
    }

    #[test]
    fn one_declaration_gives_schema_and_values() {
        let stage = stage();
        let schema = stage.schema();
        assert_eq!((schema.stage.as_ref(), schema.path.as_ref()), ("find", "locate.find"));
        assert_eq!(schema.quantity("pixel").unwrap().kind, Kind::Pixel);
        assert_eq!(schema.quantity("pixel").unwrap().columns(), ["pixel.x", "pixel.y"]);
        assert_eq!(schema.quantity("best").unwrap().inputs, ["scores"]);
        let step =
            Step { found: Some(Found { pixel: Pixel::new(1.5, 2.0), scores: vec![0.25, 0.75, 0.5, 0.0] }) };
        let record = stage.record(&step);
        assert_eq!(record.values, [Value::Components(vec![1.5, 2.0]), Value::Number(0.75)]);
        assert_eq!(record.arrays, [Some([2, 2])]);
        assert_eq!(stage.evidence(&step), Some(serde_json::json!({ "pixel": { "x": 1.5, "y": 2.0 } })));
        assert_eq!(stage.array(&step, "scores").unwrap().values()[1], 0.75);
        assert_eq!((record.gates[0].value, record.gates[0].limit), (Some(0.25), 0.5));
    }

    #[test]
    fn a_stage_that_was_not_reached_has_missing_values() {
        let record = stage().record(&Step { found: None });
        assert!(!record.reached);
        assert_eq!(record.values, [Value::Missing, Value::Missing]);
        assert_eq!((record.arrays, record.gates.len()), (vec![None], 0));
        assert!(stage().array(&Step { found: None }, "scores").is_none());
        assert_eq!(stage().evidence(&Step { found: None }), None);
    }

    #[test]
    fn evidence_of_two_places_makes_one_stage() {
        fn more(r: &mut Declaration<Step>) {
            r.quantity("count", Unit::One, |step| step.found.as_ref().map(|f| f.scores.len()));
            r.array("row", ArrayKind::Table, "Scores.", |step| {
                step.found.as_ref().map_or(ArrayView::new(0, &[]), |f| ArrayView::new(4, &f.scores))
            });
        }
        let stage = stage().with(|step| Some(step), more);
        let step = Step { found: Some(Found { pixel: Pixel::new(0.0, 0.0), scores: vec![0.0; 4] }) };
        assert_eq!(stage.value_of(&step, "count"), Some(Value::Count(4)));
        assert_eq!(stage.value(&step, 1), Value::Number(0.0), "of the first evidence");
        assert_eq!(stage.record(&step).arrays, [Some([2, 2]), Some([4, 1])]);
        assert_eq!(stage.array(&step, "row").unwrap().size(), [4, 1]);
        assert_eq!(stage.value_of(&step, "nothing"), None);
    }

    #[test]
    fn a_stage_of_a_contained_step_is_unchanged() {
        struct Whole {
            step: Step,
        }
        fn more(r: &mut Declaration<Step>) {
            r.quantity("two", Unit::One, |_| 2_usize);
        }
        let own = || stage().with(|step| Some(step), more);
        let within = own().within(|whole: &Whole| Some(&whole.step), &[""]);
        for found in [None, Some(Found { pixel: Pixel::new(1.5, 2.0), scores: vec![0.25; 4] })] {
            let whole = Whole { step: Step { found } };
            assert_eq!(within.schema(), own().schema());
            assert_eq!(within.record(&whole), own().record(&whole.step));
            assert_eq!(within.evidence(&whole), own().evidence(&whole.step));
            assert_eq!(within.value_of(&whole, "two"), own().value_of(&whole.step, "two"));
            let size = within.array(&whole, "scores").map(|array| array.size());
            assert_eq!(size, own().array(&whole.step, "scores").map(|array| array.size()));
        }
    }

    #[test]
    fn a_schema_survives_its_serialised_form() {
        let text = serde_json::to_string(stage().schema()).unwrap();
        assert_eq!(&serde_json::from_str::<StageSchema>(&text).unwrap(), stage().schema());
    }
}
