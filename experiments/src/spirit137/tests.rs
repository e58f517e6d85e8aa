//! The recorded poses and a short replay.

use super::*;

/// Two states of drive counter 28, out of order, and one of drive counter 26.
const SHORT: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<rmc_file mission="MER2" index1="137">
  <solution solution_id="telemetry" name="ROVER_FRAME" add_date="2009-04-07T15:52:12Z" index1="137" index2="28" index3="0" index4="3" index5="0">
    <reference_frame name="SITE_FRAME" index1="137"/>
    <offset x="-5.36101" y="-1.23685" z="0.0706138"/>
    <orientation s="0.997998" v1="-0.053639" v2="0.0126683" v3="0.0310341"/>
  </solution>
  <solution name="ROVER_FRAME" add_date="2009-04-08T15:52:12Z" index1="137" index2="28" index3="0" index4="0" index5="0">
    <offset x="-5.4" y="-1.2" z="0.07"/>
    <orientation s="1.0" v1="0.0" v2="0.0" v3="0.0"/>
  </solution>
  <solution name="ROVER_FRAME" add_date="2009-04-09T15:51:44Z" index1="137" index2="26" index3="0" index4="1" index5="0">
    <offset x="-4.86047" y="-1.20379" z="0.0627362"/>
    <orientation s="0.99818" v1="-0.0419613" v2="0.0226267" v3="0.0369425"/>
  </solution>
  <solution name="SITE_FRAME" add_date="2009-04-09T15:51:44Z" index1="137"/>
</rmc_file>"#;

#[test]
fn one_solution_of_each_drive_counter_remains_the_latest() {
    let all = rvf::parse(SHORT).unwrap();
    assert_eq!(all.len(), 3);
    let kept = rvf::one_per_drive_counter(all);
    let drives: Vec<u32> = kept.iter().map(rvf::RecordedPose::drive).collect();
    assert_eq!(drives, [26, 28]);
    assert_eq!(kept[1].counter, [137, 28, 0, 0, 0]);
    assert!((kept[1].site_from_rover.translation.x + 5.4).abs() < 1e-12);
    assert!((kept[0].site_from_rover.rotation.euler_angles().2.to_degrees() - 4.13).abs() < 0.02);
}

#[test]
fn a_damaged_solution_is_named() {
    let problem = rvf::parse(&SHORT.replace("y=\"-1.2\"", "y=\"west\"")).unwrap_err();
    assert_eq!(problem, "offset y of the solution of counter [137, 28, 0, 0, 0] is missing or no number");
    let problem = rvf::parse(&SHORT.replace("s=\"1.0\"", "s=\"0.5\"")).unwrap_err();
    assert_eq!(problem, "orientation of the solution of counter [137, 28, 0, 0, 0] is not of unit length");
    assert!(rvf::parse("<rmc_file>").unwrap_err().starts_with("is no XML: "));
}

/// The recorded poses, if the data are there.
fn recorded() -> Option<Vec<rvf::RecordedPose>> {
    let file = sightline_testdata::recorded(rvf::FILE, "the replay of Spirit's motion")?;
    Some(rvf::read(file.parent()?.parent()?).unwrap())
}

#[test]
fn the_path_has_131_counters_and_keeps_the_recorded_motions() {
    let Some(recorded) = recorded() else { return };
    let path = Path::new(&recorded).unwrap();
    let [space_m, level_m] = path.length_m();
    assert_eq!(path.poses.len(), 131);
    assert!((space_m - 23.525).abs() < 1e-3 && (level_m - 23.409).abs() < 1e-3, "{space_m} {level_m}");
    let start = path.poses[0];
    assert!(start.translation.vector.xy().norm() < 1e-12 && start.rotation.euler_angles().2.abs() < 1e-12);
    for (pair, poses) in recorded.windows(2).zip(path.poses.windows(2)) {
        let wanted = pair[0].site_from_rover.inv_mul(&pair[1].site_from_rover);
        let off = wanted.inverse() * poses[0].inv_mul(&poses[1]);
        assert!(off.translation.vector.norm() < 1e-12 && off.rotation.angle() < 1e-7);
    }
}

#[test]
fn wheels_turn_for_half_a_metre_where_the_rover_moved_little() {
    let Some(recorded) = recorded() else { return };
    let path = Path::new(&recorded).unwrap();
    let by_wheels = path.by_wheels(&path.scenario(1, 128, 1).unwrap());
    for (pair, predicted) in path.poses.windows(2).zip(&by_wheels) {
        let moved_m = (pair[1].translation.vector - pair[0].translation.vector).norm();
        let wheels_m = if moved_m < 0.25 { 0.5 } else { moved_m };
        assert!((predicted.translation.vector.norm() / wheels_m - 1.0).abs() < 0.05);
        let turn = predicted.rotation.angle_to(&pair[1].inv_mul(&pair[0]).rotation);
        assert!(turn.to_degrees() < 0.5, "{}", turn.to_degrees());
    }
}

#[test]
fn a_short_replay_measures_the_recorded_steps() {
    let Some(recorded) = recorded() else { return };
    let path = Path::new(&recorded).unwrap().first(5);
    let replay = Replay { path: &path, seed: 3, image_size: 256, samples_per_axis: 1 };
    let folder = std::env::temp_dir().join(format!("sightline-spirit-test-{}", std::process::id()));
    let report = replay.run(&folder, Cancel::default(), &mut |_| ()).unwrap();
    assert!(!folder.exists());
    assert_eq!((report.counters, report.steps.len()), (5, 4));
    assert_eq!(report.bins.iter().map(|bin| bin.counters).sum::<usize>(), 4);
    assert!(report.camera_height_m[0] > 1.0 && report.camera_height_m[1] < 2.0);
    // The three steps of half a metre; what becomes of the gap of 5 m before them is not the matter here.
    for step in &report.steps[1..] {
        println!("{step:?}");
        assert!(step.accepted && step.error_m.unwrap() < 0.02, "{step:?}");
    }
}
