//! The declared records, compared with the serialised steps of every tracker.

use std::collections::BTreeSet;

use serde_json::Value;

use sightline_geometry::frames::{Pixel, Pose};
use sightline_session::records;
use sightline_session::step::RunStep;
use sightline_session::track;
use sightline_testing::PlaneWorld;
use sightline_track::presets::preset;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;

/// A short run by each tracker.
fn runs() -> Vec<(&'static str, Vec<RunStep>)> {
    let world = PlaneWorld::new([0.0, 0.5, 1.0].map(|x| Pose::translation(x, 0.0, 0.0)).to_vec());
    let designation = Designation::new(0, Pixel::new(140.3, 120.6));
    let run = |settings: &Settings| track::run(&world, designation, settings).unwrap();
    let by_preset = ["features", "shape", "combined"].map(|name| {
        let settings = preset(name).unwrap().settings().unwrap();
        (name, run(&settings))
    });
    [("template", run(&Settings::default()))].into_iter().chain(by_preset).collect()
}

fn at<'a>(tree: &'a Value, path: &str) -> Option<&'a Value> {
    tree.pointer(&format!("/{}", path.replace('.', "/"))).filter(|value| !value.is_null())
}

#[test]
fn the_evidence_of_a_stage_is_at_one_of_its_paths() {
    let mut used = BTreeSet::new();
    for (tracker, steps) in runs() {
        for trace in &steps {
            let tree = serde_json::to_value(trace).unwrap();
            for stage in records::stages() {
                let Some(evidence) = stage.evidence(trace) else { continue };
                let path = stage.schema().paths().find(|path| at(&tree, path) == Some(&evidence));
                let path = path.unwrap_or_else(|| {
                    panic!("{tracker}, step {}: {} is elsewhere", trace.step, stage.schema().stage)
                });
                used.insert(path.to_owned());
            }
        }
    }
    for path in ["locate.evidence.features.detect", "locate.evidence.features.designation.point_stereo"] {
        assert!(used.contains(path), "{path}: {used:?}");
    }
}

#[test]
fn declared_fields_are_fields_of_the_evidence() {
    let (mut found, mut declared) = (BTreeSet::new(), BTreeSet::new());
    for trace in runs().iter().flat_map(|(_, steps)| steps) {
        for stage in records::stages() {
            let (schema, evidence) = (stage.schema(), stage.evidence(trace).unwrap_or_default());
            for (field, _) in &schema.fields {
                let name = format!("{}.{field}", schema.stage);
                found.extend(at(&evidence, field).map(|_| name.clone()));
                declared.insert(name);
            }
        }
    }
    let missing: Vec<&String> = declared.difference(&found).collect();
    // Only a CAHVORE camera has an entrance pupil, and relief is recorded only if a setting enables it.
    assert!(missing.iter().all(|name| name.ends_with(".E") || name.starts_with("relief.")), "{missing:?}");
}

#[test]
fn the_rest_of_a_stage_repeats_no_quantity_and_no_other_stage() {
    for (tracker, steps) in runs() {
        for trace in &steps {
            for stage in records::stages() {
                let (schema, rest) = (stage.schema(), records::rest(stage, trace));
                for quantity in &schema.quantities {
                    let left = at(&rest, &quantity.name).filter(|value| !value.is_object());
                    assert_eq!(left, None, "{tracker}: {}.{}", schema.stage, quantity.name);
                }
                assert!(schema.stage != "locate" || at(&rest, "evidence.match_template").is_none());
            }
        }
    }
}
