//! The `.rrd` export and the live stream, on a short simulated drive with a missing image and covered cameras; and the
//! entities of the feature tracker, from synthetic tables for the same drive (`shape`: those of the shape tracker).

mod odometry;
mod shape;

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use sightline_geometry::error::Error;
use sightline_geometry::estimate::ransac::Refit;
use sightline_geometry::frames::Pixel;
use sightline_server::rerun_log::{
    LiveRecording, Rows, RunLog, documented_entities, entities_of, export, root, shared_entities,
};
use sightline_session::step::RunStep;
use sightline_session::{Session, track};
use sightline_tests::faulty_drive::FaultyDrive;
use sightline_tests::rrd::{self, EntityRows, Recording};
use sightline_track::locate::Evidence;
use sightline_track::locate::features::FeatureEvidence;
use sightline_track::locate::features::evidence::{
    Bootstrapped, CLOUD_COLUMNS, Detected, FeatureColumn, FittedMotion, Table,
};
use sightline_track::settings::Settings;
use sightline_track::target::{Designation, TrackingState};

/// The stop whose image is missing.
const MISSING: usize = 2;
/// The stop at which both cameras are covered.
const COVERED: usize = 4;

/// The drive and the runs of two targets, tracked once for all tests.
struct Fixture {
    drive: FaultyDrive,
    runs: Vec<Vec<Arc<RunStep>>>,
    _folder: tempfile::TempDir,
}

static FIXTURE: LazyLock<Fixture> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let drive =
        FaultyDrive { missing: vec![MISSING], covered: vec![COVERED], ..FaultyDrive::short(folder.path()) };
    let run = |pixel: &Pixel| {
        let designation = Designation::new(0, *pixel);
        let steps = track::run(&drive, designation, &Settings::default()).unwrap();
        steps.into_iter().map(Arc::new).collect()
    };
    let runs = drive.targets.iter().take(2).map(run).collect();
    Fixture { drive, runs, _folder: folder }
});

impl Fixture {
    fn logs(&self) -> Vec<RunLog<'_>> {
        let numbered = self.runs.iter().enumerate();
        numbered.map(|(target, steps)| RunLog { target, run: 0, label: LABELS[target], steps }).collect()
    }

    fn exported(&self) -> Recording {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("short.rrd");
        export(&path, "short approach", &self.drive, (&self.logs(), None), &mut |_, _| {
            ControlFlow::Continue(())
        })
        .unwrap();
        assert_eq!(names(folder.path()), ["short.rrd"], "nothing else may be left behind");
        rrd::read(&path)
    }
}

const LABELS: [&str; 2] = ["left rock", "right rock"];

fn names(folder: &Path) -> Vec<String> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

/// The steps with and without data that the documentation specifies.
fn promised(rows: Rows, doc: &sightline_server::rerun_log::EntityDoc, steps: &[Arc<RunStep>]) -> EntityRows {
    let split = |wanted: bool| {
        steps.iter().filter(|t| doc.has_data_at(t) == wanted).map(|t| t.step as i64).collect::<Vec<_>>()
    };
    let mut promised = EntityRows { fixed: usize::from(doc.style.is_some()), ..EntityRows::default() };
    match rows {
        Rows::Once => promised.fixed = 1,
        Rows::EachStop => promised.data = (0..FIXTURE.drive.traverse.stop_count() as i64).collect(),
        Rows::EachStep { .. } | Rows::EachScore { .. } => {
            (promised.data, promised.cleared) = (split(true), split(false));
        }
    }
    promised
}

fn sorted(mut steps: Vec<i64>) -> Vec<i64> {
    steps.sort_unstable();
    steps
}

