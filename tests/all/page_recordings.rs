//! Opening a recording of one's own in a real browser: found below a named folder, examined, imported and shown.

use sightline_tests::bench::Bench;
use sightline_tests::browser::Browser;
use sightline_tests::data;
use sightline_tests::scenario::short_approach;

#[tokio::test(flavor = "multi_thread")]
async fn a_kitti_folder_below_a_named_one_is_opened_in_three_actions() {
    let Some(source) = data::set("kitti-seq1-frames-0-19", "its import in a browser") else { return };
    let bench = Bench::with_recordings(&short_approach(), source.parent().unwrap().to_owned()).await;
    let browser = Browser::start().await;
    bench.open(&browser).await;

    browser.chord(&["Control"], "o").await;
    browser.control("button", "recording kitti-seq1-frames-0-19").await;
    browser.shot("recordings").await;
    browser.click_on("button", "recording kitti-seq1-frames-0-19").await;
    for words in ["KITTI odometry", "20 stops", "1226 × 370 px", "image_1/000019.png"] {
        browser.says(words).await;
    }
    browser.shot("recording").await;
    browser.click_on("button", "Import the recording kitti-seq1-frames-0-19").await;
    let shown =
        "(s.traverse || '').startsWith('kitti-seq1-frames-0-19') && s.shown && s.image_to_screen !== null";
    browser.wait_status("its first image", shown).await;
    browser.shot("recording-imported").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dropped_folder_is_sent_examined_and_imported() {
    let Some(source) = data::set("kitti-seq1-frames-0-19", "a folder that is dropped on the page") else {
        return;
    };
    let bench = Bench::start(&short_approach()).await;
    let browser = Browser::start().await;
    bench.open(&browser).await;
    browser.drop_path(&source).await;
    for words in ["KITTI odometry", "20 stops", "1226 × 370 px"] {
        browser.says(words).await;
    }
    browser.shot("recording-dropped").await;
    browser.click_on("button", "Import the recording").await;
    let shown = "(s.traverse || '').startsWith('kitti') && s.shown && s.image_to_screen !== null";
    browser.wait_status("its first image", shown).await;
    // An empty folder is refused in one sentence, and the open drive stays.
    let empty = tempfile::tempdir().unwrap();
    browser.drop_path(empty.path()).await;
    browser.says("has no files: drop the folder of a recording").await;
    browser.end().await;
}
