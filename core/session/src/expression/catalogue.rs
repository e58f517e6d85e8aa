//! The catalogue of names that an expression can use, with unit, meaning and stage; the basis of checking, completion and
//! documentation.
//!
//! A name is looked up among the short names, then the columns of [`StepRow`], then the fields of [`RunStep`], then the
//! quantities that the stages declare.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::recorded;
use super::schema::{Entry, Shape, fields_of};
use super::tree::{Segment, path_text};
use super::unit::Unit;
use crate::records;
use crate::step::{RunStep, StepRow};
use sightline_record::GateDecl;
use sightline_track::target::TrackingState;

/// Short names of quantities, and their paths in the record, which determine unit and meaning.
pub(super) const SHORT: [(&str, &str); 11] = [
    ("peak_ratio", "locate.evidence.match_template.second_peak.ratio"),
    ("peak_distance_px", "locate.evidence.match_template.second_peak.distance_px"),
    ("at_edge", "locate.evidence.match_template.peak.at_edge"),
    ("accepted", "judge.accepted"),
    ("lost_count", "update.state.count"),
    ("renewed", "update.template_renewed"),
    ("correction_m", "update.correction_m"),
    ("correction_px", "update.correction_px"),
    ("step_length_m", "predict.step_length_m"),
    ("travelled_m", "update.target.travelled_m"),
    ("brightness", "capture.subframe_mean"),
];

/// The gates by name, with their units: the entries of `judge.gates`.
pub(crate) fn gates() -> &'static [GateDecl] {
    records::stage("judge").map_or(&[], |stage| &stage.schema().gates)
}

fn gate_names() -> Vec<String> {
    gates().iter().map(|gate| gate.name.to_string()).collect()
}

/// The kind of value that a name denotes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NameKind {
    /// A number.
    Number,
    /// Yes or no.
    Truth,
    /// A word or a text.
    Word,
    /// A list: `[0]` names its first entry, `count(…)` is the number of entries.
    List,
    /// A record with fields.
    Record,
}

/// A name that an expression can use.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Name {
    /// The name or path.
    pub name: String,
    /// The kind of its value.
    pub kind: NameKind,
    /// Its unit; empty without one.
    pub unit: String,
    /// Its meaning, as one sentence.
    pub meaning: String,
    /// The stage that computes it; `row` for a column of the run.
    pub stage: String,
    /// The possible words; empty if unknown.
    pub words: Vec<String>,
}

/// The root of a name's path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Root {
    /// The row of the step.
    Row,
    /// The step's record.
    Step,
    /// The quantities that the stages declare.
    Stage,
}

/// The location of a name's value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Place {
    /// The root of the path.
    pub root: Root,
    /// The path from the root.
    pub path: Vec<Segment>,
}

/// A name that was looked up.
pub(super) struct Found<'a> {
    /// The location of its value.
    pub place: Place,
    /// The kind of its value.
    pub shape: &'a Shape,
    /// Its meaning, as one sentence.
    pub meaning: &'a str,
    /// The unit of a gate's values, which the shape does not contain; `None` for other names.
    pub unit: Option<Unit>,
}

/// Why a name was not found: the segment at fault, and the possible names in its place.
pub(super) struct Unknown {
    /// The index of the segment at fault.
    pub at: usize,
    /// The possible names in its place; empty if there are none.
    pub possible: Vec<String>,
    /// The path before it; `None` for the first segment.
    pub within: Option<String>,
}

/// All names.
pub(super) struct Catalogue {
    row: BTreeMap<String, Entry>,
    record: BTreeMap<String, Entry>,
    stages: BTreeMap<String, Entry>,
    /// The declared columns of the row, below the stage `step`.
    columns: BTreeMap<String, Entry>,
}

/// The catalogue of this build.
pub(super) static CATALOGUE: LazyLock<Catalogue> = LazyLock::new(Catalogue::new);

