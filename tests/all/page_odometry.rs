//! Visual odometry in a real browser: on a slope of loose sand the motion by wheels differs from that by vision, and a
//! branch without visual odometry loses the target.

use serde_json::Value;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, picked};
use sightline_tests::scenario::short_approach;
use sightline_world::Scenario;
use sightline_world::scenario::{OdometryModel, Soil};

/// A slope of loose sand on which the rover slips sideways.
fn slope() -> Scenario {
    let mut scenario = short_approach();
    (scenario.terrain.slope_deg, scenario.terrain.slope_azimuth_deg) = (18.0, 90.0);
    (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.2);
    (scenario.rover.soil, scenario.rover.odometry) = (Soil::LooseSand, OdometryModel::WheelsAndImu);
    scenario
}

/// A script that is true when the drive of a session other than `session` has ended.
fn ended(session: &str) -> String {
    format!("s.session !== '{session}' && s.drive && s.drive !== 'drives' && s.drive !== 'waits' && s.shown")
}

async fn session(browser: &Browser) -> String {
    browser.status().await["session"].as_str().unwrap().to_owned()
}

/// The record of a step of the first run.
fn step(fixture: &BrowserFixture, session: &str, step: usize) -> Value {
    fixture.json(&format!("/api/v1/sessions/{session}/targets/0/runs/0/steps/{step}"))
}

/// Distance between the prediction and the true pixel in the left image, px.
fn prediction_error_px(step: &Value) -> f64 {
    let (predicted, truth) = (&step["point_mast"]["predicted_left"], &step["truth"]["left_pixel"]);
    let along = |axis: &str| predicted[axis].as_f64().unwrap() - truth[axis].as_f64().unwrap();
    along("x").hypot(along("y"))
}

/// Checks that the panel reports the difference of vision and wheels, and shows the corners.
async fn check_panel(browser: &Browser) {
    browser.go_to("2", 2).await;
    browser.show_panel("Odometry").await;
    browser.wait_for_text("The pose of step 2 is by vision.").await;
    browser.wait_for_text("% along the motion").await;
    browser.wait_for_text("The translations by wheels and by vision differ by ").await;
    browser.control("checkbox", "inliers ").await;
    browser.wait_for_text("left image: corners of step 1").await;
    browser.wait_for_text("left image: matches at step 2").await;
    browser.wait_for_text("slip over the steps: ").await;
    browser.save_screenshot("odometry-panel").await;
    browser.resize(1900, 1800).await;
    browser.wait_for_text("motion, rover frame of the stop before".to_uppercase().as_str()).await;
    browser.wait_for_text("σ of the translation").await;
    browser.save_screenshot("odometry-panel-large").await;
    browser.resize(1600, 1000).await;
    // The same corners are a layer of the left image.
    browser.click_on("button", "legend").await;
    browser.click_on("checkbox", "odometry from step 1").await;
    browser.save_screenshot("odometry-layer").await;
    browser.click_on("checkbox", "odometry from step 1").await;
    browser.press("Escape").await;
    browser.click_on("button", "visual_odometry").await;
    browser.show_panel("Inspector").await;
    browser.wait_for_text("How did the rover move since the stop before").await;
    browser.wait_for_text("wheels apart").await;
    browser.go_to("0", 0).await;
    browser.show_panel("Odometry").await;
    browser.wait_for_text("no motion led there").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn without_visual_odometry_slip_loses_the_target() {
    let (fixture, browser) = picked(&slope()).await;
    let planned = session(&browser).await;
    browser.show_panel("Drive").await;
    browser.wait_for_text("vision corrects the pose").await;
    browser.click_on("button", "Drive").await;
    browser.wait_for_status("the end of the drive", &ended(&planned)).await;
    browser.wait_for_text("% ±").await;
    browser.save_screenshot("odometry-drive").await;
    let trunk = session(&browser).await;
    let stops = browser.status().await["stop_count"].as_u64().unwrap() as usize;
    for number in 1..stops {
        let step = step(&fixture, &trunk, number);
        let measured = &step["odometry"];
        assert_eq!((&measured["corrects"], &measured["update"]["accepted"]), (&true.into(), &true.into()));
        assert_eq!(step["update"]["state"]["kind"].as_str().unwrap_or("tracking"), "tracking", "{number}");
        assert!(prediction_error_px(&step) < 12.0, "step {number}: {}", prediction_error_px(&step));
    }
    let slip = &step(&fixture, &trunk, 2)["odometry"]["update"]["slip"];
    let share = slip["along"].as_f64().unwrap().hypot(slip["aside"].as_f64().unwrap());
    assert!((0.05..0.95).contains(&share), "{slip}");
    check_panel(&browser).await;

    // From stop 1 on by wheels and gyro alone.
    browser.go_to("1", 1).await;
    browser.show_panel("Drive").await;
    browser.click_on("combobox", "visual odometry").await;
    browser.choose("no visual odometry").await;
    browser.click_on("button", "Branch at stop 1").await;
    browser.wait_for_status("the end of the branch", &ended(&trunk)).await;
    browser.save_screenshot("odometry-branch").await;
    let branch = session(&browser).await;
    let status = browser.status().await;
    assert_eq!(status["drive"], "target lost", "{status}");
    let last = status["stop_count"].as_u64().unwrap() as usize - 1;
    let lost = step(&fixture, &branch, last);
    assert!(lost["odometry"].is_null());
    // The search reaches at most half of what the template leaves free in the window.
    let window = &lost["locate"]["evidence"]["match_template"]["search_window"];
    let half_px = window["width"].as_f64().unwrap() / 2.0;
    assert!(prediction_error_px(&lost) > half_px, "{} in {window}", prediction_error_px(&lost));
    browser.go_to(&last.to_string(), last).await;
    browser.show_panel("Odometry").await;
    browser.wait_for_text("Visual odometry is off").await;
    browser.press("w").await;
    browser.wait_for_text("outside the search window").await;
    browser.save_screenshot("odometry-why").await;
    // At the first lost step the scores are good and the position is impossible: the pose is the cause.
    let first = (2..=last).find(|number| {
        let state = &step(&fixture, &branch, *number)["update"]["state"];
        state.to_string().contains("lost")
    });
    let first = first.expect("a step at which the target is lost");
    browser.go_to(&first.to_string(), first).await;
    browser
        .wait_for_text("The pose is without visual odometry, and the scores of the match are good but")
        .await;
    browser.end().await;
}
