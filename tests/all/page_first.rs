//! The first minutes of a new user: from the first page to the cause of the loss and to the change that would have prevented
//! it, only by keys and by names that the page shows. Each action is counted.

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::first_page;
use sightline_tests::server::TOKEN;

/// Maximum number of actions from the first page to the cause.
const TO_THE_CAUSE: usize = 6;

/// Maximum number of further actions to a branch that keeps the target.
const TO_THE_FIX: usize = 3;

/// The actions of the user, in order.
struct Walk<'a> {
    browser: &'a Browser,
    done: Vec<String>,
}

impl Walk<'_> {
    async fn press(&mut self, key: &str, why: &str) {
        self.browser.press(key).await;
        self.done.push(format!("{key}: {why}"));
    }

    async fn click(&mut self, name: &str, why: &str) {
        self.browser.click_on("button", name).await;
        self.done.push(format!("click “{name}”: {why}"));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_user_finds_the_cause_of_the_first_loss_and_a_remedy() {
    let (fixture, browser) = first_page(&[]).await;
    browser.wait_for_text("1 of 6").await;
    browser.save_screenshot("first-1-page").await;

    let mut walk = Walk { browser: &browser, done: Vec::new() };
    walk.click("Skip", "the tour is for later").await;
    browser.wait_until_gone("button", "Skip").await;
    walk.press("PageDown", "to the next event: where the band changes its colour").await;
    browser.wait_for_status("the step of the loss", "s.state === 'lost' && s.shown").await;
    browser.save_screenshot("first-2-lost").await;
    walk.press("w", "why").await;
    browser.wait_for_text("Rejected:").await;
    browser.wait_for_text("The heading estimate jumped by").await;
    browser.wait_for_text("the target is outside the search window").await;
    browser.save_screenshot("first-3-why").await;
    assert!(walk.done.len() <= TO_THE_CAUSE, "{:?}", walk.done);
    println!("to the cause: {:?}", walk.done);

    let before = walk.done.len();
    walk.click("What would have saved it?", "the counterfactual").await;
    browser.control("button", "run from here with finding 1").await;
    browser.save_screenshot("first-4-saved").await;
    walk.click("run from here with finding 1", "a branch with the first finding").await;
    browser.wait_for_status("the branch", "s.run === 1 && s.steps_done > s.step + 1 && !s.running").await;
    browser.wait_for_status("the step of the loss in the branch", "s.shown && s.state === 'tracking'").await;
    walk.press("y", "a link to it").await;
    browser.wait_for_text("The link to what you see is copied.").await;
    browser.save_screenshot("first-5-branch").await;
    assert!(walk.done.len() - before <= TO_THE_FIX, "{:?}", walk.done);
    println!("to the fix: {:?}", &walk.done[before..]);

    // The link opens the branch at that step.
    let link = browser.fragment().await;
    let other = Browser::start().await;
    other.goto(&format!("{}#{link}&token={TOKEN}", fixture.url())).await;
    other.wait_for_viewer().await;
    other.wait_for_status("the same place", "s.run === 1 && s.shown && s.state === 'tracking'").await;
    assert_eq!(browser.console_errors().await, Vec::<String>::new());
    assert_eq!(other.console_errors().await, Vec::<String>::new());
    other.close().await;
    browser.close().await;
}
