//! A drive on commands that is paused between the stages of a stop has the same bits as one that is never paused.

use sightline_geometry::cancel::Cancel;
use sightline_rover::driving::executive::{self, CycleInput};
use sightline_rover::driving::{ArcNavigator, odometry};
use sightline_rover::pipeline::{self, StepChanges};
use sightline_session::records;
use sightline_session::step::RunStep;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::records::stages_of;
use sightline_track::settings::Settings;
use sightline_track::trace::StepTrace;

use crate::driving::{begin, command};

/// The stages of a stop before which its step can be paused.
const WITHIN: [CycleStage; 5] =
    [CycleStage::PointMast, CycleStage::Capture, CycleStage::Locate, CycleStage::Judge, CycleStage::Update];

/// The last step of a drive at its last stop, paused before a stage.
fn paused(drive: &TargetedDrive, last: &RunStep, before: Option<CycleStage>) -> StepTrace {
    let changes = StepChanges { before, ..StepChanges::default() };
    let stops = drive.world.traverse();
    pipeline::run_step_changed(stops, &last.update, &Settings::default(), &changes, Cancel::default())
        .unwrap()
}

/// Checks that the records of a paused step equal those of the whole one up to the pause, and are absent after it.
fn check_prefix(begun: StepTrace, whole: &RunStep, before: CycleStage) {
    assert_eq!(begun.paused_before(), Some(before));
    assert_eq!(begun.update.state, whole.verdict().unwrap().state_before);
    let begun = RunStep { trace: begun, truth: None, odometry: None, took: Default::default() };
    let order: Vec<&str> = stages_of(whole.update.target.memory.tracker()).collect();
    let place = |name: &str| order.iter().position(|stage| *stage == name);
    let names = records::stages().iter().map(|stage| stage.schema().stage.as_ref());
    let all = names.zip(records::records(&begun)).zip(records::records(whole));
    let mut reached = Vec::new();
    // The session adds visual odometry and the comparison with the truth.
    let added = ["step", "truth", "visual_odometry"];
    for ((name, begun), whole) in all.filter(|((name, _), _)| !added.contains(name)) {
        // Evidence that is not in the order of the stages belongs to `locate`.
        let is_before = place(name).or(place("locate")) < place(before.word())
            || (before > CycleStage::Locate && place(name).is_none());
        if is_before {
            assert_eq!(begun, whole, "{name}, paused before {}", before.word());
            reached.extend(begun.reached.then_some(name));
        } else {
            assert!(!begun.reached, "{name}, paused before {}", before.word());
        }
    }
    let main = CycleStage::ALL.into_iter().filter(|stage| *stage < before).map(CycleStage::word);
    assert_eq!(main.filter(|word| !reached.contains(word)).count(), 0, "{reached:?}");
    let row = begun.row();
    assert!(row.reason.unwrap().contains(&format!("paused before `{}`", before.word())));
    let again: RunStep = serde_json::from_value(serde_json::to_value(&begun).unwrap()).unwrap();
    assert_eq!(again.paused_before(), Some(before));
}

#[test]
fn a_paused_step_is_a_prefix_of_the_complete_step() {
    let folder = tempfile::tempdir().unwrap();
    let mut drive = begin(&folder.path().join("drive"));
    for _ in 0..2 {
        assert!(drive.advance(&Settings::default(), Cancel::default()).unwrap());
    }
    let [.., last, whole] = &drive.steps[..] else { panic!("three steps") };
    for before in WITHIN {
        check_prefix(paused(&drive, last, Some(before)), whole, before);
    }
    assert_eq!(paused(&drive, last, None), whole.trace);
}

#[test]
fn a_paused_world_resumes_with_the_same_state_and_images() {
    let folder = tempfile::tempdir().unwrap();
    let mut drive = begin(&folder.path().join("drive"));
    for _ in 0..2 {
        assert!(drive.advance(&Settings::default(), Cancel::default()).unwrap());
    }
    let (whole, state) = (drive.steps[2].trace.clone(), drive.world.state().to_vec());
    let images = drive.world.traverse().capture(2).unwrap();
    let (first, last) = (drive.steps[0].clone(), drive.steps[1].clone());
    let input = CycleInput {
        command: &command(),
        navigator: &ArcNavigator::default(),
        first: &first.trace,
        last: &last.trace,
        before: drive.cycles.first(),
        hazards: None,
    };
    let file = folder.path().join("drive").join(&drive.world.traverse().index().stops[2].left.image);
    for put_off in [Some(CycleStage::PointMast), Some(CycleStage::Capture), None] {
        drive.world.restore(state[..2].to_vec()).unwrap();
        let cycle = executive::drive(&mut drive.world, &input, Cancel::default()).unwrap();
        assert_eq!(cycle, drive.cycles[1]);
        drive.world.put_off(Some(CycleStage::PointMast)).unwrap();
        let stop = drive.world.state()[2].clone();
        assert_eq!(
            (stop.mast_angles, stop.metered_px),
            (state[1].mast_angles, None),
            "the mast is not pointed"
        );
        if put_off != Some(CycleStage::PointMast) {
            executive::point_mast(&mut drive.world, &drive.command, &last.update).unwrap();
            drive.world.put_off(put_off).unwrap();
            assert_eq!(drive.world.state()[2].mast_angles, state[2].mast_angles);
        }
        // The drive can be resumed from its folder at any pause.
        let resumed = sightline_recordings::DrivenTraverse::resume(&folder.path().join("drive")).unwrap();
        assert_eq!((resumed.state(), resumed.awaits()), (drive.world.state(), put_off));
        let snapshot = drive.world.snapshot().unwrap();
        match put_off {
            Some(_) => {
                let refused = snapshot.capture(2).unwrap_err().to_string();
                assert!(refused.contains("stop 2 has no images yet"), "{refused}");
                assert!(!file.exists(), "nothing is rendered before `capture`");
            }
            None => assert_eq!(snapshot.capture(2).unwrap(), images),
        }
        if put_off == Some(CycleStage::PointMast) {
            executive::point_mast(&mut drive.world, &drive.command, &last.update).unwrap();
        }
        odometry::run(&mut drive.world, &command(), 2, Cancel::default()).unwrap();
        drive.world.put_off(None).unwrap();
        assert_eq!(drive.world.state(), state);
        assert_eq!(drive.world.traverse().capture(2).unwrap(), images);
        assert_eq!(paused(&drive, &last, None), whole);
    }
}
