//! Exports in a real browser: every file of the window is downloaded, every action is copied as a command that is run, and
//! Rerun's own viewer shows the live stream.

use std::process::Command;
use std::time::Duration;

use serde_json::Value;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::{BrowserFixture, picked};
use sightline_tests::scenario::short_approach;
use sightline_tests::server::TOKEN;

/// Records URLs that the page opens and texts that it copies, instead of doing so.
const CATCH: &str = "window.opened = []; window.open = url => { window.opened.push(url); return null; }; \
    window.copied = []; Object.defineProperty(navigator, 'clipboard', { value: { \
        writeText: text => { window.copied.push(text); return Promise.resolve(); } } });";

/// Activates a button and returns the next URL that the page opens (`opened`) or text that it copies (`copied`).
async fn caught(browser: &Browser, kept: &str, button: &str) -> String {
    let before = browser.evaluate(&format!("return window.{kept}.length")).await;
    browser.activate("button", button).await;
    browser.wait_for(button, &format!("return window.{kept}.length > {before}")).await;
    let text = browser.evaluate(&format!("return window.{kept}[{before}]")).await;
    text.as_str().unwrap().to_owned()
}

/// Checks the signature or the contents of a kind of file.
fn is_what_it_says(name: &str, bytes: &[u8]) -> bool {
    let text = || String::from_utf8_lossy(bytes);
    let has = |what: &[u8]| bytes.windows(what.len()).any(|part| part == what);
    match name {
        "report.html" => text().starts_with("<!doctype html>") && text().contains("<h1"),
        "recording.rrd" => bytes.starts_with(b"RRF"),
        "rows.csv" => text().starts_with("target,label,run,step,state,"),
        "rows.jsonl" => text().lines().all(|line| serde_json::from_str::<Value>(line).is_ok()),
        "rows.parquet" => bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"),
        "steps.apng" => bytes.starts_with(b"\x89PNG") && has(b"acTL"),
        "steps.png" => bytes.starts_with(b"\x89PNG") && !has(b"acTL"),
        "reproduce.json" => serde_json::from_slice::<Value>(bytes).is_ok(),
        _ => false,
    }
}

/// Runs a copied command in a shell.
fn run(folder: &std::path::Path, text: &str) -> std::process::Output {
    let shell =
        Command::new("sh").args(["-c", text]).current_dir(folder).env("SIGHTLINE_TOKEN", TOKEN).output();
    shell.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn downloads_and_copied_commands_work() {
    let (fixture, browser) = picked(&short_approach()).await;
    browser.evaluate(CATCH).await;
    browser.go_to("2", 2).await;
    browser.chord(&["Control"], "s").await;
    browser.control("button", "download: ").await;
    browser.save_screenshot("exports").await;
    let names: Vec<String> = browser.controls().await.into_iter().map(|control| control.name).collect();
    let titles: Vec<&str> = names.iter().filter_map(|name| name.strip_prefix("download: ")).collect();
    assert_eq!(titles.len(), 8, "{titles:?}");
    let folder = tempfile::tempdir().unwrap();
    for title in titles {
        let url = caught(&browser, "opened", &format!("download: {title}")).await;
        let path = url.strip_prefix(fixture.url().trim_end_matches('/')).expect("a file of this server");
        let name = path.split('?').next().unwrap().rsplit('/').next().unwrap().to_owned();
        let bytes = fixture.get(path);
        assert!(is_what_it_says(&name, &bytes), "{title}: {name}, {} bytes", bytes.len());
        // The copied command writes the same file.
        let text = caught(&browser, "copied", &format!("copy as HTTP: {title}")).await;
        let (at, command) = (folder.path().to_owned(), text.clone());
        let done = tokio::task::spawn_blocking(move || run(&at, &command)).await.unwrap();
        assert!(done.status.success(), "{text}: {}", String::from_utf8_lossy(&done.stderr));
        let written = std::fs::read_dir(folder.path()).unwrap().next().expect("a file").unwrap().path();
        let written_bytes = std::fs::read(&written).unwrap();
        assert!(is_what_it_says(&name, &written_bytes), "{text} wrote {}", written.display());
        std::fs::remove_file(written).unwrap();
    }
    let page = caught(&browser, "opened", "Open this step as a plain page").await;
    assert!(page.ends_with("/sessions/s1/targets/0/runs/0/steps/2/page"), "{page}");
    check_actions(&browser, &fixture, folder.path()).await;
    browser.press("Escape").await;
    browser.wait_until_gone("button", "download: ").await;
    browser.end().await;
}

/// Repeats the actions of the page with the commands that it gives.
async fn check_actions(browser: &Browser, fixture: &BrowserFixture, folder: &std::path::Path) {
    let text = caught(browser, "copied", "copy as HTTP: read step 2").await;
    let at = folder.to_owned();
    let done = tokio::task::spawn_blocking(move || run(&at, &text)).await.unwrap();
    let read: Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(read["step"], 2);
    let text = caught(browser, "copied", "copy as HTTP: pick ").await;
    let at = folder.to_owned();
    let done = tokio::task::spawn_blocking(move || run(&at, &text)).await.unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let targets = fixture.json("/api/v1/sessions/s1")["targets"].as_array().unwrap().clone();
    assert_eq!(targets.len(), 2, "the same pick again");
    let pixel = |k: usize| {
        (targets[k]["designation"]["pixel"]["x"].clone(), targets[k]["designation"]["pixel"]["y"].clone())
    };
    assert_eq!(pixel(0), pixel(1));
    // As a command of the program, which `tests/all/cli.rs` runs; here the test checks drive, pixel and settings.
    let text = caught(browser, "copied", "copy as command: pick ").await;
    assert!(text.starts_with("sightline track ") && text.contains(" --target "), "{text}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_live_stream_is_shown_by_reruns_own_viewer() {
    let (fixture, browser) = picked(&short_approach()).await;
    browser.evaluate(CATCH).await;
    let url = caught(&browser, "opened", "Open in Rerun").await;
    assert!(url.starts_with(&format!("{}api/v1/rerun/index.html?session=s1", fixture.url())), "{url}");
    // The page states how another viewer reads the stream.
    browser.show_panel("Messages").await;
    browser.wait_for_text("| rerun -").await;
    browser.save_screenshot("rerun-message").await;

    // The same browser, because it has the cookie.
    let viewer = browser;
    viewer.goto(&url).await;
    let painted = "const c = document.querySelector('canvas'); return c !== null && c.width > 300";
    viewer.wait_for("rerun's canvas", painted).await;
    // The image changes until the whole session is loaded; a page that paints nothing remains a uniform grey.
    let start = std::time::Instant::now();
    loop {
        let page = image::load_from_memory(&viewer.screenshot().await).unwrap().to_rgb8();
        let colours: std::collections::HashSet<[u8; 3]> = page.pixels().map(|pixel| pixel.0).collect();
        if colours.len() > 300 {
            break;
        }
        assert!(start.elapsed().as_secs() < 120, "Rerun's viewer paints {} colours", colours.len());
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
    tokio::time::sleep(Duration::from_secs(3)).await;
    viewer.save_screenshot("rerun").await;
    // That viewer tries to send usage statistics; the page's policy blocks it, which is the only error in the console.
    let errors = viewer.console_errors().await;
    let is_refused = |error: &String| {
        error.contains("Content Security Policy") || error.contains("TypeError: Failed to fetch")
    };
    assert!(errors.iter().all(is_refused), "{errors:?}");
    viewer.close().await;
}
