//! Consistency of the catalogue: points in existing scenarios, known configurations, grids that refuse other values.

use super::*;
use crate::plan::Configuration;
use crate::randomised;

#[test]
fn every_study_has_points_in_scenarios_of_the_library_and_known_configurations() {
    for study in STUDIES {
        let points = study.points(&[]).unwrap();
        assert!(!points.is_empty(), "{}", study.name);
        for point in &points {
            assert!(randomised::base(&point.scenario).is_ok(), "{}: {}", study.name, point.scenario);
        }
        for name in study.default_configurations() {
            assert!(Configuration::parse(name).is_ok(), "{}: {name}", study.name);
        }
        for value in study.paper() {
            assert!(
                study.default_configurations().contains(&value.configuration),
                "{}: the paper's {} does not run",
                study.name,
                value.configuration
            );
        }
    }
}

#[test]
fn four_skipped_images_are_every_fifth_stop() {
    let points = Study::named("straight").unwrap().points(&["4".to_owned()]).unwrap();
    assert_eq!((points.len(), points[0].visit), (1, Visit::Every(5)));
}

#[test]
fn the_azimuths_of_table_three_add_up_to_what_is_printed_of_them() {
    // R226.
    let table = Study::named("checkout-1").unwrap().paper();
    let of = |column: &str| -> f64 { table.iter().filter(|v| v.column == column).map(|v| v.value).sum() };
    assert!((of("azimuth_change_deg") - 53.56).abs() < 1e-9);
    assert!((of("roll_deg") - 20.69).abs() < 1e-9);
}

#[test]
fn fifteen_degrees_sideways_are_every_third_picture_in_both_windows() {
    let points = Study::named("sideways").unwrap().points(&["15".to_owned()]).unwrap();
    assert_eq!(points.len(), 2);
    assert!(points.iter().all(|point| point.visit == Visit::Every(3)));
    assert_eq!(points[1].changes, ["search_window_px=601"]);
}

#[test]
fn a_value_outside_the_grid_is_refused_with_what_may_stand_there() {
    let refusal = |study: &str, value: &str| {
        Study::named(study).unwrap().points(&[value.to_owned()]).unwrap_err().to_string()
    };
    assert!(refusal("straight", "-1").contains("0 to 28"));
    assert!(refusal("sideways", "12").contains("multiple of 5"));
    assert!(refusal("faults", "rain").contains("occlusion"));
    assert!(refusal("approach", "3").contains("no grid"));
    assert!(Study::named("curved").unwrap_err().to_string().contains("straight"));
}