impl Catalogue {
    fn new() -> Self {
        let mut row = fields_of::<StepRow>(recorded::of_column);
        let states = [
            TrackingState::Cleared,
            TrackingState::Tracking,
            TrackingState::Lost { count: 1 },
            TrackingState::Failed,
        ];
        if let Some(state) = row.get_mut("state") {
            state.shape = Shape::Word(states.map(|state| state.word().to_owned()).to_vec());
        }
        let mut record = fields_of::<RunStep>(recorded::of_field);
        let stages = recorded::stages();
        for (stage, declared) in &stages {
            if let Some(entry) = record.get_mut(stage) {
                entry.meaning.clone_from(&declared.meaning);
            }
        }
        Self { row, record, stages, columns: recorded::row() }
    }

    /// Looks a path up.
    pub(super) fn find(&self, path: &[Segment]) -> Result<Found<'_>, Unknown> {
        let Some(Segment::Field(first)) = path.first() else {
            return Err(Unknown { at: 0, possible: Vec::new(), within: None });
        };
        if let Some((_, to)) = SHORT.iter().find(|(name, _)| name == first) {
            let full: Vec<_> = to.split('.').map(|field| Segment::Field(field.to_owned())).collect();
            let added = full.len();
            let whole: Vec<_> = full.into_iter().chain(path[1..].iter().cloned()).collect();
            let found = self.walk(&self.record, &whole, Root::Step);
            return found.map_err(|wrong| Unknown { at: (wrong.at + 1).saturating_sub(added), ..wrong });
        }
        if self.row.contains_key(first) {
            // A column, else a declared component.
            return self.walk(&self.row, path, Root::Row).or_else(|unknown| {
                let whole: Vec<_> =
                    std::iter::once(Segment::Field(recorded::ROW.to_owned())).chain(path.to_vec()).collect();
                self.walk(&self.columns, &whole, Root::Stage).map_err(|_| unknown)
            });
        }
        // A field of the record, else a declared quantity.
        self.walk(&self.record, path, Root::Step).or_else(|unknown| {
            let declared = self.walk(&self.stages, path, Root::Stage);
            if self.record.contains_key(first) { declared.map_err(|_| unknown) } else { declared }
        })
    }

    fn walk<'a>(
        &'a self,
        root: &'a BTreeMap<String, Entry>,
        path: &[Segment],
        from: Root,
    ) -> Result<Found<'a>, Unknown> {
        let (mut fields, mut unit, mut entry) = (Some(root), None, None::<&Entry>);
        let mut way = Vec::new();
        for (at, segment) in path.iter().enumerate() {
            let within = (at > 0).then(|| path_text(&path[..at]));
            let unknown = |possible: Vec<String>| Unknown { at, possible, within };
            let next = match (segment, entry.map(|entry| &entry.shape), fields) {
                (Segment::Field(name), None | Some(Shape::Record(_)), Some(fields)) => match fields.get(name)
                {
                    Some(next) => next,
                    None => return Err(unknown(self.possible(at, fields))),
                },
                (Segment::Index(_), Some(Shape::List(items)), _) => items,
                (Segment::Field(name), Some(Shape::List(items)), _) => match (coordinate(name), &items.shape)
                {
                    (Some(_), Shape::Number(_)) => items,
                    (None, Shape::Record(_)) if is_gates(&path[..at]) => {
                        let gate = gates().iter().find(|gate| gate.name == *name);
                        unit = Some(gate.ok_or_else(|| unknown(gate_names()))?.unit.into());
                        items
                    }
                    _ => return Err(unknown(vec!["[0]".to_owned()])),
                },
                _ => return Err(unknown(Vec::new())),
            };
            way.push(match (segment, entry.map(|entry| &entry.shape)) {
                (Segment::Field(name), Some(Shape::List(_))) => {
                    coordinate(name).map_or_else(|| segment.clone(), Segment::Index)
                }
                _ => segment.clone(),
            });
            fields = match &next.shape {
                Shape::Record(fields) => Some(fields),
                _ => None,
            };
            entry = Some(next);
        }
        let entry = entry.ok_or(Unknown { at: 0, possible: Vec::new(), within: None })?;
        let place = Place { root: from, path: way };
        Ok(Found { place, shape: &entry.shape, meaning: &entry.meaning, unit })
    }

    /// The possible names of a segment; all roots for the first one.
    fn possible(&self, at: usize, fields: &BTreeMap<String, Entry>) -> Vec<String> {
        if at > 0 { fields.keys().cloned().collect() } else { self.roots().map(|(name, _)| name).collect() }
    }

    /// The possible first segments, with their stages: columns, short names, fields and stages.
    fn roots(&self) -> impl Iterator<Item = (String, &str)> {
        let short = SHORT.iter().map(|(name, path)| {
            let stage = path.split('.').next().unwrap_or_default();
            ((*name).to_owned(), self.stage_word(stage))
        });
        let row = self.row.keys().map(|name| (name.clone(), "row"));
        let beyond = self.record.keys().filter(|name| !self.row.contains_key(*name));
        let stages = self.stages.keys().filter(|name| !self.record.contains_key(*name));
        row.chain(short).chain(beyond.chain(stages).map(|name| (name.clone(), self.stage_word(name))))
    }

    /// The names directly under a path; the roots for an empty path.
    pub(super) fn under(&self, path: &[Segment]) -> Vec<Name> {
        let joined = |name: String| {
            let field = Segment::Field(name);
            path_text(&path.iter().cloned().chain([field]).collect::<Vec<_>>())
        };
        if path.is_empty() {
            return self.roots().filter_map(|(name, stage)| self.name(&name, stage)).collect();
        }
        let Ok(found) = self.find(path) else { return Vec::new() };
        let stage = self.stage_of(&found.place);
        let below: Vec<String> = match found.shape {
            Shape::Record(fields) => fields.keys().map(|name| joined(name.clone())).collect(),
            Shape::List(_) if is_gates(path) => gate_names().into_iter().map(joined).collect(),
            Shape::List(_) => vec![format!("{}[0]", path_text(path))],
            _ => Vec::new(),
        };
        below.iter().filter_map(|name| self.name(name, stage)).collect()
    }

    /// A name with kind, unit, meaning and words.
    fn name(&self, name: &str, stage: &str) -> Option<Name> {
        let path = super::path_of(name)?;
        let found = self.find(&path).ok()?;
        let (kind, unit, words) = match found.shape {
            Shape::Number(unit) => (NameKind::Number, found.unit.as_ref().unwrap_or(unit).symbol(), vec![]),
            Shape::Truth => (NameKind::Truth, "", vec![]),
            Shape::Word(words) => (NameKind::Word, "", words.clone()),
            Shape::List(items) => match &items.shape {
                Shape::Number(unit) => (NameKind::List, unit.symbol(), vec![]),
                _ => (NameKind::List, "", vec![]),
            },
            Shape::Record(_) => (NameKind::Record, "", vec![]),
        };
        let (unit, meaning) = (unit.to_owned(), found.meaning.to_owned());
        Some(Name { name: name.to_owned(), kind, unit, meaning, stage: stage.to_owned(), words })
    }

    fn stage_of<'a>(&'a self, place: &Place) -> &'a str {
        match place.path.first() {
            Some(Segment::Field(first)) if place.root != Root::Row => self.stage_word(first),
            _ => "row",
        }
    }

    /// The stage that a field of the record belongs to.
    fn stage_word(&self, field: &str) -> &str {
        self.stages.get_key_value(field).map_or("step", |(stage, _)| stage)
    }

    /// Every name: the roots and all names under them; of lists, the first entry.
    pub(super) fn all(&self) -> Vec<Name> {
        let mut names = Vec::new();
        let mut open: Vec<Name> = self.under(&[]);
        while let Some(name) = open.pop() {
            if let Some(path) = super::path_of(&name.name) {
                open.extend(self.under(&path));
            }
            names.push(name);
        }
        names.sort_by(|a, b| a.name.cmp(&b.name));
        names
    }
}

/// The names without a path: columns, short names and stages.
pub fn short_names() -> Vec<Name> {
    CATALOGUE.under(&[])
}

/// Every name of the language, including paths into records and lists (of lists, the first entry).
pub(crate) fn all_names() -> Vec<Name> {
    CATALOGUE.all()
}

/// The index of a coordinate in a list of numbers.
fn coordinate(name: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|axis| *axis == name)
}

fn is_gates(path: &[Segment]) -> bool {
    let is = |segment: &Segment, name: &str| matches!(segment, Segment::Field(field) if field == name);
    matches!(path, [judge, gates] if is(judge, "judge") && is(gates, "gates"))
}