#[test]
fn an_export_has_exactly_the_documented_entities() {
    let recording = FIXTURE.exported();
    let shared = shared_entities().into_iter().map(|doc| (0, doc));
    let own =
        (0..2).flat_map(|target| entities_of(&root(target, 0)).into_iter().map(move |doc| (target, doc)));
    for (target, doc) in shared.chain(own) {
        let found =
            recording.entities.get(&doc.path).unwrap_or_else(|| panic!("{} is not in the file", doc.path));
        let expected = promised(doc.rows, &doc, &FIXTURE.runs[target]);
        assert_eq!(found.fixed, expected.fixed, "rows outside of time of {}", doc.path);
        assert_eq!(sorted(found.data.clone()), expected.data, "steps with data of {}", doc.path);
        assert_eq!(sorted(found.cleared.clone()), expected.cleared, "cleared steps of {}", doc.path);
        for archetype in std::iter::once(doc.archetype).chain(doc.style) {
            let missing = expected.data.is_empty() && expected.fixed == 0;
            let styled_only = expected.data.is_empty() && Some(archetype) != doc.style;
            assert!(
                missing || styled_only || found.archetypes.contains(archetype),
                "{}: {archetype}",
                doc.path
            );
        }
        let timelines: Vec<_> = found.timelines.iter().map(String::as_str).collect();
        let none = matches!(doc.rows, Rows::Once);
        assert_eq!(timelines, if none { vec![] } else { vec!["step", "time"] }, "timelines of {}", doc.path);
    }
    let documented: Vec<_> = documented_entities(2).into_iter().map(|doc| doc.path).collect();
    let others = recording.entities.keys().filter(|path| !path.starts_with("/__properties"));
    let undocumented: Vec<_> = others.filter(|path| !documented.contains(path)).collect();
    assert!(undocumented.is_empty(), "not in the documentation: {undocumented:?}");
}

/// Three features: an unmatched one, an inlier and an outlier; the target has moved by half a pixel of residual.
fn by_features(trace: &RunStep) -> RunStep {
    let mut trace = trace.clone();
    let (is_pick, Some(located)) = (trace.prediction().is_none(), trace.located_mut()) else { return trace };
    const NONE: f32 = f32::NAN;
    let alone = [50.0, 60.0, 2.0, 0.5, NONE, NONE, NONE, NONE, NONE, NONE, NONE, NONE, NONE];
    let inlier = [70.0, 80.0, 3.0, 1.5, 60.0, 80.0, 4.0, 65.0, 78.0, 69.5, 80.25, 0.01, 1.0];
    let outlier = [90.0, 100.0, 1.0, -1.5, 80.0, 100.0, 5.0, 20.0, 30.0, 40.0, 50.0, 0.5, 0.0];
    let columns = FeatureColumn::COUNT as u32;
    let table = Table { columns, values: [alone, inlier, outlier].concat() };
    let detect = Detected { left: 3, right: 3, stereo_matches: 2, points: 2, median_range_m: Some(4.5) };
    let mut evidence =
        FeatureEvidence { detect: Some(detect), table: table.into(), ..FeatureEvidence::default() };
    if !is_pick {
        evidence.fit_motion = Some(FittedMotion {
            translation_m: [-0.3, 0.0, 0.0],
            roll_pitch_yaw_deg: [0.0; 3],
            inliers: 1,
            rms_m: 0.01,
            median_m: 0.01,
            consensus_by_draw: vec![1],
            refits: vec![Refit { inliers: 1, rms_m: 0.01 }],
            correction_m: 0.0,
        });
        evidence.bootstrap = Some(Bootstrapped {
            sets: 2,
            covariance: Default::default(),
            sigma_translation_m: [0.0; 3],
            sigma_rotation_deg: [0.0; 3],
        });
        let values = vec![4.0, 0.1, 0.2, 200.0, 210.0, 4.1, 0.1, 0.2, NONE, NONE];
        evidence.cloud = Table { columns: CLOUD_COLUMNS as u32, values }.into();
    }
    located.evidence = Evidence::Features(Box::new(evidence));
    trace
}

/// The recording of a run; asserts that every entity has data and is cleared at the steps that its documentation specifies.
fn exported_as_promised(steps: &[Arc<RunStep>]) -> rrd::Recording {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let runs = [RunLog { target: 0, run: 0, label: "rock", steps }];
    export(&path, "short", &FIXTURE.drive, (&runs, None), &mut |_, _| ControlFlow::Continue(())).unwrap();
    let recording = rrd::read(&path);
    for doc in entities_of(&root(0, 0)) {
        let (found, expected) = (&recording.entities[&doc.path], promised(doc.rows, &doc, steps));
        assert_eq!(sorted(found.data.clone()), expected.data, "steps with data of {}", doc.path);
        assert_eq!(sorted(found.cleared.clone()), expected.cleared, "cleared steps of {}", doc.path);
    }
    recording
}

