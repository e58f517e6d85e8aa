//! Accessibility of the page: the tree of a screen reader, and complete operation by keyboard.

use sightline_tests::browser_fixture::picked;
use sightline_tests::scenario::short_approach;

/// One control of each kind, whose role and name are also read from the browser's own accessibility tree.
const KINDS: [(&str, &str); 5] = [
    ("button", "Pick a target"),
    ("combobox", "traverse"),
    ("tab", "Gates"),
    ("region", "Left image"),
    ("checkbox", "truth"),
];

#[tokio::test(flavor = "multi_thread")]
async fn controls_are_accessible_by_role_and_name() {
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
    // Every control that can be activated has a name and is inside the page.
    for control in browser.controls().await {
        let is_control = !matches!(control.role.as_str(), "" | "region" | "group" | "dialog");
        assert!(!is_control || !control.name.is_empty(), "a {} without a name: {control:?}", control.role);
    }
    assert!(
        browser.last_announcement().await.starts_with("step 0 of"),
        "{}",
        browser.last_announcement().await
    );
    browser.press("ArrowRight").await;
    browser.wait_for_status("the next step", "s.step === 1 && s.shown").await;
    browser
        .wait_for(
            "the words of the next step",
            "return document.getElementById('sightline-status').textContent.startsWith('step 1 of')",
        )
        .await;
    assert!(
        browser.last_announcement().await.contains("tracking, score"),
        "{}",
        browser.last_announcement().await
    );

    // Actions of a screen reader have their effect: a tab comes to the front, a sheet opens and closes.
    browser.activate("tab", "State machine").await;
    browser.control("region", "State machine").await;
    browser.activate("button", "Keys and conventions").await;
    browser.wait_for_text("the command palette: every action by name").await;
    browser.activate("button", "Close keys").await;
    browser.wait_until_gone("button", "Close keys").await;
    browser.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn layouts_work_by_keyboard_and_survive_a_reload() {
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
        browser.save_screenshot(&format!("layout-{name}")).await;
    }
    // Q moves from panel to panel, ` maximises one, and again restores the others.
    browser.press("q").await;
    browser.press("`").await;
    browser.control("button", "Restore").await;
    assert!(!browser.has_control("region", "Why").await, "one panel fills the page");
    browser.press("`").await;
    browser.control("region", "Why").await;

    // The palette: a setting, a step, a panel, a layout.
    browser.chord(&["Control"], "k").await;
    browser.control("textbox", "palette").await;
    browser.type_text("layout stereo").await;
    browser.control("option", "Layout Stereo").await;
    browser.save_screenshot("palette").await;
    browser.press("Enter").await;
    browser.wait_for("the arrangement", "return location.hash.includes('lay=stereo')").await;
    browser.chord(&["Control"], "k").await;
    browser.type_text("nothing is called that").await;
    browser.wait_for_text("Nothing is called that.").await;
    browser.press("Escape").await;
    browser.wait_until_gone("textbox", "palette").await;

    // A panel closed by its menu stays closed after a reload; the palette reopens it.
    browser.click_on("button", "Stereo scores menu").await;
    browser.click_on("button", "Close Stereo scores").await;
    browser.control("tab", "Match scores").await;
    tokio::time::sleep(std::time::Duration::from_millis(1500)).await;
    browser.evaluate("location.reload()").await;
    browser.wait_for_viewer().await;
    browser.wait_for_status("the page again", "s.phase === 'ready' && s.target === 0").await;
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
async fn a_link_restores_the_view_and_back_the_previous_run() {
    let (fixture, browser) = picked(&short_approach()).await;
    browser.press("End").await;
    let last = fixture.stop_count - 1;
    browser
        .wait_for("the step in the address", &format!("return location.hash.includes('step={last}&')"))
        .await;
    browser.press("y").await;
    browser.wait_for_text("The link to what you see is copied.").await;
    let link = browser.fragment().await;

    // The same link in a new page.
    browser.goto("about:blank").await;
    browser.goto(&format!("{}#{}", fixture.url(), link.replace(&format!("step={last}"), "step=1"))).await;
    browser.wait_for_viewer().await;
    browser.wait_for_status("the place of the link", "s.target === 0 && s.step === 1").await;
    // The page follows an address that was edited by hand; invalid parts are reported, and the others are applied.
    browser
        .evaluate(&format!("location.hash = '{}'", link.replace(&format!("step={last}"), "step=many")))
        .await;
    browser.wait_for_text("A part of the link cannot be read and was left out: `step=many`.").await;
    browser.evaluate(&format!("location.hash = '{}'", link.replace("run=0", "run=7"))).await;
    browser.wait_for_text("The link names run H, which this target does not have").await;
    browser.evaluate("location.hash = 'session=s9999'").await;
    browser.wait_for_text("There is no such session.").await;
    assert_eq!(browser.status().await["target"], 0, "what was open stays open");
    // The only error in the console is the browser's own line about the session that does not exist.
    let errors = browser.console_errors().await;
    assert!(errors.iter().all(|error| error.contains("/sessions/s9999")), "{errors:?}");
    browser.close().await;
}
