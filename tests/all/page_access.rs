//! The page for those who do not see it or use no pointer: what a screen reader finds, and everything by keyboard.

use sightline_tests::bench::picked;
use sightline_tests::scenario::short_approach;

/// Controls of which the browser itself is asked, one of each kind: role and name.
const KINDS: [(&str, &str); 5] = [
    ("button", "Pick a target"),
    ("combobox", "traverse"),
    ("tab", "Gates"),
    ("region", "Left image"),
    ("checkbox", "truth"),
];

#[tokio::test(flavor = "multi_thread")]
async fn a_screen_reader_finds_controls_by_role_and_name_and_can_act_on_them() {
    let (_bench, browser) = picked(&short_approach()).await;

    for (role, name) in KINDS {
        if role == "checkbox" {
            browser.activate("button", "legend").await;
        }
        let control = browser.control(role, name).await;
        let (computed_role, label) = browser.computed(&format!("#{}", control.id)).await;
        assert_eq!(
            (computed_role.as_str(), label.starts_with(name)),
            (role, true),
            "{role} “{name}”: {label}"
        );
    }
    browser.press("Escape").await;
    // Nothing that can be acted on is nameless, and it lies on the page.
    for control in browser.controls().await {
        let is_control = !matches!(control.role.as_str(), "" | "region" | "group" | "dialog");
        assert!(!is_control || !control.name.is_empty(), "a {} without a name: {control:?}", control.role);
    }
    assert!(browser.spoken().await.starts_with("step 0 of"), "{}", browser.spoken().await);
    browser.press("ArrowRight").await;
    browser.wait_status("the next step", "s.step === 1 && s.shown").await;
    browser
        .wait_for(
            "the words of the next step",
            "return document.getElementById('sightline-status').textContent.startsWith('step 1 of')",
        )
        .await;
    assert!(browser.spoken().await.contains("tracking, score"), "{}", browser.spoken().await);

    // What a screen reader does to an element happens: a tab comes to the front, a sheet opens and closes.
    browser.activate("tab", "State machine").await;
    browser.control("region", "State machine").await;
    browser.activate("button", "Keys and conventions").await;
    browser.says("the command palette: every action by name").await;
    browser.activate("button", "Close keys").await;
    browser.gone("button", "Close keys").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn arrangements_panels_and_palette_work_by_keyboard_and_survive_a_reload() {
    let (_bench, browser) = picked(&short_approach()).await;

    for (key, name, panel) in [
        ("2", "match", "Match scores"),
        ("3", "stereo", "Stereo scores"),
        ("4", "map", "Map, site frame"),
        ("5", "compare", "Over the steps"),
        ("6", "studies", "Studies"),
        ("7", "report", "Template strip"),
        ("1", "overview", "Inspector"),
    ] {
        browser.chord(&["Shift"], key).await;
        browser.control("region", panel).await;
        browser.wait_for(name, &format!("return location.hash.includes('lay={name}')")).await;
        browser.shot(&format!("layout-{name}")).await;
    }
    // Q goes from panel to panel, ` lets one fill the page, and again gives the others their place back.
    browser.press("q").await;
    browser.press("`").await;
    browser.control("button", "Restore").await;
    assert!(!browser.has_control("region", "Why").await, "one panel fills the page");
    browser.press("`").await;
    browser.control("region", "Why").await;

    // The palette: a setting, a step, a panel, an arrangement.
    browser.chord(&["Control"], "k").await;
    browser.control("textbox", "palette").await;
    browser.type_text("layout stereo").await;
    browser.control("option", "Layout Stereo").await;
    browser.shot("palette").await;
    browser.press("Enter").await;
    browser.wait_for("the arrangement", "return location.hash.includes('lay=stereo')").await;
    browser.chord(&["Control"], "k").await;
    browser.type_text("nothing is called that").await;
    browser.says("Nothing is called that.").await;
    browser.press("Escape").await;
    browser.gone("textbox", "palette").await;

    // A panel is closed by its menu and stays closed across a reload; the palette brings it back.
    browser.click_on("button", "Stereo scores menu").await;
    browser.click_on("button", "Close Stereo scores").await;
    browser.control("tab", "Match scores").await;
    tokio::time::sleep(std::time::Duration::from_millis(1500)).await;
    browser.evaluate("location.reload()").await;
    browser.wait_for_viewer().await;
    browser.wait_status("the page again", "s.phase === 'ready' && s.target === 0").await;
    assert!(browser.fragment().await.contains("lay=stereo"), "{}", browser.fragment().await);
    assert!(!browser.has_control("tab", "Stereo scores").await);
    browser.chord(&["Control"], "k").await;
    browser.control("textbox", "palette").await;
    browser.type_text("show stereo").await;
    browser.press("Enter").await;
    browser.control("tab", "Stereo scores").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_opens_the_same_place_and_back_goes_to_the_run_before() {
    let (bench, browser) = picked(&short_approach()).await;
    browser.press("End").await;
    let last = bench.stop_count - 1;
    browser
        .wait_for("the step in the address", &format!("return location.hash.includes('step={last}&')"))
        .await;
    browser.press("y").await;
    browser.says("The link to what you see is copied.").await;
    let link = browser.fragment().await;

    // The same link in a fresh page.
    browser.goto("about:blank").await;
    browser.goto(&format!("{}#{}", bench.url(), link.replace(&format!("step={last}"), "step=1"))).await;
    browser.wait_for_viewer().await;
    browser.wait_status("the place of the link", "s.target === 0 && s.step === 1").await;
    // An address changed by hand is followed; what cannot be read is named, and nothing else is lost.
    browser
        .evaluate(&format!("location.hash = '{}'", link.replace(&format!("step={last}"), "step=many")))
        .await;
    browser.says("A part of the link cannot be read and was left out: `step=many`.").await;
    browser.evaluate(&format!("location.hash = '{}'", link.replace("run=0", "run=7"))).await;
    browser.says("The link names run H, which this target does not have").await;
    browser.evaluate("location.hash = 'session=s9999'").await;
    browser.says("There is no such session.").await;
    assert_eq!(browser.status().await["target"], 0, "what was open stays open");
    // That there is no such session is an answer which the browser itself writes into its console, and nothing else is.
    let errors = browser.console_errors().await;
    assert!(errors.iter().all(|error| error.contains("/sessions/s9999")), "{errors:?}");
    browser.close().await;
}
