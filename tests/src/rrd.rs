//! Reads an `.rrd` file: its entities, the number of rows of each, and their data.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use re_log_encoding::DecoderApp;
use rerun::external::arrow::array::{Array, ArrayRef, AsArray};
use rerun::external::arrow::datatypes::{Float32Type, Float64Type};
use rerun::log::{Chunk, LogMsg};
use rerun::{ComponentIdentifier, StoreKind};

/// The component that marks a row as cleared.
const CLEAR: &str = "Clear:is_recursive";

/// The rows of one entity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EntityRows {
    /// Number of static rows.
    pub fixed: usize,
    /// Steps of the rows with data, in the order of the file.
    pub data: Vec<i64>,
    /// Steps of the rows that clear the entity.
    pub cleared: Vec<i64>,
    /// The timelines of its rows.
    pub timelines: BTreeSet<String>,
    /// The archetypes of its rows, by their short names.
    pub archetypes: BTreeSet<String>,
    /// The floating-point numbers of a row, by component and step.
    pub numbers: BTreeMap<(String, i64), Vec<f64>>,
}

/// The contents of a file.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Application id, by which a viewer stores its layouts.
    pub application: String,
    /// The entities of the recording, by path.
    pub entities: BTreeMap<String, EntityRows>,
    /// The entities of the layout.
    pub blueprint: BTreeSet<String>,
    /// Whether the layout is complete and to be activated.
    pub blueprint_activated: bool,
}

/// Reads a file; panics with the reason if it is malformed.
pub fn read(path: &Path) -> Recording {
    let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut recording = Recording::default();
    for message in DecoderApp::decode_lazy(BufReader::new(file)) {
        match message.unwrap_or_else(|error| panic!("{}: {error}", path.display())) {
            LogMsg::SetStoreInfo(info) => recording.application = info.info.application_id().to_string(),
            LogMsg::BlueprintActivationCommand(command) => {
                recording.blueprint_activated = command.make_active;
            }
            LogMsg::ArrowMsg(store, message) => {
                let chunk =
                    Chunk::from_arrow_msg(&message).unwrap_or_else(|error| panic!("a bad chunk: {error}"));
                let entity = chunk.entity_path().to_string();
                if store.kind() == StoreKind::Blueprint {
                    recording.blueprint.insert(entity);
                } else {
                    add(recording.entities.entry(entity).or_default(), &chunk);
                }
            }
        }
    }
    recording
}

fn add(rows: &mut EntityRows, chunk: &Chunk) {
    let clear = ComponentIdentifier::from(CLEAR);
    let archetypes = chunk.component_descriptors().filter_map(|descriptor| descriptor.archetype);
    rows.archetypes.extend(archetypes.map(|name| name.short_name().to_owned()));
    rows.timelines.extend(chunk.timelines().keys().map(ToString::to_string));
    if chunk.is_static() {
        rows.fixed += chunk.num_rows();
        return;
    }
    let steps =
        chunk.timelines().get(&"step".into()).map(|column| column.times_raw().to_vec()).unwrap_or_default();
    for (row, step) in steps.iter().enumerate() {
        let is_set = |component: &ComponentIdentifier| {
            chunk.components().get_array(*component).is_some_and(|array| array.is_valid(row))
        };
        let set: Vec<_> = chunk.components_identifiers().filter(is_set).collect();
        if set.contains(&clear) {
            rows.cleared.push(*step);
        }
        if set.iter().any(|component| *component != clear) {
            rows.data.push(*step);
        }
        for component in set {
            let numbers = chunk.components().get_array(component).map(|array| floats(&array.value(row)));
            let numbers = numbers.filter(|numbers| !numbers.is_empty());
            numbers.map(|numbers| rows.numbers.insert((component.to_string(), *step), numbers));
        }
    }
}

/// The numbers of an array of `f32`, `f64`, or small vectors of them; empty for other arrays.
fn floats(array: &ArrayRef) -> Vec<f64> {
    if let Some(values) = array.as_primitive_opt::<Float64Type>() {
        values.values().to_vec()
    } else if let Some(values) = array.as_primitive_opt::<Float32Type>() {
        values.values().iter().map(|v| f64::from(*v)).collect()
    } else if let Some(vectors) = array.as_fixed_size_list_opt() {
        floats(vectors.values())
    } else {
        Vec::new()
    }
}
