//! Visual odometry on recorded frames against what their recordings allow.

use super::odometry::OdometryRow;
use super::odometry_matches::PairMatches;
use super::tests::recorded;
use super::*;

fn odometry(recording: &Recording, set: Set) -> Vec<(OdometryRow, PairMatches)> {
    let mut motions = recording.odometry().unwrap();
    motions.retain(|(row, _)| row.row.set == set);
    for (row, _) in &motions {
        println!("{row:?}");
    }
    motions
}

/// The recording's own poses are good to 0.16°, worst in its first frames, and 1.5 %.
#[test]
fn odometry_follows_a_car_within_what_its_recording_allows() {
    let Some(data) = recorded("kitti-seq1-frames-0-19") else { return };
    let motions = odometry(&kitti::read(&data, usize::MAX).unwrap(), Set::KittiEveryFrame);
    assert_eq!(motions.len(), 19);
    for (row, _) in &motions {
        assert!(row.accepted && row.refusal.is_none(), "{}: {:?}", row.row.pair, row.refusal);
        let error = row.row.error.unwrap();
        assert!(error.rotation_deg <= 0.16 && error.translation_percent.unwrap() <= 1.5, "{error:?}");
    }
    let rows: Vec<Row> = motions.into_iter().map(|(row, _)| row.row).collect();
    assert!(summarise(&rows)[0].translation_percent.unwrap()[0] <= 1.0);
}

/// OpenCV's PnP on the same inliers ends 0.29° and 4.1 cm from the recorded poses, so the bounds are those of the poses.
#[test]
fn odometry_finds_a_helicopters_turn_from_a_prediction_one_degree_off() {
    let Some(data) = recorded("euroc-v101") else { return };
    let motions = odometry(&euroc::read(&data, Set::EurocPair).unwrap(), Set::EurocPair);
    let [(row, _)] = motions.as_slice() else { panic!("{} pairs", motions.len()) };
    let error = row.row.error.unwrap();
    assert!(row.accepted && error.rotation_deg <= 0.35 && error.translation_m <= 0.045, "{row:?}");
}

#[test]
fn odometry_reports_no_motion_of_a_rig_that_stands_whatever_its_wheels_report() {
    let Some(data) = recorded("euroc-v101") else { return };
    let recording = euroc::read(&data, Set::EurocStill).unwrap();
    for set in [Set::EurocStill, Set::EurocSpinning] {
        let motions = odometry(&recording, set);
        assert_eq!(motions.len(), 3);
        for (row, _) in motions {
            let error = row.row.error.unwrap();
            assert!(row.accepted && error.translation_m < 0.001 && error.rotation_deg < 0.02, "{row:?}");
            // χ² of 6 degrees of freedom is more in one of 1000 cases.
            assert!(row.nees.unwrap() < 22.5, "{row:?}");
        }
    }
}

/// The positions before, moved by the motion, are seen at the pixels after.
#[test]
fn inliers_for_other_programs_agree_with_the_motion() {
    let Some(data) = recorded("kitti-seq1-frames-0-19") else { return };
    for (row, matches) in odometry(&kitti::read(&data, 3).unwrap(), Set::KittiEveryFrame) {
        assert_eq!(matches.inliers.len(), row.row.inliers);
        let motion = matches.after_from_before.unwrap().to_pose();
        let [fx, fy, cx, cy] = matches.intrinsics[0];
        let seen = |at: Point3| Pixel::new(cx + fx * at.x / at.z, cy + fy * at.y / at.z);
        let mut apart_px = Vec::new();
        for inlier in &matches.inliers {
            let before = Point3::from(inlier.before_m);
            let [x, y] = inlier.before_px;
            assert!(seen(before).distance(Pixel::new(x, y)) < 1e-6);
            let [x, y] = inlier.after_px;
            apart_px.push(seen(motion * before).distance(Pixel::new(x, y)));
        }
        assert!(median(&apart_px).unwrap() < 0.3, "{:?}", median(&apart_px));
    }
}
