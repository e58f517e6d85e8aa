//! A new user's first minutes: from the first page to why the target was lost, and to what would have saved it, by keys and
//! by names alone, each action counted. Nothing but what the page shows is used to find the way.

use sightline_recordings::create_simulated;
use sightline_server::first_session;
use sightline_server::state::AppState;
use sightline_tests::browser::Browser;
use sightline_tests::server::{TOKEN, access};
use sightline_world::Scenario;

/// Actions from the first page to the cause, at most.
const TO_THE_CAUSE: usize = 6;

/// Further actions to a branch that keeps the target, at most.
const TO_THE_FIX: usize = 3;

/// What a person does, written down.
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

/// Serves the drive with which a new user begins.
async fn serve(scenario: &Scenario, folder: &std::path::Path) -> u16 {
    let traverse = create_simulated(scenario, &folder.join("first")).unwrap();
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let port = listener.local_addr().unwrap().port();
    let state = AppState::new(vec![traverse], &folder.join("sessions"), access(port)).unwrap();
    first_session::begin(&state, scenario).unwrap();
    tokio::spawn(async move { axum::serve(listener, sightline_server::app(state)).await });
    port
}

#[tokio::test(flavor = "multi_thread")]
async fn a_new_user_finds_why_the_first_target_was_lost_and_what_saves_it() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = first_session::scenario().unwrap();
    let port = serve(&scenario, folder.path()).await;
    let browser = Browser::start().await;
    browser.goto(&format!("http://127.0.0.1:{port}/#token={TOKEN}")).await;
    browser.wait_for_viewer().await;
    browser.wait_status("the first target", "s.target === 0 && s.shown").await;
    browser.says("1 of 6").await;
    browser.shot("first-1-page").await;
    // The loss may still have to be computed; the page shows how far the run is meanwhile.
    browser.wait_status("the loss", "s.steps_done > 1 && !s.running").await;

    let mut walk = Walk { browser: &browser, done: Vec::new() };
    walk.click("Skip", "the tour is for later").await;
    browser.gone("button", "Skip").await;
    walk.press("PageDown", "to the next event: where the band changes its colour").await;
    browser.wait_status("the step of the loss", "s.state === 'lost' && s.shown").await;
    browser.shot("first-2-lost").await;
    walk.press("w", "why").await;
    browser.says("Rejected:").await;
    browser.says("The heading estimate jumped by").await;
    browser.says("the target is outside the search window").await;
    browser.shot("first-3-why").await;
    assert!(walk.done.len() <= TO_THE_CAUSE, "{:?}", walk.done);
    println!("to the cause: {:?}", walk.done);

    let before = walk.done.len();
    walk.click("What would have saved it?", "the counterfactual").await;
    browser.control("button", "run from here with finding 1").await;
    browser.shot("first-4-saved").await;
    walk.click("run from here with finding 1", "a branch with the first finding").await;
    browser.wait_status("the branch", "s.run === 1 && s.steps_done > s.step + 1 && !s.running").await;
    browser.wait_status("the step of the loss in the branch", "s.shown && s.state === 'tracking'").await;
    walk.press("y", "a link to it").await;
    browser.says("The link to what you see is copied.").await;
    browser.shot("first-5-branch").await;
    assert!(walk.done.len() - before <= TO_THE_FIX, "{:?}", walk.done);
    println!("to the fix: {:?}", &walk.done[before..]);

    // Whoever gets the link sees the branch at that step.
    let link = browser.fragment().await;
    let other = Browser::start().await;
    other.goto(&format!("http://127.0.0.1:{port}/#{link}&token={TOKEN}")).await;
    other.wait_for_viewer().await;
    other.wait_status("the same place", "s.run === 1 && s.shown && s.state === 'tracking'").await;
    assert_eq!(browser.console_errors().await, Vec::<String>::new());
    assert_eq!(other.console_errors().await, Vec::<String>::new());
    other.close().await;
    browser.close().await;
}
