//! Opening in a real browser: valid and invalid files are dropped on the page, and a recent session is opened. The test ends
//! by checking the console for errors.

use serde_json::{Value, json};
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;
use sightline_world::Scenario;

/// Sends the canvas the events of a browser when files are dragged over it (`dragover`) or dropped (`drop`).
async fn files(browser: &Browser, event: &str, files: &[(&str, &[u8])]) {
    let list: Vec<Value> = files.iter().map(|(name, bytes)| json!([name, bytes])).collect();
    let script = format!(
        "const data = new DataTransfer(); \
         for (const [name, bytes] of {}) data.items.add(new File([new Uint8Array(bytes)], name)); \
         document.getElementById('sightline').dispatchEvent( \
             new DragEvent('{event}', {{dataTransfer: data, bubbles: true, cancelable: true}}))",
        Value::from(list)
    );
    browser.evaluate(&script).await;
}

pub(crate) async fn drop_one(browser: &Browser, name: &str, bytes: &[u8]) {
    files(browser, "drop", &[(name, bytes)]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn dropped_files_open_or_name_their_fault() {
    let (fixture, browser) = picked(&short_approach()).await;
    let first = browser.status().await["session"].as_str().unwrap().to_owned();

    files(&browser, "dragover", &[("drive.toml", b"seed = 1")]).await;
    browser.wait_for_text("Drop one file to open it").await;
    browser.save_screenshot("drop-veil").await;
    // Two files at once, no drive, no text, a file that is too large, and an unknown field.
    files(&browser, "drop", &[("a.toml", b"seed = 1"), ("b.toml", b"seed = 2")]).await;
    browser.wait_for_text("2 files were dropped (“a.toml”, “b.toml” …): drop one at a time.").await;
    drop_one(&browser, "log.rrd", b"RRF2").await;
    browser.wait_for_text("“log.rrd” is a Rerun recording: open it with `rerun FILE`").await;
    drop_one(&browser, "left.png", &[137, 80, 78, 71]).await;
    browser.wait_for_text("“left.png” is a single image").await;
    drop_one(&browser, "core.toml", &[127, 69, 0, 255]).await;
    browser.wait_for_text("“core.toml” is no text").await;
    drop_one(&browser, "nothing.toml", b"").await;
    browser.wait_for_text("“nothing.toml” is empty").await;
    let large = "const data = new DataTransfer(); \
        data.items.add(new File([new Uint8Array(64 << 20)], 'huge.toml')); \
        document.getElementById('sightline').dispatchEvent( \
            new DragEvent('drop', {dataTransfer: data, bubbles: true, cancelable: true}))";
    browser.evaluate(large).await;
    browser.wait_for_text("“huge.toml” has 67 MB, more than the 0.5 MB").await;
    drop_one(&browser, "hill.toml", b"seed = 4\n[sun]\nheight_deg = 3.0\n").await;
    browser
        .wait_for_text("“hill.toml” is no scenario that can be simulated: line 3: sun.height_deg: unknown field `height_deg`")
        .await;
    browser.save_screenshot("problem-card").await;
    let status = browser.status().await;
    assert_eq!(status["session"].as_str(), Some(first.as_str()), "nothing is lost: {status}");
    // The card grows with its text: the painted position of its button may be one frame old.
    browser.activate("button", "close the problem").await;
    browser.wait_until_gone("button", "close the problem").await;

    // A configuration goes into the settings of the current run.
    drop_one(&browser, "mine.toml", b"search_window_px = 81\n").await;
    browser.wait_for_text("“mine.toml” changes one setting of this run").await;

    // An exported session is opened again.
    let file = fixture.get(&format!("/api/v1/sessions/{first}/exports/reproduce.json"));
    drop_one(&browser, "reproduce.json", &file).await;
    browser
        .wait_for_status(
            "the session again",
            &format!("s.session !== '{first}' && s.targets === 1 && s.shown"),
        )
        .await;

    // A scenario becomes a drive with a session of its own.
    let hill = Scenario { name: "the other hill".to_owned(), seed: 5, ..short_approach() };
    drop_one(&browser, "hill.toml", hill.to_toml().as_bytes()).await;
    browser
        .wait_for_status("the drive", "(s.traverse || '').startsWith('the-other-hill-') && s.targets === 0")
        .await;

    browser.chord(&["Control"], "o").await;
    browser.control("button", "new session on the other hill").await;
    browser.save_screenshot("open").await;
    browser.click_on("button", &format!("session {first} on ")).await;
    browser
        .wait_for_status(
            "the first session",
            &format!("s.session === '{first}' && s.targets === 1 && s.shown"),
        )
        .await;
    browser.end().await;
}
