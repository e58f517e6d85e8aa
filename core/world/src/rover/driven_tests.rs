//! Drives over level ground and against rocks, and a truncated one.

use super::*;

fn drive(scenario: &Scenario, world: &World, motions: &[[f64; 2]]) -> Vec<DrivenStop> {
    let mut stops = vec![DrivenStop::first(world, scenario, Cancel::default()).unwrap()];
    for motion in motions {
        let last = &stops[stops.len() - 1];
        let next = last.next(world, scenario, stops.len(), *motion, Cancel::default()).unwrap();
        stops.push(next);
    }
    stops
}

fn flat() -> Scenario {
    let mut scenario = Scenario::default();
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.0, 0);
    scenario.terrain.rms_at_1m_m = 0.0;
    scenario.camera.image_size = 64;
    scenario
}

#[test]
fn on_level_ground_without_slip_the_rover_goes_where_it_is_told() {
    let scenario = flat();
    let world = World::new(&scenario);
    let quarter = std::f64::consts::FRAC_PI_2;
    let stops =
        drive(&scenario, &world, &[[2.0, 0.0], [3.0 * quarter, quarter], [0.0, -quarter], [-1.0, 0.0]]);
    let places: Vec<[f64; 2]> = stops
        .iter()
        .map(|stop| stop.true_site_from_rover.to_pose().translation.vector)
        .map(|v| [v.x, v.y])
        .collect();
    let expected = [[0.0, 0.0], [2.0, 0.0], [5.0, 3.0], [5.0, 3.0], [4.0, 3.0]];
    for (place, wanted) in places.iter().zip(expected) {
        let (dx, dy) = (place[0] - places[0][0] - wanted[0], place[1] - places[0][1] - wanted[1]);
        assert!(dx.hypot(dy) < 1e-9, "{place:?} {wanted:?}");
    }
    // 3.75 cm a second, and a minute at each stop.
    assert!((stops[1].time_s - (60.0 + 2.0 / 0.0375)).abs() < 1e-9);
}

#[test]
fn a_drive_cut_after_any_stop_continues_with_the_same_bits() {
    let mut scenario = Scenario { seed: 77, ..Scenario::default() };
    (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.3);
    scenario.terrain.slope_deg = 8.0;
    for odometry in [crate::scenario::OdometryModel::Stated, crate::scenario::OdometryModel::WheelsAndImu] {
        scenario.rover.odometry = odometry;
        let world = World::new(&scenario);
        let motions = [[0.5, 0.1], [0.3, -0.05], [0.0, 0.2], [0.4, 0.0]];
        let whole = drive(&scenario, &world, &motions);
        let text = serde_json::to_string(&whole[2]).unwrap();
        let kept: DrivenStop = serde_json::from_str(&text).unwrap();
        let next = kept.next(&world, &scenario, 3, motions[2], Cancel::default()).unwrap();
        assert_eq!(next, whole[3]);
        // Uphill the wheels lose some of their advance, a different fraction at each step.
        let advance = |k: usize| {
            let [a, b] =
                [&whole[k - 1], &whole[k]].map(|s| s.true_site_from_rover.to_pose().translation.vector);
            (b - a).norm() / motions[k - 1][0]
        };
        assert!(advance(1) < 0.99 && (advance(1) - advance(2)).abs() > 1e-3, "{} {}", advance(1), advance(2));
    }
}

#[test]
fn a_wheel_against_a_high_rock_stalls_where_it_stands() {
    let mut scenario = flat();
    let rock = |x_m: f64, y_m: f64| crate::scenario::PlacedRock {
        x_m,
        y_m,
        diameter_m: 0.5,
        height_m: 0.4,
        yaw_deg: 180.0,
        shape: crate::scenario::RockShape::Block,
    };
    // The targets' centre is 10.3 m ahead; a rock is 2 m ahead of the right front wheel.
    scenario.rocks.placed = vec![rock(-10.3 + 2.7, 0.53)];
    let world = World::new(&scenario);
    let stops = drive(&scenario, &world, &[[4.0, 0.0], [-0.5, 0.0]]);
    assert!((0.3..0.6).contains(&stops[1].completed), "{}", stops[1].completed);
    assert_eq!(stops[2].completed, 1.0, "it can go back");
    assert_eq!(stops[1].touched_rocks, 0);
    // Whether a rock of 24 cm is climbed depends on the setting.
    scenario.rocks.placed[0].height_m = 0.24;
    for (climb_m, is_climbed) in [(0.25, true), (0.2, false)] {
        scenario.rover.climb_m = climb_m;
        let world = World::new(&scenario);
        let stops = drive(&scenario, &world, &[[4.0, 0.0]]);
        assert_eq!(stops[1].completed == 1.0, is_climbed, "{climb_m} m");
    }
}

#[test]
fn a_rock_in_the_rovers_body_is_counted() {
    let mut scenario = flat();
    let shape = crate::scenario::RockShape::Block;
    let tall = |height_m: f64| crate::scenario::PlacedRock {
        x_m: -10.3 + 3.0,
        y_m: 0.0,
        diameter_m: 0.3,
        height_m,
        yaw_deg: 180.0,
        shape,
    };
    for (height_m, touched) in [(0.15, 0), (0.4, 1)] {
        scenario.rocks.placed = vec![tall(height_m)];
        let world = World::new(&scenario);
        let stops = drive(&scenario, &world, &[[3.0, 0.0]]);
        assert_eq!(stops[1].touched_rocks, touched, "{height_m} m");
    }
}
