//! The corners of visual odometry and the slip in the recording of a drive with visual odometry.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::Arc;

use sightline_geometry::cancel::Cancel;
use sightline_recordings::Traverse;
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::{OdometryMode, OdometryPreset};
use sightline_server::rerun_log::{RunLog, export, shared_entities};
use sightline_session::step::RunStep;
use sightline_session::track;
use sightline_tests::rrd::{self, Recording};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;

use super::{FIXTURE, promised, sorted};

fn steps_of(traverse: &Traverse) -> Vec<Arc<RunStep>> {
    let designation = Designation::new(0, FIXTURE.drive.targets[0]);
    let steps = track::run(traverse, designation, &Settings::default()).unwrap();
    steps.into_iter().map(Arc::new).collect()
}

fn exported(traverse: &Traverse, steps: &[Arc<RunStep>]) -> Recording {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odometry.rrd");
    let runs = [RunLog { target: 0, run: 0, label: "rock", steps }];
    export(&path, "measured", traverse, (&runs, None), &mut |_, _| ControlFlow::Continue(())).unwrap();
    rrd::read(&path)
}

fn views(recording: &Recording) -> usize {
    let ids = recording.blueprint.iter().filter_map(|path| path.strip_prefix("/view/")?.split('/').next());
    ids.collect::<BTreeSet<_>>().len()
}

#[test]
fn corners_are_over_the_left_image_and_the_slip_is_a_series() {
    let how = (OdometryMode::Full, OdometryPreset::Sightline);
    let traverse = FIXTURE.drive.traverse.with_odometry(how.0, how.1, Cancel::default()).unwrap();
    let steps = steps_of(&traverse);
    let recording = exported(&traverse, &steps);
    for doc in shared_entities().iter().filter(|doc| doc.path.contains("/odometry/")) {
        let (found, expected) = (&recording.entities[&doc.path], promised(doc.rows, doc, &steps));
        assert!(expected.data.len() > 2 && expected.cleared == [0], "{expected:?}");
        assert_eq!(sorted(found.data.clone()), expected.data, "steps with data of {}", doc.path);
        assert_eq!(found.cleared, expected.cleared, "cleared steps of {}", doc.path);
    }
    let numbers = |path: &str, component: &str, step: usize| {
        recording.entities[path].numbers.get(&(component.to_owned(), step as i64)).cloned()
    };
    let mut slips = 0;
    for trace in &steps[1..] {
        let measured = traverse.measured_motion(trace.step).unwrap();
        let table = measured.again(&traverse, trace.step, Cancel::default()).unwrap().table;
        let half_further = |places: Vec<[f64; 2]>| -> Vec<f64> {
            places.into_iter().flatten().map(|at| f64::from((at + 0.5) as f32)).collect()
        };
        let before = half_further(table.iter().map(|corner| corner.before_px).collect());
        let after = half_further(table.iter().filter_map(|corner| corner.after_px).collect());
        assert!(before.len() > after.len() && !after.is_empty(), "some corners are lost");
        let at = |entity: &str| {
            numbers(&format!("/capture/left/odometry/{entity}"), "Points2D:positions", trace.step).unwrap()
        };
        assert_eq!((at("before"), at("after")), (before, after), "step {}", trace.step);
        let slip = numbers("/target_1/record/visual_odometry/slip", "Scalars:scalars", trace.step);
        assert_eq!(slip, measured.update.slip.map(|slip| vec![slip.along]));
        slips += usize::from(slip.is_some());
    }
    assert!(slips > 2, "{slips}");
    let planned = exported(&FIXTURE.drive.traverse, &steps_of(&FIXTURE.drive.traverse));
    assert_eq!(views(&recording), views(&planned) + 1, "one view for the corners");
}
