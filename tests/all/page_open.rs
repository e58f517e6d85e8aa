//! Opening in a real browser: files that are dropped on the page, good and bad, and a recent session. The test ends by asking
//! the console for errors.

use serde_json::{Value, json};
use sightline_tests::bench::picked;
use sightline_tests::browser::Browser;
use sightline_tests::scenario::short_approach;
use sightline_world::Scenario;

/// Does with the canvas what a browser does when files are dragged over it (`dragover`) or dropped (`drop`).
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
async fn files_are_opened_by_dropping_bad_ones_are_told_why_and_a_recent_session_is_one_click_away() {
    let (bench, browser) = picked(&short_approach()).await;
    let first = browser.status().await["session"].as_str().unwrap().to_owned();

    files(&browser, "dragover", &[("drive.toml", b"seed = 1")]).await;
    browser.says("Drop one file to open it").await;
    browser.shot("drop-veil").await;
    // Two at once, what is no drive, what is no text, what is too large, and a field that does not exist.
    files(&browser, "drop", &[("a.toml", b"seed = 1"), ("b.toml", b"seed = 2")]).await;
    browser.says("2 files were dropped (“a.toml”, “b.toml” …): drop one at a time.").await;
    drop_one(&browser, "log.rrd", b"RRF2").await;
    browser.says("“log.rrd” is a Rerun recording: open it with `rerun FILE`").await;
    drop_one(&browser, "left.png", &[137, 80, 78, 71]).await;
    browser.says("“left.png” is a single image").await;
    drop_one(&browser, "core.toml", &[127, 69, 0, 255]).await;
    browser.says("“core.toml” is no text").await;
    drop_one(&browser, "nothing.toml", b"").await;
    browser.says("“nothing.toml” is empty").await;
    let large = "const data = new DataTransfer(); \
        data.items.add(new File([new Uint8Array(64 << 20)], 'huge.toml')); \
        document.getElementById('sightline').dispatchEvent( \
            new DragEvent('drop', {dataTransfer: data, bubbles: true, cancelable: true}))";
    browser.evaluate(large).await;
    browser.says("“huge.toml” has 67 MB, more than the 0.5 MB").await;
    drop_one(&browser, "hill.toml", b"seed = 4\n[sun]\nheight_deg = 3.0\n").await;
    browser
        .says("“hill.toml” is no scenario that can be simulated: line 3: sun.height_deg: unknown field `height_deg`")
        .await;
    browser.shot("problem-card").await;
    let status = browser.status().await;
    assert_eq!(status["session"].as_str(), Some(first.as_str()), "nothing is lost: {status}");
    // The card grows with its words: where its button is painted may be a frame old.
    browser.activate("button", "close the problem").await;
    browser.gone("button", "close the problem").await;

    // A configuration goes into the settings of the run that is looked at.
    drop_one(&browser, "mine.toml", b"search_window_px = 81\n").await;
    browser.says("“mine.toml” changes one setting of this run").await;

    // A session that was exported begins again.
    let file = bench.get(&format!("/api/v1/sessions/{first}/exports/reproduce.json"));
    drop_one(&browser, "reproduce.json", &file).await;
    browser
        .wait_status("the session again", &format!("s.session !== '{first}' && s.targets === 1 && s.shown"))
        .await;

    // A scenario becomes a drive with a session of its own.
    let hill = Scenario { name: "the other hill".to_owned(), seed: 5, ..short_approach() };
    drop_one(&browser, "hill.toml", hill.to_toml().as_bytes()).await;
    browser
        .wait_status("the drive", "(s.traverse || '').startsWith('the-other-hill-') && s.targets === 0")
        .await;

    browser.chord(&["Control"], "o").await;
    browser.control("button", "new session on the other hill").await;
    browser.shot("open").await;
    browser.click_on("button", &format!("session {first} on ")).await;
    browser
        .wait_status("the first session", &format!("s.session === '{first}' && s.targets === 1 && s.shown"))
        .await;
    browser.end().await;
}
