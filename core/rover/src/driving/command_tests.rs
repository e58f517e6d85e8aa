//! Tests of drive commands: rejected values, and files of earlier versions.

use super::*;

#[test]
fn the_pairs_of_the_hazard_map_are_read_from_older_files_too() {
    let read = |text: &str| serde_json::from_str::<DriveCommand>(text);
    let names =
        |text: &str| read(text).unwrap().hazard_cameras.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert!(names("{}").is_empty() && names(r#"{"hazard_camera": null}"#).is_empty());
    assert_eq!(names(r#"{"hazard_camera": "front_hazcam"}"#), ["front_hazcam"]);
    assert_eq!(names(r#"{"hazard_cameras": ["left_wedge", "right_wedge"]}"#), ["left_wedge", "right_wedge"]);
    let refused = read(r#"{"hazard_cameras": ["Left wedge"]}"#).unwrap_err().to_string();
    assert!(refused.contains("names of cameras, each of 1 to 32 characters"), "{refused}");
}

#[test]
fn a_command_is_refused_with_the_field_that_is_wrong() {
    let ahead = Point3::new(8.0, 1.0, 0.2);
    let told = |change: fn(&mut DriveCommand), target: Point3| {
        let mut command = DriveCommand::default();
        change(&mut command);
        command.validate_for(&target).map_err(|error| error.to_string())
    };
    assert!(told(|_| (), ahead).is_ok());
    for (change, target, part) in [
        (
            (|c| c.standoff_m = 9.0) as fn(&mut DriveCommand),
            ahead,
            "standoff_m: 9 m is not less than the 8.06 m",
        ),
        (|c| c.standoff_m = f64::NAN, ahead, "standoff_m: NaN is outside"),
        (|_| (), Point3::new(-3.0, 1.0, 0.2), "3.00 m behind the rover"),
        (|c| (c.standoff_m, c.tolerance_m) = (0.5, 0.5), ahead, "tolerance_m"),
        (|c| c.step_fraction = 0.0, ahead, "step_fraction"),
        (|c| c.stops_max = 1, ahead, "stops_max"),
        (
            |c| c.motions = vec![Motion::Arc { length_m: 30.0, curvature_per_m: 0.0 }],
            ahead,
            "motions[0]: length in m: 30 is outside -20 to 20",
        ),
        (|c| c.slip_max = 0.0, ahead, "slip_max"),
        (|c| c.on_arrival = vec![ArrivalAction::Look; 11], ahead, "on_arrival"),
        (
            |c| c.on_arrival = vec![ArrivalAction::Approach; 2],
            ahead,
            "on_arrival: the rover can approach once",
        ),
        (
            |c| (c.standoff_m, c.on_arrival) = (1.2, vec![ArrivalAction::Approach]),
            ahead,
            "final_standoff_m: 1.3 m is not less than the standoff of 1.2 m",
        ),
        (
            |c| {
                c.motions = vec![Motion::Turn { angle_rad: 0.1 }];
                c.on_arrival = vec![ArrivalAction::Approach];
            },
            ahead,
            "on_arrival: an approach needs a goal",
        ),
        (
            |c| c.hazard_cameras = ["left_wedge", "left_wedge"].map(|name| name.parse().unwrap()).to_vec(),
            ahead,
            "hazard_cameras: left_wedge is named twice",
        ),
        (
            |c| (c.stops_max, c.on_arrival) = (3, vec![ArrivalAction::Look; 2]),
            ahead,
            "stops_max: 3 stops are too few for two stops and 2 looks",
        ),
    ] {
        let message = told(change, target).unwrap_err();
        assert!(message.contains(part), "{message}");
    }
}
