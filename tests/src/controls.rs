//! The page as a screen reader reads it: controls by role and name, from the elements that mirror the painted page.
//!
//! A control is clicked with the pointer at its painted position, like by a user; [`Browser::activate`] instead acts on the
//! element, like a screen reader.

use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::Value;

use crate::browser::Browser;

/// Maximum time until a control appears.
const PATIENCE: Duration = Duration::from_secs(60);

/// Maximum time for something that is rendered or tracked on a busy machine.
const LONG_PATIENCE: Duration = Duration::from_secs(300);

/// Waits for three painted frames: a window that has grown is moved in the next frame.
const FRAMES: &str = "return new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => \
    requestAnimationFrame(() => done(null)))))";

/// Lists the elements of the mirror.
const LIST: &str = "return [...document.querySelectorAll('#sightline-mirror [data-node]')].map(e => { \
    const [x, y, w, h] = ['left', 'top', 'width', 'height'].map(k => parseFloat(e.style[k])); \
    const role = e.getAttribute('role') \
        ?? (e.tagName === 'DIV' ? '' : e.getAttribute('type') === 'range' ? 'slider' : 'textbox'); \
    return {id: e.id, role, name: e.getAttribute('aria-label') ?? '', rect: [x, y, w, h], \
        value: e.value ?? e.getAttribute('aria-valuetext') ?? (role === '' ? e.textContent : ''), \
        on: ['aria-pressed', 'aria-checked', 'aria-selected'].some(a => e.getAttribute(a) === 'true'), \
        disabled: e.getAttribute('aria-disabled') === 'true', \
        region: e.parentElement?.closest('[role=region],[role=dialog]')?.getAttribute('aria-label') ?? ''}; })";

/// A control or a text of the page.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Control {
    /// The element's id.
    pub id: String,
    /// ARIA role; empty for a text.
    pub role: String,
    /// Accessible name.
    pub name: String,
    /// The words of a text, or the contents of a field.
    pub value: String,
    /// Left, top, width, height, CSS px.
    pub rect: [f64; 4],
    /// Whether the control is pressed, checked or selected.
    pub on: bool,
    /// Whether the control is disabled.
    pub disabled: bool,
    /// The panel or dialog that contains the control.
    pub region: String,
}

impl Control {
    /// The centre of the control, CSS px.
    pub fn centre(&self) -> (f64, f64) {
        let [x, y, width, height] = self.rect;
        (x + width / 2.0, y + height / 2.0)
    }
}

impl Browser {
    /// Waits until three frames have been painted.
    pub async fn frames(&self) {
        self.evaluate(FRAMES).await;
    }

    /// All elements of the page, in reading order.
    pub async fn controls(&self) -> Vec<Control> {
        let list = self.evaluate(LIST).await;
        serde_json::from_value(list).unwrap_or_else(|error| panic!("the list of controls: {error}"))
    }

