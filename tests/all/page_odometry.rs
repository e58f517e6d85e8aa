//! Visual odometry in a real browser: on a slope wheels and vision disagree, and a branch drives on without vision.

use serde_json::Value;
use sightline_tests::bench::picked;
use sightline_tests::scenario::short_approach;
use sightline_world::Scenario;
use sightline_world::scenario::OdometryModel;

/// A slope on which the wheels lose a part of their way.
fn slope() -> Scenario {
    let mut scenario = short_approach();
    (scenario.terrain.slope_deg, scenario.terrain.slope_azimuth_deg) = (14.0, 30.0);
    (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.2);
    scenario.rover.odometry = OdometryModel::WheelsAndImu;
    scenario
}

#[tokio::test(flavor = "multi_thread")]
async fn vision_shows_the_slip_and_a_branch_drives_on_without_it() {
    let (bench, browser) = picked(&slope()).await;
    let planned = browser.status().await["session"].as_str().unwrap().to_owned();
    browser.show_panel("Drive").await;
    browser.says("vision corrects the pose").await;
    browser.click_on("button", "Drive").await;
    let ended = |session: &str| {
        format!(
            "s.session !== '{session}' && s.drive && s.drive !== 'drives' && s.drive !== 'waits' && s.shown"
        )
    };
    browser.wait_status("the end of the drive", &ended(&planned)).await;
    browser.says("% ±").await;
    browser.shot("odometry-drive").await;
    let trunk = browser.status().await["session"].as_str().unwrap().to_owned();

    // The stage of the record, beside the six of the tracker.
    let url = format!("/api/v1/sessions/{trunk}/targets/0/runs/0/steps/1");
    let step: Value = serde_json::from_slice(&bench.get(&url)).unwrap();
    let measured = &step["odometry"];
    assert_eq!((&measured["corrects"], &measured["update"]["accepted"]), (&true.into(), &true.into()));
    let slip = measured["update"]["slip"]["along"].as_f64().unwrap();
    assert!((0.02..0.9).contains(&slip.abs()), "{slip}");

    // From stop 1 on by wheels and gyro alone.
    browser.go_to("1", 1).await;
    browser.click_on("combobox", "visual odometry").await;
    browser.choose("no visual odometry").await;
    browser.click_on("button", "Branch at stop 1").await;
    browser.wait_status("the end of the branch", &ended(&trunk)).await;
    browser.shot("odometry-branch").await;
    let branch = browser.status().await["session"].as_str().unwrap().to_owned();
    let url = format!("/api/v1/sessions/{branch}/targets/0/runs/0/steps/2");
    let step: Value = serde_json::from_slice(&bench.get(&url)).unwrap();
    assert!(step["odometry"].is_null() && !step["predict"].is_null());
    browser.end().await;
}
