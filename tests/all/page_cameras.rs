//! Several cameras per stop in a real browser: another camera is chosen, a target is picked in it, and its marks stay there.

use sightline_geometry::frames::Pixel;
use sightline_tests::browser_fixture::{canvas_position, picked};
use sightline_tests::scenario::short_approach;
use sightline_world::scenario::{CameraRig, FurtherRig};
use sightline_world::traverse::CameraSource;
use sightline_world::{Eye, Scenario, World, choose_targets, index, surface_point, true_camera_in_site};

fn scenario() -> Scenario {
    let mut scenario = short_approach();
    let further =
        |name: &str, rig| FurtherRig { name: name.parse().unwrap(), rig, look_deg: None, image_size: 512 };
    scenario.camera.further =
        vec![further("front_hazcam", CameraRig::MerFrontHazcam), further("pancam", CameraRig::MerPancam)];
    scenario
}

/// The second target of the scenario's rule in the first image of the pancams.
fn pixel_in_pancam(scenario: &Scenario) -> Pixel {
    let world = World::new(scenario);
    let index = index(scenario, &world).unwrap();
    let navcam = true_camera_in_site(&index.stops[0], Eye::Left).unwrap();
    let pixel = choose_targets(&world, scenario, &index)[0];
    let point = surface_point(&world, &navcam, pixel).unwrap();
    let pose = index.stops[0].truth.as_ref().unwrap().site_from_rover.to_pose();
    let CameraSource::Inline(pancam) = &index.stops[0].cameras[1].left.camera else { panic!("a model") };
    pancam.moved(&pose).project(&point).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_target_is_picked_and_marked_in_the_chosen_camera() {
    let scenario = scenario();
    let (fixture, browser) = picked(&scenario).await;
    browser.save_screenshot("cameras-main").await;
    browser.click_on("combobox", "Camera").await;
    browser.choose("pancam").await;
    browser
        .wait_for_status("the pancam's image", "s.shown && s.complete && s.left_image_size !== null")
        .await;
    browser.wait_for_text("is tracked in main pair").await;
    assert!(browser.fragment().await.contains("cam=pancam"), "{}", browser.fragment().await);
    browser.save_screenshot("cameras-pancam").await;

    browser.go_to("0", 0).await;
    browser.wait_for_status("the first image", "s.shown && s.complete && s.step === 0").await;
    browser.press("t").await;
    browser.wait_for_status("pick mode", "s.pick_mode").await;
    browser.save_screenshot("cameras-pick").await;
    let (x, y) = canvas_position(&browser, pixel_in_pancam(&scenario)).await;
    browser.click(x, y).await;
    browser.wait_for_status("the second target", "s.target === 1").await;
    let count = fixture.stop_count;
    browser
        .wait_for_status("its run", &format!("s.steps_done === {count} && !s.running && s.complete"))
        .await;
    let fragment = browser.fragment().await;
    assert!(!fragment.contains("cam="), "the images follow the target: {fragment}");
    // At a shorter range, the target leaves the narrow field of view of the pancams.
    browser.go_to("1", 1).await;
    browser.wait_for_status("a step of it", "s.shown && s.complete && s.state === 'tracking'").await;
    browser.save_screenshot("cameras-tracked-in-pancam").await;

    browser.click_on("combobox", "Camera").await;
    browser.choose("front_hazcam").await;
    browser.wait_for_status("the hazcam's image", "s.shown && s.complete").await;
    browser.wait_for_text("is tracked in pancam").await;
    browser.save_screenshot("cameras-hazcam").await;
    browser.end().await;
}