    /// Returns the control of a role whose name is or begins with `name`; waits until it exists.
    ///
    /// # Panics
    /// With the names of all controls of that role, if it does not appear.
    pub async fn control(&self, role: &str, name: &str) -> Control {
        let start = Instant::now();
        loop {
            let all = self.controls().await;
            let of_role = || all.iter().filter(|control| control.role == role);
            let found =
                of_role().find(|c| c.name == name).or_else(|| of_role().find(|c| c.name.starts_with(name)));
            if let Some(control) = found {
                return control.clone();
            }
            if start.elapsed() > PATIENCE {
                self.save_screenshot("missing").await;
                let names: Vec<&str> = of_role().map(|control| control.name.as_str()).collect();
                panic!("there is no {role} “{name}”, but {names:?}");
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// Whether such a control exists.
    pub async fn has_control(&self, role: &str, name: &str) -> bool {
        self.controls().await.iter().any(|control| control.role == role && control.name.starts_with(name))
    }

    /// Waits until no such control exists: a closing window above the panels still catches clicks.
    ///
    /// # Panics
    /// If it remains.
    pub async fn wait_until_gone(&self, role: &str, name: &str) {
        let start = Instant::now();
        while self.has_control(role, name).await {
            if start.elapsed() > PATIENCE {
                self.save_screenshot("stays").await;
                panic!("{role} “{name}” stays");
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// Clicks the centre of a control with the pointer, once it is enabled and has stopped moving: windows reach their final
    /// size within a few frames, which a busy machine paints late.
    ///
    /// # Panics
    /// If it remains disabled.
    pub async fn click_on(&self, role: &str, name: &str) {
        let start = Instant::now();
        let mut before = self.control(role, name).await;
        loop {
            tokio::time::sleep(Duration::from_millis(80)).await;
            self.frames().await;
            let control = self.control(role, name).await;
            if !control.disabled && control.rect == before.rect {
                let (x, y) = control.centre();
                return self.click(x, y).await;
            }
            assert!(start.elapsed() < PATIENCE, "{role} “{name}” is disabled, or never at rest");
            before = control;
        }
    }

    /// Chooses the entry `name` of an open list; the list of targets has entries of the same names.
    ///
    /// # Panics
    /// If the list has no such entry.
    pub async fn choose(&self, name: &str) {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            let all = self.controls().await;
            let listed =
                |c: &&Control| c.role == "button" && c.name == name && c.region != "Targets and runs";
            if let Some(control) = all.iter().rfind(listed) {
                let (x, y) = control.centre();
                return self.click(x, y).await;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        panic!("nothing in the list is called {name}");
    }

    /// Activates a control as a screen reader does, without the pointer.
    pub async fn activate(&self, role: &str, name: &str) {
        self.act_on(role, name, "e.click()").await;
    }

    /// Sets the value of a field or slider as a screen reader does, without the pointer.
    pub async fn set_value(&self, role: &str, name: &str, value: &str) {
        let act = format!("e.value = '{value}'; e.dispatchEvent(new Event('input', {{bubbles: true}}))");
        self.act_on(role, name, &act).await;
    }

    /// Runs `act` on the element `e` of a control, which is looked up again, because it may have been replaced.
    async fn act_on(&self, role: &str, name: &str, act: &str) {
        let start = Instant::now();
        loop {
            let id = self.control(role, name).await.id;
            let script =
                format!("const e = document.getElementById('{id}'); if (e) {{ {act} }} return e !== null");
            if self.evaluate(&script).await == Value::Bool(true) {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "{role} “{name}” is never there for long enough");
        }
    }

    /// Waits until a text that contains these words is on the page.
    ///
    /// # Panics
    /// With all texts, if it does not appear.
    pub async fn wait_for_text(&self, words: &str) {
        let start = Instant::now();
        loop {
            let all = self.controls().await;
            if all.iter().any(|text| text.value.contains(words) || text.name.contains(words)) {
                return;
            }
            if start.elapsed() > PATIENCE {
                let texts: Vec<&str> =
                    all.iter().map(|text| text.value.as_str()).filter(|t| !t.is_empty()).collect();
                panic!("the page does not say “{words}”, but {texts:?}");
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// The last announcement to screen readers.
    pub async fn last_announcement(&self) -> String {
        let text = self.evaluate("return document.getElementById('sightline-status').textContent").await;
        text.as_str().unwrap_or_default().to_owned()
    }

    /// The part of the page's address after `#`.
    pub async fn fragment(&self) -> String {
        let hash = self.evaluate("return location.hash").await;
        hash.as_str().unwrap_or_default().trim_start_matches('#').to_owned()
    }

    /// The page's status; `viewer/src/page/status.rs` describes it.
    pub async fn status(&self) -> Value {
        let text = self.evaluate("return document.getElementById('sightline').dataset.status || '{}'").await;
        serde_json::from_str(text.as_str().unwrap_or("{}")).unwrap_or_default()
    }

    /// Waits until a condition on the page's status `s` is true, with enough time for rendering on a busy machine.
    ///
    /// # Panics
    /// With the status, if the condition never becomes true.
    pub async fn wait_for_status(&self, what: &str, condition: &str) {
        let script = format!(
            "const s = JSON.parse(document.getElementById('sightline').dataset.status || '{{}}'); return {condition}"
        );
        let start = Instant::now();
        while start.elapsed() < LONG_PATIENCE {
            if self.evaluate(&script).await == Value::Bool(true) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
        self.save_screenshot("waited").await;
        panic!("waited {} s for {what}; the page says {}", LONG_PATIENCE.as_secs(), self.status().await);
    }

    /// Goes to a place of the drive, written as in the box of G, and waits until that step is shown.
    pub async fn go_to(&self, place: &str, step: usize) {
        self.press("g").await;
        self.control("textbox", "go to step").await;
        self.type_text(place).await;
        self.press("Enter").await;
        self.wait_until_gone("textbox", "go to step").await;
        self.wait_for_status("the step", &format!("s.step === {step} && s.shown")).await;
    }

    /// Brings a panel to the front through the palette.
    pub async fn show_panel(&self, name: &str) {
        self.chord(&["Control"], "k").await;
        self.control("textbox", "palette").await;
        self.type_text(&format!("show {name}")).await;
        self.control("option", &format!("Show {name}")).await;
        self.press("Enter").await;
        self.wait_until_gone("textbox", "palette").await;
        self.control("region", name).await;
    }

    /// Asserts that the console has no errors, and ends the browser.
    ///
    /// # Panics
    /// With the errors, if there are any.
    pub async fn end(self) {
        assert_eq!(self.console_errors().await, Vec::<String>::new());
        self.close().await;
    }

    /// Saves a screenshot for inspection in the folder that `SIGHTLINE_SHOTS` names.
    pub async fn save_screenshot(&self, name: &str) {
        if let Some(folder) = std::env::var_os("SIGHTLINE_SHOTS") {
            let folder = std::path::PathBuf::from(folder);
            std::fs::create_dir_all(&folder).expect("the folder of pictures");
            std::fs::write(folder.join(format!("{name}.png")), self.screenshot().await).expect("a picture");
        }
    }
}
