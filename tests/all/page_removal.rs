//! Removing sessions and drives in a real browser. The test ends by checking the console for errors.

use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;
use sightline_world::Scenario;

use crate::page_open::drop_one;

#[tokio::test(flavor = "multi_thread")]
async fn sessions_and_drives_are_removed_where_they_are_listed() {
    let (fixture, browser) = picked(&short_approach()).await;
    let first = browser.status().await["session"].as_str().unwrap().to_owned();
    let hill = Scenario { name: "the other hill".to_owned(), seed: 5, ..short_approach() };
    drop_one(&browser, "hill.toml", hill.to_toml().as_bytes()).await;
    let on_hill = "(s.traverse || '').startsWith('the-other-hill-') && s.targets === 0";
    browser.wait_for_status("the drive", on_hill).await;
    let second = browser.status().await["session"].as_str().unwrap().to_owned();

    // A session that was removed by mistake is restored with one click.
    browser.chord(&["Control"], "o").await;
    browser.click_on("button", &format!("remove session {first}")).await;
    browser.control("button", &format!("restore session {first}")).await;
    browser.wait_until_gone("button", &format!("session {first} on ")).await;
    browser.save_screenshot("removed").await;
    browser.click_on("button", &format!("restore session {first}")).await;
    // The list is read again, and its rows move.
    browser.wait_until_gone("button", &format!("restore session {first}")).await;
    browser.control("button", &format!("remove session {first}")).await;
    browser.click_on("button", &format!("session {first} on ")).await;
    let shown = format!("s.session === '{first}' && s.targets === 1 && s.shown");
    browser.wait_for_status("the first session", &shown).await;

    // A drive is removed after a confirmation, and only if it has no sessions.
    browser.chord(&["Control"], "o").await;
    browser.click_on("button", &format!("remove session {second}")).await;
    browser.control("button", &format!("restore session {second}")).await;
    browser.click_on("button", "remove the drive the other hill").await;
    browser.click_on("button", "really remove the drive the other hill").await;
    browser.wait_until_gone("button", "new session on the other hill").await;
    let list = fixture.get("/api/v1/traverses");
    assert!(!String::from_utf8_lossy(&list).contains("other hill"));
    browser.end().await;
}