#[test]
fn a_feature_run_logs_keypoints_matches_and_points() {
    let steps: Vec<_> = FIXTURE.runs[0].iter().map(|trace| Arc::new(by_features(trace))).collect();
    let recording = exported_as_promised(&steps);
    let step = 1;
    let numbers = |entity: &str, component: &str| {
        let entity = &recording.entities[&format!("/target_1/locate/{entity}")];
        entity.numbers[&(component.to_owned(), step)].clone()
    };
    assert_eq!(numbers("detect/keypoints", "Points2D:positions"), [50.5, 60.5, 70.5, 80.5, 90.5, 100.5]);
    assert_eq!(numbers("detect/keypoints", "Points2D:radii"), [2.0, 3.0, 1.0]);
    assert_eq!(numbers("match_features/partners", "Points2D:positions"), [60.5, 80.5, 80.5, 100.5]);
    assert_eq!(numbers("triangulate/points", "Points3D:positions").len(), 2 * 3);
    assert_eq!(numbers("fit_motion/residuals", "Arrows2D:vectors"), [5.0, -2.5], "ten times as long");
    assert_eq!(numbers("fit_motion/residuals", "Arrows2D:origins"), [70.0, 80.75]);
    assert_eq!(numbers("fit_motion/inliers", "Scalars:scalars"), [1.0]);
    assert_eq!(numbers("bootstrap/cloud", "Points3D:positions").len(), 2 * 3);
    assert_eq!(numbers("bootstrap/left", "Points2D:positions"), [200.5, 210.5]);
    // Both kinds of matches exist, each in an entity and a colour of its own.
    for kind in ["inliers", "outliers"] {
        let path = format!("/target_1/locate/match_features/{kind}");
        assert!(recording.entities[&path].data.contains(&step), "{kind}");
    }
}

#[test]
fn the_fixture_has_a_fault_a_loss_and_a_recovery() {
    let steps = &FIXTURE.runs[0];
    assert!(steps[MISSING].fault().is_some_and(|fault| fault.contains("left_0002.png")));
    assert_eq!(steps[COVERED].update.state, TrackingState::Lost { count: 1 });
    assert_eq!(steps[COVERED + 1].update.state, TrackingState::Tracking);
}

#[test]
fn a_step_without_images_clears_scores_and_logs_the_fault() {
    let recording = FIXTURE.exported();
    let at = MISSING as i64;
    for path in ["/capture/left", "/target_1/judge/ncc", "/target_1/locate/match_template/surface"] {
        assert!(recording.entities[path].cleared.contains(&at), "{path}");
        assert!(!recording.entities[path].data.contains(&at), "{path}");
    }
    for path in ["/target_1/judge/state", "/target_1/judge/verdict", "/target_1/predict/position"] {
        assert!(recording.entities[path].data.contains(&at), "{path}");
    }
}

#[test]
fn numbers_round_trip_and_pixels_are_shifted_by_a_half() {
    let recording = FIXTURE.exported();
    let number = |path: &str, component: &str, step: usize| {
        recording.entities[path].numbers[&(component.to_owned(), step as i64)].clone()
    };
    let mut matched = 0;
    for trace in FIXTURE.runs[0].iter() {
        let Some(found) = trace.template().and_then(|e| e.match_template.as_ref()) else { continue };
        let ncc = number("/target_1/judge/ncc", "Scalars:scalars", trace.step);
        assert_eq!(ncc, [found.peak.score]);
        let peak = number("/target_1/locate/match_template/peak", "Points2D:positions", trace.step);
        assert_eq!(peak, [(found.pixel.x + 0.5) as f32, (found.pixel.y + 0.5) as f32].map(f64::from));
        let site = FIXTURE.drive.traverse.site_from_rover(trace.step) * trace.update.target.position_in_rover;
        let position = number("/target_1/update/position", "Points3D:positions", trace.step);
        assert_eq!(position, [site.x as f32, site.y as f32, site.z as f32].map(f64::from));
        matched += 1;
    }
    assert!(matched >= 4, "only {matched} steps were matched");
}

