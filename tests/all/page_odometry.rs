//! Visual odometry in a real browser: on a slope of loose sand wheels and vision disagree, and a branch that drives on without
//! vision loses the target.

use serde_json::Value;
use sightline_tests::bench::{Bench, picked};
use sightline_tests::browser::Browser;
use sightline_tests::scenario::short_approach;
use sightline_world::Scenario;
use sightline_world::scenario::{OdometryModel, Soil};

/// A slope of loose sand, across which the rover slides.
fn slope() -> Scenario {
    let mut scenario = short_approach();
    (scenario.terrain.slope_deg, scenario.terrain.slope_azimuth_deg) = (18.0, 90.0);
    (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.2);
    (scenario.rover.soil, scenario.rover.odometry) = (Soil::LooseSand, OdometryModel::WheelsAndImu);
    scenario
}

/// Whether the drive of another session than `session` has ended.
fn ended(session: &str) -> String {
    format!("s.session !== '{session}' && s.drive && s.drive !== 'drives' && s.drive !== 'waits' && s.shown")
}

async fn session(browser: &Browser) -> String {
    browser.status().await["session"].as_str().unwrap().to_owned()
}

/// The record of a step of the first run.
fn step(bench: &Bench, session: &str, step: usize) -> Value {
    bench.json(&format!("/api/v1/sessions/{session}/targets/0/runs/0/steps/{step}"))
}

/// Distance between the prediction and the true pixel in the left image, px.
fn prediction_error_px(step: &Value) -> f64 {
    let (predicted, truth) = (&step["point_mast"]["predicted_left"], &step["truth"]["left_pixel"]);
    let along = |axis: &str| predicted[axis].as_f64().unwrap() - truth[axis].as_f64().unwrap();
    along("x").hypot(along("y"))
}

/// The panel says what vision and wheels disagree about, and shows the corners.
async fn check_panel(browser: &Browser) {
    browser.go_to("2", 2).await;
    browser.show_panel("Odometry").await;
    browser.says("The pose of step 2 is by vision.").await;
    browser.says("% along the motion").await;
    browser.says("The translations by wheels and by vision differ by ").await;
    browser.control("checkbox", "inliers ").await;
    browser.says("left image: corners of step 1").await;
    browser.says("left image: matches at step 2").await;
    browser.says("slip over the steps: ").await;
    browser.shot("odometry-panel").await;
    browser.resize(1900, 1800).await;
    browser.says("motion, rover frame of the stop before".to_uppercase().as_str()).await;
    browser.says("σ of the translation").await;
    browser.shot("odometry-panel-large").await;
    browser.resize(1600, 1000).await;
    // The same corners are a layer of the page's left image.
    browser.click_on("button", "legend").await;
    browser.click_on("checkbox", "odometry from step 1").await;
    browser.shot("odometry-layer").await;
    browser.click_on("checkbox", "odometry from step 1").await;
    browser.press("Escape").await;
    browser.click_on("button", "visual_odometry").await;
    browser.show_panel("Inspector").await;
    browser.says("How did the rover move since the stop before").await;
    browser.says("wheels apart").await;
    browser.go_to("0", 0).await;
    browser.show_panel("Odometry").await;
    browser.says("no motion led there").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn vision_shows_the_slip_and_a_branch_without_it_loses_the_target() {
    let (bench, browser) = picked(&slope()).await;
    let planned = session(&browser).await;
    browser.show_panel("Drive").await;
    browser.says("vision corrects the pose").await;
    browser.click_on("button", "Drive").await;
    browser.wait_status("the end of the drive", &ended(&planned)).await;
    browser.says("% ±").await;
    browser.shot("odometry-drive").await;
    let trunk = session(&browser).await;
    let stops = browser.status().await["stop_count"].as_u64().unwrap() as usize;
    for number in 1..stops {
        let step = step(&bench, &trunk, number);
        let measured = &step["odometry"];
        assert_eq!((&measured["corrects"], &measured["update"]["accepted"]), (&true.into(), &true.into()));
        assert_eq!(step["update"]["state"]["kind"].as_str().unwrap_or("tracking"), "tracking", "{number}");
        assert!(prediction_error_px(&step) < 12.0, "step {number}: {}", prediction_error_px(&step));
    }
    let slip = &step(&bench, &trunk, 2)["odometry"]["update"]["slip"];
    let share = slip["along"].as_f64().unwrap().hypot(slip["aside"].as_f64().unwrap());
    assert!((0.05..0.95).contains(&share), "{slip}");
    check_panel(&browser).await;

    // From stop 1 on by wheels and gyro alone.
    browser.go_to("1", 1).await;
    browser.show_panel("Drive").await;
    browser.click_on("combobox", "visual odometry").await;
    browser.choose("no visual odometry").await;
    browser.click_on("button", "Branch at stop 1").await;
    browser.wait_status("the end of the branch", &ended(&trunk)).await;
    browser.shot("odometry-branch").await;
    let branch = session(&browser).await;
    let status = browser.status().await;
    assert_eq!(status["drive"], "target lost", "{status}");
    let last = status["stop_count"].as_u64().unwrap() as usize - 1;
    let lost = step(&bench, &branch, last);
    assert!(lost["odometry"].is_null());
    // The template is compared at places up to half of what the window leaves around it.
    let window = &lost["locate"]["evidence"]["match_template"]["search_window"];
    let half_px = window["width"].as_f64().unwrap() / 2.0;
    assert!(prediction_error_px(&lost) > half_px, "{} in {window}", prediction_error_px(&lost));
    browser.go_to(&last.to_string(), last).await;
    browser.show_panel("Odometry").await;
    browser.says("Visual odometry is off").await;
    browser.press("w").await;
    browser.says("outside the search window").await;
    browser.shot("odometry-why").await;
    // Where it is lost first, the scores are good and the position is impossible: the pose is to blame.
    let first = (2..=last).find(|number| {
        let state = &step(&bench, &branch, *number)["update"]["state"];
        state.to_string().contains("lost")
    });
    let first = first.expect("a step at which the target is lost");
    browser.go_to(&first.to_string(), first).await;
    browser.says("The pose is without visual odometry, and the scores of the match are good but").await;
    browser.end().await;
}
