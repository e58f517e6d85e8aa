//! The page as a screen reader finds it: controls by role and name, from the elements that mirror what is painted.
//!
//! A control is clicked with the pointer where it is painted, as a person would; what a screen reader does instead, an
//! action on the element itself, is [`Browser::activate`].

use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::Value;

use crate::browser::Browser;

/// How long a control may take to come.
const PATIENCE: Duration = Duration::from_secs(60);

/// How long what is rendered or tracked on a busy machine may take to come.
const LONG_PATIENCE: Duration = Duration::from_secs(300);

/// Waits for three painted frames: a window that grew is moved in the frame after.
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

/// A control or a text.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub struct Control {
    /// The element's id.
    pub id: String,
    /// ARIA role; empty for a text.
    pub role: String,
    /// Accessible name.
    pub name: String,
    /// The words of a text, the contents of a field.
    pub value: String,
    /// Left, top, width, height, CSS px.
    pub rect: [f64; 4],
    /// Whether it is pressed, checked or selected.
    pub on: bool,
    /// Whether it does nothing at the moment.
    pub disabled: bool,
    /// The panel or dialog in which it lies.
    pub region: String,
}

impl Control {
    /// Its middle, CSS px.
    pub fn middle(&self) -> (f64, f64) {
        let [x, y, width, height] = self.rect;
        (x + width / 2.0, y + height / 2.0)
    }
}

impl Browser {
    /// Waits until three frames were painted.
    pub async fn frames(&self) {
        self.evaluate(FRAMES).await;
    }

    /// Everything on the page, in reading order.
    pub async fn controls(&self) -> Vec<Control> {
        let list = self.evaluate(LIST).await;
        serde_json::from_value(list).unwrap_or_else(|error| panic!("the list of controls: {error}"))
    }

    /// The control of a role whose name is or begins with `name`; waits until there is one.
    ///
    /// # Panics
    /// With the names of that role's controls, when none comes.
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
                self.shot("missing").await;
                let names: Vec<&str> = of_role().map(|control| control.name.as_str()).collect();
                panic!("there is no {role} “{name}”, but {names:?}");
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// Whether there is such a control now.
    pub async fn has_control(&self, role: &str, name: &str) -> bool {
        self.controls().await.iter().any(|control| control.role == role && control.name.starts_with(name))
    }

    /// Waits until there is no such control any more: a window above the panels that has closed lets clicks through.
    ///
    /// # Panics
    /// When it stays.
    pub async fn gone(&self, role: &str, name: &str) {
        let start = Instant::now();
        while self.has_control(role, name).await {
            if start.elapsed() > PATIENCE {
                self.shot("stays").await;
                panic!("{role} “{name}” stays");
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// Clicks a control with the pointer, in its middle, once it can be clicked and has come to rest: windows find their size
    /// within a few frames, which a busy machine paints late.
    ///
    /// # Panics
    /// When it stays disabled.
    pub async fn click_on(&self, role: &str, name: &str) {
        let start = Instant::now();
        let mut before = self.control(role, name).await;
        loop {
            tokio::time::sleep(Duration::from_millis(80)).await;
            self.frames().await;
            let control = self.control(role, name).await;
            if !control.disabled && control.rect == before.rect {
                let (x, y) = control.middle();
                return self.click(x, y).await;
            }
            assert!(start.elapsed() < PATIENCE, "{role} “{name}” is disabled, or never at rest");
            before = control;
        }
    }

    /// Chooses what an open list calls so; the list of targets calls its runs the same.
    ///
    /// # Panics
    /// When nothing in the list is called so.
    pub async fn choose(&self, name: &str) {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            let all = self.controls().await;
            let listed =
                |c: &&Control| c.role == "button" && c.name == name && c.region != "Targets and runs";
            if let Some(control) = all.iter().rfind(listed) {
                let (x, y) = control.middle();
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

    /// Gives a field or slider a value as a screen reader does, without the pointer.
    pub async fn set_value(&self, role: &str, name: &str, value: &str) {
        let act = format!("e.value = '{value}'; e.dispatchEvent(new Event('input', {{bubbles: true}}))");
        self.act_on(role, name, &act).await;
    }

    /// Does something to a control's element `e`; another element may be in its place since it was found.
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

    /// Waits until a text with these words is on the page.
    ///
    /// # Panics
    /// With all texts, when it does not come.
    pub async fn says(&self, words: &str) {
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

    /// What a screen reader was told last.
    pub async fn spoken(&self) -> String {
        let text = self.evaluate("return document.getElementById('sightline-status').textContent").await;
        text.as_str().unwrap_or_default().to_owned()
    }

    /// What the page's address says after its `#`.
    pub async fn fragment(&self) -> String {
        let hash = self.evaluate("return location.hash").await;
        hash.as_str().unwrap_or_default().trim_start_matches('#').to_owned()
    }

    /// The page's status, as `viewer/src/page/status.rs` describes it.
    pub async fn status(&self) -> Value {
        let text = self.evaluate("return document.getElementById('sightline').dataset.status || '{}'").await;
        serde_json::from_str(text.as_str().unwrap_or("{}")).unwrap_or_default()
    }

    /// Waits until a condition over the page's status `s` holds; long enough for rendering on a busy machine.
    ///
    /// # Panics
    /// With the status, when it never does.
    pub async fn wait_status(&self, what: &str, condition: &str) {
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
        self.shot("waited").await;
        panic!("waited {} s for {what}; the page says {}", LONG_PATIENCE.as_secs(), self.status().await);
    }

    /// Goes to a place of the drive as a person writes it, and waits until that step is shown.
    pub async fn go_to(&self, place: &str, step: usize) {
        self.press("g").await;
        self.control("textbox", "go to step").await;
        self.type_text(place).await;
        self.press("Enter").await;
        self.gone("textbox", "go to step").await;
        self.wait_status("the step", &format!("s.step === {step} && s.shown")).await;
    }

    /// Brings a panel to the front by the palette.
    pub async fn show_panel(&self, name: &str) {
        self.chord(&["Control"], "k").await;
        self.control("textbox", "palette").await;
        self.type_text(&format!("show {name}")).await;
        self.control("option", &format!("Show {name}")).await;
        self.press("Enter").await;
        self.gone("textbox", "palette").await;
        self.control("region", name).await;
    }

    /// Ends the browser, which has received no error in its console.
    ///
    /// # Panics
    /// With the errors, when there are some.
    pub async fn end(self) {
        assert_eq!(self.console_errors().await, Vec::<String>::new());
        self.close().await;
    }

    /// Keeps a picture of the page in the folder that `SIGHTLINE_SHOTS` names, to be looked at.
    pub async fn shot(&self, name: &str) {
        if let Some(folder) = std::env::var_os("SIGHTLINE_SHOTS") {
            let folder = std::path::PathBuf::from(folder);
            std::fs::create_dir_all(&folder).expect("the folder of pictures");
            std::fs::write(folder.join(format!("{name}.png")), self.screenshot().await).expect("a picture");
        }
    }
}