#[test]
fn the_layout_is_in_the_file_and_shall_be_shown() {
    let recording = FIXTURE.exported();
    assert_eq!(recording.application, "sightline");
    assert!(recording.blueprint_activated);
    let has = |part: &str| recording.blueprint.iter().any(|path| path.contains(part));
    for part in ["/container/", "/view/", "/viewport", "/blueprint_panel", "/selection_panel", "/time_panel"]
    {
        assert!(has(part), "{part}: {:?}", recording.blueprint);
    }
    for property in ["/ViewContents", "/PlotLegend", "/EyeControls3D", "/VisualBounds2D", "/Background"] {
        assert!(has(property), "{property}: {:?}", recording.blueprint);
    }
}

#[test]
fn a_cancelled_export_leaves_existing_files_only() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("short.rrd");
    let mut seen = Vec::new();
    let cancelled = export(&path, "short", &FIXTURE.drive, (&FIXTURE.logs(), None), &mut |done, all| {
        seen.push((done, all));
        if done == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(cancelled, Err(Error::Cancelled)), "{cancelled:?}");
    let all = FIXTURE.runs[0].len();
    assert_eq!(seen, [(0, all), (1, all), (2, all)]);
    assert!(names(folder.path()).is_empty());

    std::fs::write(&path, "mine").unwrap();
    let refused =
        export(
            &path,
            "short",
            &FIXTURE.drive,
            (&FIXTURE.logs(), None),
            &mut |_, _| ControlFlow::Continue(()),
        );
    assert!(matches!(refused, Err(Error::Write { .. })), "{refused:?}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
}

/// Threads of this process that belong to a Rerun stream.
#[cfg(target_os = "linux")]
fn stream_threads() -> usize {
    let tasks = std::fs::read_dir("/proc/self/task").unwrap();
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.unwrap().path().join("comm")).ok());
    names.filter(|name| name.starts_with("RecordingStream") || name.starts_with("ChunkBatcher")).count()
}

/// Once each export leaked eight threads, and each further live target six; other tests have a few threads of their own.
#[cfg(target_os = "linux")]
#[test]
fn exports_and_live_targets_leave_no_threads_behind() {
    const TIMES: usize = 20;
    let before = stream_threads();
    let mut live = LiveRecording::start().unwrap();
    let mut session = Session::new("s", "short", FIXTURE.drive.traverse.stop_count());
    for _ in 0..TIMES {
        FIXTURE.exported();
        session.add_target(None, Settings::default(), Arc::clone(&FIXTURE.runs[0][0]));
        while !live.advance("short approach", &FIXTURE.drive, &session, None).unwrap().is_empty() {}
    }
    let after = stream_threads();
    assert!(after < before + 2 * TIMES, "{before} threads of streams, then {after}");
}

#[test]
fn a_live_recording_grows_step_by_step_to_the_exported_one() {
    let mut live = LiveRecording::start().unwrap();
    let mut session = Session::new("s", "short", FIXTURE.drive.traverse.stop_count());
    for (label, run) in LABELS.iter().zip(&FIXTURE.runs) {
        session.add_target(Some((*label).to_owned()), Settings::default(), Arc::clone(&run[0]));
    }
    let mut bytes = Vec::new();
    let mut read_all = |session: &Session, bytes: &mut Vec<u8>| {
        let mut batches = 0;
        loop {
            let batch = live.advance("short approach", &FIXTURE.drive, session, None).unwrap();
            if batch.is_empty() {
                return batches;
            }
            bytes.extend(batch);
            batches += 1;
        }
    };
    assert_eq!(read_all(&session, &mut bytes), 1);
    assert_eq!(&bytes[..4], b"RRF2");
    assert_eq!(read_all(&session, &mut bytes), 0, "nothing new");
    for (target, run) in FIXTURE.runs.iter().enumerate() {
        for trace in &run[1..] {
            session.record(target, 0, Arc::clone(trace)).unwrap();
        }
    }
    assert!(read_all(&session, &mut bytes) > 1, "many steps come in batches");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.rrd");
    std::fs::write(&path, &bytes).unwrap();
    let (live, exported) = (rrd::read(&path), FIXTURE.exported());
    let rows = |recording: &Recording| {
        let own = recording.entities.iter().filter(|(path, _)| !path.starts_with("/__properties"));
        own.map(|(path, rows)| {
            (path.clone(), sorted(rows.data.clone()), sorted(rows.cleared.clone()), rows.numbers.clone())
        })
        .collect::<Vec<_>>()
    };
    assert_eq!(rows(&live), rows(&exported));
    assert!(live.blueprint_activated);
}
