//! Figures and tables in a real browser: a panel is saved as SVG and as PNG by its menu, the browser draws both, and they
//! are compared; a plot is read as a table, by role and name. The test ends by checking the console for errors.

use std::time::Duration;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use sightline_tests::browser::Browser;
use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;

/// Records files that the page offers for saving, instead of saving them. The page may not fetch its own blobs, so they are
/// read where they are created.
const CATCH: &str = "window.saved = []; const make = URL.createObjectURL; \
    URL.createObjectURL = blob => { window.blob = blob; return make.call(URL, blob); }; \
    HTMLAnchorElement.prototype.click = function () { \
        const [name, reader] = [this.download, new FileReader()]; \
        reader.onload = () => window.saved.push([name, reader.result]); \
        reader.readAsDataURL(window.blob); }";

/// Waits for a script's value.
async fn value(browser: &Browser, what: &str, script: &str) -> Value {
    for _ in 0..600 {
        let found = browser.evaluate(script).await;
        if !found.is_null() {
            return found;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    panic!("waited a minute for {what}");
}

/// Saves a panel by its menu; returns the file's name and its bytes.
async fn save(browser: &Browser, panel: &str, kind: &str) -> (String, Vec<u8>) {
    let before = browser.evaluate("return window.saved.length").await;
    browser.click_on("button", &format!("{panel} menu")).await;
    browser.click_on("button", &format!("save {panel} as {kind}")).await;
    let script = format!("return window.saved[{before}] ?? null");
    let file = value(browser, "a file", &script).await;
    let (name, url) = (file[0].as_str().unwrap().to_owned(), file[1].as_str().unwrap());
    (name, STANDARD.decode(url.split_once("base64,").unwrap().1).unwrap())
}

/// The mean difference of two images, of 255, and the share of pixels that differ by more than 48.
fn difference(a: &[u8], b: &[u8]) -> (f64, f64) {
    assert_eq!(a.len(), b.len());
    let off: Vec<u8> = a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).collect();
    let mean = off.iter().map(|v| f64::from(*v)).sum::<f64>() / off.len() as f64;
    let far = off.chunks(3).filter(|pixel| pixel.iter().any(|v| *v > 48)).count();
    (mean, far as f64 / (off.len() / 3) as f64)
}

#[tokio::test(flavor = "multi_thread")]
async fn panels_export_as_equal_svg_and_png_and_plots_as_tables() {
    let (_bench, browser) = picked(&short_approach()).await;
    browser.evaluate(CATCH).await;
    browser.press("ArrowRight").await;
    browser.wait_for_status("a step with scores", "s.step === 1 && s.shown").await;
    browser.show_panel("Match scores").await;
    tokio::time::sleep(Duration::from_millis(1500)).await;

    // For a paper: a white background and the chosen width; then as on the screen.
    let (_, png) = save(&browser, "Match scores", "PNG 2x").await;
    let paper = image::load_from_memory(&png).unwrap().to_rgb8();
    assert_eq!((paper.width(), paper.get_pixel(1, 1).0), (2 * 720, [255; 3]));
    browser.click_on("button", "Match scores menu").await;
    browser.click_on("button", "as on the screen").await;
    browser.press("Escape").await;
    browser.wait_until_gone("button", "as on the screen").await;

    let (name, png) = save(&browser, "Match scores", "PNG 2x").await;
    assert!(name.starts_with("sightline-") && name.ends_with("-match-scores-2x.png"), "{name}");
    let png = image::load_from_memory(&png).unwrap().to_rgb8();
    let (width, height) = png.dimensions();

    let (name, svg) = save(&browser, "Match scores", "SVG").await;
    assert!(name.contains("-target-1-run-a-step-") && name.ends_with("-match-scores.svg"), "{name}");
    let text = String::from_utf8(svg).unwrap();
    assert!(
        text.contains("<title id=\"title\">Match scores: ") && text.contains("<image "),
        "{}",
        &text[..400]
    );
    // The panel on the screen is the same, at half the scale.
    let place = browser.control("region", "Match scores").await.rect;
    let screen = image::load_from_memory(&browser.screenshot().await).unwrap().to_rgb8();
    let [x, y, w, h] = place.map(|v| v.round() as u32);
    let part = image::imageops::crop_imm(&screen, x, y, w, h).to_image();
    let once = image::imageops::thumbnail(&png, w, h);
    let (mean, far) = difference(part.as_raw(), once.as_raw());
    println!("screen against PNG: mean {mean:.2} of 255, {:.1} % far", far * 100.0);
    assert!(mean < 6.0 && far < 0.08, "mean {mean:.2} of 255, {:.1} % of the pixels far off", far * 100.0);

    browser.show_panel("Over the steps").await;
    browser.click_on("button", "Over the steps as table").await;
    let table = browser.control("table", "Over the steps, ").await;
    assert_eq!(table.region, "Over the steps");
    browser.control("columnheader", "scores match score").await;
    browser.control("row", "step 0").await;
    browser.click_on("button", "go to step 2").await;
    browser.wait_for_status("the step", "s.step === 2 && s.shown").await;
    browser.control("row", "step 2, the current one").await;
    browser.save_screenshot("table").await;
    browser.click_on("button", "Over the steps as table").await;
    browser.wait_until_gone("table", "Over the steps, ").await;

    // The metric by which the runs are sorted is part of the address.
    browser.chord(&["Control"], "k").await;
    browser.type_text("show runs").await;
    browser.press("Enter").await;
    browser.control("button", "sort by ade_px").await;
    // The table is wider than its panel.
    browser.press("`").await;
    browser.control("button", "Restore").await;
    browser.click_on("button", "sort by ade_px").await;
    browser.wait_for("the sorting in the address", "return location.hash.includes('sort=ade_px')").await;
    assert_eq!(browser.console_errors().await, Vec::<String>::new());

    // The browser renders the SVG, independently of the code that rendered the PNG.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("figure.svg");
    std::fs::write(&file, &text).unwrap();
    browser.goto(&format!("file://{}", file.display())).await;
    let drawn = image::load_from_memory(&browser.screenshot().await).unwrap().to_rgb8();
    let drawn = image::imageops::crop_imm(&drawn, 0, 0, width / 2, height / 2).to_image();
    let once = image::imageops::thumbnail(&png, width / 2, height / 2);
    if let Some(folder) = std::env::var_os("SIGHTLINE_SHOTS") {
        let folder = std::path::PathBuf::from(folder);
        png.save(folder.join("figure-2x.png")).unwrap();
        std::fs::write(folder.join("figure.svg"), &text).unwrap();
        drawn.save(folder.join("figure-svg.png")).unwrap();
    }
    let (mean, far) = difference(drawn.as_raw(), once.as_raw());
    println!("SVG against PNG: mean {mean:.2} of 255, {:.1} % far", far * 100.0);
    // Without the page's font, the browser draws letters in another one.
    assert!(mean < 6.0 && far < 0.08, "mean {mean:.2} of 255, {:.1} % of the pixels far off", far * 100.0);
    browser.close().await;
}
