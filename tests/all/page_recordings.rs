//! Opening a user's recording in a real browser: listed below a named folder, examined, imported and shown.

use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::BrowserFixture;
use sightline_tests::data;
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn a_kitti_folder_below_a_named_one_is_opened_in_three_actions() {
    let Some(source) = data::set("kitti-seq1-frames-0-19", "its import in a browser") else { return };
    let fixture =
        BrowserFixture::with_recordings(&short_approach(), source.parent().unwrap().to_owned()).await;
    let browser = Browser::start().await;
    fixture.open(&browser).await;

    browser.chord(&["Control"], "o").await;
    browser.control("button", "recording kitti-seq1-frames-0-19").await;
    browser.save_screenshot("recordings").await;
    browser.click_on("button", "recording kitti-seq1-frames-0-19").await;
    for words in ["KITTI odometry", "20 stops", "1226 × 370 px", "image_1/000019.png"] {
        browser.wait_for_text(words).await;
    }
    browser.save_screenshot("recording").await;
    browser.click_on("button", "Import the recording kitti-seq1-frames-0-19").await;
    let shown =
        "(s.traverse || '').startsWith('kitti-seq1-frames-0-19') && s.shown && s.image_to_screen !== null";
    browser.wait_for_status("its first image", shown).await;
    browser.save_screenshot("recording-imported").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dropped_folder_is_sent_examined_and_imported() {
    let Some(source) = data::set("kitti-seq1-frames-0-19", "a folder that is dropped on the page") else {
        return;
    };
    let fixture = BrowserFixture::start(&short_approach()).await;
    let browser = Browser::start().await;
    fixture.open(&browser).await;
    browser.drop_path(&source).await;
    for words in ["KITTI odometry", "20 stops", "1226 × 370 px"] {
        browser.wait_for_text(words).await;
    }
    browser.save_screenshot("recording-dropped").await;
    browser.click_on("button", "Import the recording").await;
    let shown = "(s.traverse || '').startsWith('kitti') && s.shown && s.image_to_screen !== null";
    browser.wait_for_status("its first image", shown).await;
    // An empty folder is refused with one sentence, and the open drive stays.
    let empty = tempfile::tempdir().unwrap();
    browser.drop_path(empty.path()).await;
    browser.wait_for_text("has no files: drop the folder of a recording").await;
    browser.end().await;
}
