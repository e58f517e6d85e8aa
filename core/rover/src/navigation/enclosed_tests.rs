//! Tests of goals that bad ground encloses.

use super::settings::NavigatorPreset;
use super::tests::{Rock, known, known_to, pose, rocks_height, select};
use crate::hazards::HazardSettings;

#[test]
fn a_goal_within_a_ring_of_rocks_is_enclosed() {
    let ring: Vec<Rock> = (0..16)
        .map(|k| {
            let (sine, cosine) = (f64::from(k) * std::f64::consts::TAU / 16.0).sin_cos();
            Rock { at: [3.5 + 1.7 * cosine, 1.7 * sine], radius: 0.25, height: 0.4 }
        })
        .collect();
    let stance = pose([0.0, 0.0], 0.0);
    let map = known(&stance, &HazardSettings::default(), |x, y| rocks_height(&ring, x, y));
    let choice = select(NavigatorPreset::Gestalt, &map, &stance, [3.5, 0.0], 0.6);
    let blocked = choice.blocked_goal.unwrap();
    assert_eq!(blocked.ground, None, "the goal itself is on good ground");
    assert!(blocked.nearest_from_goal_m.unwrap() > 2.5, "outside the ring: {blocked:?}");
    assert!(blocked.sentence().starts_with("bad ground encloses the goal; the nearest place"));
    assert!(choice.motion().is_some());
    // With a gate in the ring there is a way.
    let gate: Vec<Rock> = ring.iter().copied().filter(|rock| rock.at[1] < 1.0).collect();
    let map = known(&stance, &HazardSettings::default(), |x, y| rocks_height(&gate, x, y));
    let choice = select(NavigatorPreset::Gestalt, &map, &stance, [3.5, 0.0], 0.6);
    assert_eq!(choice.blocked_goal, None);
    assert!(choice.motion().is_some());
}

#[test]
fn a_goal_behind_a_corner_that_the_rover_cannot_turn_in_is_enclosed() {
    // The only way out leads to the right of the goal and then towards the rover; it is 1.9 m wide, the discs need 1.6 m.
    let is_free = |x: f64, y: f64| {
        let is_in = |[x_from, x_to]: [f64; 2], [y_from, y_to]: [f64; 2]| {
            (x_from..x_to).contains(&x) && (y_from..y_to).contains(&y)
        };
        is_in([-0.95, 0.95], [-0.95, 2.5]) || is_in([-5.0, 0.95], [0.6, 2.5])
    };
    let is_wall = |x: f64, y: f64| x.abs() < 3.0 && y.abs() < 3.0 && !is_free(x, y);
    let goal = [5.0, 1.0];
    let stance = pose([0.0, 0.0], 0.0);
    let height = |x: f64, y: f64| if is_wall(x - goal[0], y - goal[1]) { -0.4 } else { 0.0 };
    let map = known_to(8.0, &stance, &HazardSettings::default(), height);
    let choice = select(NavigatorPreset::Gestalt, &map, &stance, goal, 0.6);
    let blocked = choice.blocked_goal.unwrap();
    assert!(blocked.ground.is_none() && blocked.nearest_from_goal_m.unwrap() < 1.0, "{blocked:?}");
    assert!(choice.motion().is_some());
}
