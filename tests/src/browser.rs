//! A browser for the tests: headless Chromium with software WebGL, controlled through chromedriver.
//!
//! `cargo xtask test` installs both programs and sets `SIGHTLINE_CHROMIUM` and `SIGHTLINE_CHROMEDRIVER`; without these
//! variables they are searched in `PATH`. Every [`Browser`] has its own driver, profile and port, so that tests can run in
//! parallel, and ends both processes when it is dropped.
//!
//! A failed step panics with a message.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use fantoccini::actions::{
    InputSource, KeyAction, KeyActions, MOUSE_BUTTON_LEFT, MouseActions, PointerAction,
};
use fantoccini::key::Key;
use fantoccini::wd::{Capabilities, WebDriverCompatibleCommand};
use fantoccini::{Client, ClientBuilder};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::processes::{self, ResourceUse};

/// The id of the canvas on which the viewer paints.
const CANVAS: &str = "sightline";

/// Maximum time for a page to reach a state; painting in software is slow.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running Chromium.
pub struct Browser {
    client: Client,
    driver: Driver,
}

impl Browser {
    /// Starts a driver and a browser with a fresh profile; the window has 1600 × 1000 pixels.
    ///
    /// # Panics
    /// When the programs are missing or do not start.
    pub async fn start() -> Self {
        let chromium = program("SIGHTLINE_CHROMIUM", &["chromium", "chromium-browser", "google-chrome"]);
        let mut driver = Driver::start();
        let capabilities = capabilities(&chromium, &driver.profile);
        let client = ClientBuilder::new(HttpConnector::new())
            .capabilities(capabilities)
            .connect(&format!("http://127.0.0.1:{}", driver.port))
            .await
            .unwrap_or_else(|error| panic!("chromedriver cannot start {}: {error}", chromium.display()));
        let process = client.capabilities().and_then(|all| all.get("goog:processID")).and_then(Value::as_u64);
        driver.browser = Some(process.expect("chromedriver tells the process of its browser"));
        Self { client, driver }
    }

    /// Opens a page and returns once the browser has loaded it; the viewer may still be starting.
    pub async fn goto(&self, url: &str) {
        self.client.goto(url).await.unwrap_or_else(|error| panic!("{url} cannot be opened: {error}"));
    }

    /// Waits until the page has removed its loading message, which means that the viewer runs.
    ///
    /// # Panics
    /// With the message of the page if the viewer cannot start.
    pub async fn wait_for_viewer(&self) {
        let script = "const message = document.getElementById('message'); \
                      return message.hidden || message.classList.contains('failed')";
        self.wait_for("the viewer to start", script).await;
        let failure = self
            .evaluate("const m = document.getElementById('message'); return m.hidden ? null : m.innerText")
            .await;
        assert!(failure.is_null(), "the viewer did not start; the page says: {failure}");
    }

    /// Waits until a script such as `return document.title === "ready"` gives a true value.
    pub async fn wait_for(&self, what: &str, script: &str) {
        let start = Instant::now();
        loop {
            let value = self.evaluate(script).await;
            if !matches!(value, Value::Null | Value::Bool(false)) {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "waited {PATIENCE:?} for {what}, in vain");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }

    /// Runs the body of a JavaScript function in the page and returns what it returns.
    pub async fn evaluate(&self, script: &str) -> Value {
        self.client
            .execute(script, Vec::new())
            .await
            .unwrap_or_else(|error| panic!("the script `{script}` failed: {error}"))
    }

    /// Moves the pointer to a position on the canvas, in CSS pixels from its upper left corner.
    pub async fn point_at(&self, x: f64, y: f64) {
        self.act(x, y, &[]).await;
    }

    /// Clicks with the left button at a position on the canvas, in CSS pixels from its upper left corner.
    pub async fn click(&self, x: f64, y: f64) {
        // The browser truncates fractions of a pixel.
        let (x, y) = (x.round(), y.round());
        let pause = PointerAction::Pause { duration: Duration::from_millis(50) };
        let down = PointerAction::Down { button: MOUSE_BUTTON_LEFT };
        let up = PointerAction::Up { button: MOUSE_BUTTON_LEFT };
        self.act(x, y, &[pause.clone(), down, pause, up]).await;
    }

    /// Presses and releases a key, named as JavaScript names it: `ArrowRight`, `Home`, `a`, `+` and so on.
    pub async fn press(&self, key: &str) {
        self.chord(&[], key).await;
    }

    /// Presses a key while others are down: `["Control"], "k"`.
    pub async fn chord(&self, held: &[&str], key: &str) {
        let down = held.iter().chain([&key]).map(|key| KeyAction::Down { value: key_value(key) });
        let up =
            [&key].into_iter().chain(held.iter().rev()).map(|key| KeyAction::Up { value: key_value(key) });
        self.type_actions(down.chain(up), key).await;
    }

    /// Holds a key down until [`Self::key_up`].
    pub async fn key_down(&self, key: &str) {
        self.type_actions([KeyAction::Down { value: key_value(key) }], key).await;
    }

    /// Releases a key.
    pub async fn key_up(&self, key: &str) {
        self.type_actions([KeyAction::Up { value: key_value(key) }], key).await;
    }

    async fn type_actions(&self, actions: impl IntoIterator<Item = KeyAction>, key: &str) {
        let keyboard = actions.into_iter().fold(KeyActions::new("keyboard".to_owned()), InputSource::then);
        let done = self.client.perform_actions(keyboard).await;
        done.unwrap_or_else(|error| panic!("the key {key} cannot be pressed or let go: {error}"));
    }

    /// Types a text, letter by letter.
    pub async fn type_text(&self, text: &str) {
        for letter in text.chars() {
            self.press(&letter.to_string()).await;
        }
    }

    /// Drags with the left button from one position on the canvas to another, CSS px.
    pub async fn drag(&self, from: (f64, f64), to: (f64, f64)) {
        let pause = PointerAction::Pause { duration: Duration::from_millis(60) };
        let mut rest = vec![PointerAction::Down { button: MOUSE_BUTTON_LEFT }, pause.clone()];
        for k in 1..=6 {
            let share = f64::from(k) / 6.0;
            let (x, y) = (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share);
            rest.push(PointerAction::MoveTo { duration: None, x: x.round(), y: y.round() });
            rest.push(pause.clone());
        }
        rest.push(PointerAction::Up { button: MOUSE_BUTTON_LEFT });
        self.act(from.0.round(), from.1.round(), &rest).await;
    }

    /// Returns role and name of an element as the browser computes them for a screen reader.
    pub async fn computed(&self, selector: &str) -> (String, String) {
        let element = self.client.find(fantoccini::Locator::Css(selector)).await;
        let element = element.unwrap_or_else(|error| panic!("nothing is {selector}: {error}"));
        let ask = |what: &'static str| Computed { element: element.element_id().to_string(), what };
        let mut answers = Vec::new();
        for what in ["computedrole", "computedlabel"] {
            let answer = self.client.issue_cmd(ask(what)).await;
            let answer = answer.unwrap_or_else(|error| panic!("{what} of {selector}: {error}"));
            answers.push(answer.as_str().unwrap_or_default().to_owned());
        }
        let name = answers.pop().unwrap_or_default();
        (answers.pop().unwrap_or_default(), name)
    }

    /// Resizes the page, px. The height of the browser's own bars varies with its version, and the page follows its window
    /// with a delay; the size of the page is therefore read until it is the requested one.
    pub async fn resize(&self, width: u32, height: u32) {
        let wanted = [i64::from(width), i64::from(height)];
        let mut window = wanted;
        for _ in 0..200 {
            let [width, height] = window.map(|pixels| u32::try_from(pixels).expect("a size of a window"));
            let done = self.client.set_window_size(width, height).await;
            done.unwrap_or_else(|error| panic!("the window cannot have {width} × {height}: {error}"));
            tokio::time::sleep(Duration::from_millis(100)).await;
            let sizes = self.evaluate("return [innerWidth, innerHeight, outerWidth, outerHeight]").await;
            let size = |k: usize| sizes[k].as_i64().expect("a number of pixels");
            let page = [size(0), size(1)];
            if page == wanted {
                return;
            }
            let is_settled = [size(2), size(3)] == window && (0..2).all(|k| page[k] <= window[k]);
            if is_settled {
                window = [0, 1].map(|k| wanted[k] + window[k] - page[k]);
            }
        }
        panic!("the page does not take the size {width} × {height}");
    }

    /// Drops a file or folder of this machine on the middle of the page, like a user with the mouse.
    pub async fn drop_path(&self, path: &std::path::Path) {
        let size = self.evaluate("return [innerWidth / 2, innerHeight / 2]").await;
        let path = std::fs::canonicalize(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let data = json!({ "items": [], "files": [path], "dragOperationsMask": 1 });
        for event in ["dragEnter", "dragOver", "drop"] {
            let params = json!({ "type": event, "x": size[0], "y": size[1], "data": data });
            let done = self.client.issue_cmd(DevTools { command: "Input.dispatchDragEvent", params }).await;
            done.unwrap_or_else(|error| panic!("{} cannot be dropped: {error}", path.display()));
        }
    }

    /// A screenshot of the page, PNG.
    pub async fn screenshot(&self) -> Vec<u8> {
        self.client.screenshot().await.unwrap_or_else(|error| panic!("the page cannot be pictured: {error}"))
    }

    /// The errors written to the console since the last call.
    pub async fn console_errors(&self) -> Vec<String> {
        let entries = self
            .client
            .issue_cmd(ConsoleLog)
            .await
            .unwrap_or_else(|error| panic!("the console is mute: {error}"));
        let errors = entries.as_array().into_iter().flatten().filter(|entry| entry["level"] == "SEVERE");
        errors.map(|entry| entry["message"].as_str().unwrap_or_default().to_owned()).collect()
    }

    /// Resources used by the browser's processes so far; `None` where the system does not report them.
    pub fn resource_use(&self) -> Option<ResourceUse> {
        processes::resource_use(self.driver.browser?)
    }

    /// Ends the browser in an orderly way; dropping it also ends it.
    pub async fn close(self) {
        let Self { client, driver } = self;
        client.close().await.unwrap_or_else(|error| panic!("the browser cannot be closed: {error}"));
        drop(driver);
    }

    /// Moves the pointer to a position on the canvas and performs `rest` there.
    async fn act(&self, x: f64, y: f64, rest: &[PointerAction]) {
        let script = format!(
            "const r = document.getElementById('{CANVAS}').getBoundingClientRect(); return [r.left, r.top]"
        );
        let corner = self.evaluate(&script).await;
        let offset = |index: usize| corner[index].as_f64().unwrap_or_default();
        let there = PointerAction::MoveTo { duration: None, x: offset(0) + x, y: offset(1) + y };
        let mouse =
            rest.iter().cloned().fold(MouseActions::new("mouse".to_owned()).then(there), InputSource::then);
        self.client
            .perform_actions(mouse)
            .await
            .unwrap_or_else(|error| panic!("the pointer cannot act at {x}, {y}: {error}"));
    }
}

/// A running chromedriver with the profile of its browser.
struct Driver {
    process: Child,
    /// Process id of the browser, once it is started.
    browser: Option<u64>,
    port: u16,
    profile: TempDir,
}

impl Driver {
    /// Starts the driver on a port that the system chooses.
    fn start() -> Self {
        let program = program("SIGHTLINE_CHROMEDRIVER", &["chromedriver"]);
        let profile = tempfile::tempdir().expect("a temporary folder for the browser's profile");
        let mut process = Command::new(&program)
            .arg("--port=0")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| panic!("{} cannot be started: {error}", program.display()));
        let output = process.stdout.take().expect("chromedriver's output is piped");
        let mut lines = BufReader::new(output).lines().map_while(Result::ok);
        let port = lines.find_map(|line| {
            let number = line.split("successfully on port ").nth(1)?;
            number.trim_end_matches('.').parse().ok()
        });
        // The driver stops when it cannot write, so its further output is read and discarded.
        std::thread::spawn(move || lines.for_each(drop));
        let port =
            port.unwrap_or_else(|| panic!("{} says no port and has probably ended", program.display()));
        Self { process, browser: None, port, profile }
    }

    /// Tells the driver to end its browser and itself.
    fn shut_down(&self) -> std::io::Result<()> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port))?;
        stream.set_read_timeout(Some(Duration::from_secs(5)))?;
        write!(
            stream,
            "GET /shutdown HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nConnection: close\r\n\r\n",
            self.port
        )?;
        stream.read_to_end(&mut Vec::new()).map(drop)
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        if let (Err(_), Some(browser)) = (self.shut_down(), self.browser) {
            // A driver that does not answer leaves its browser running; if it has ended, the kill has no effect.
            Command::new("kill")
                .arg(browser.to_string())
                .stderr(Stdio::null())
                .status()
                .map(drop)
                .unwrap_or_default();
        }
        let start = Instant::now();
        while matches!(self.process.try_wait(), Ok(None)) && start.elapsed() < Duration::from_secs(5) {
            std::thread::sleep(Duration::from_millis(20));
        }
        self.process.kill().unwrap_or_default();
        self.process.wait().map(drop).unwrap_or_default();
    }
}

/// Chromedriver's own command that returns the console log.
#[derive(Debug)]
struct ConsoleLog;

impl WebDriverCompatibleCommand for ConsoleLog {
    fn endpoint(&self, base: &url::Url, session: Option<&str>) -> Result<url::Url, url::ParseError> {
        base.join(&format!("session/{}/se/log", session.unwrap_or_default()))
    }

    fn method_and_body(&self, _url: &url::Url) -> (axum::http::Method, Option<String>) {
        (axum::http::Method::POST, Some(json!({ "type": "browser" }).to_string()))
    }
}

/// Chromedriver's command that calls the developer tools.
#[derive(Debug)]
struct DevTools {
    command: &'static str,
    params: Value,
}

impl WebDriverCompatibleCommand for DevTools {
    fn endpoint(&self, base: &url::Url, session: Option<&str>) -> Result<url::Url, url::ParseError> {
        base.join(&format!("session/{}/goog/cdp/execute", session.unwrap_or_default()))
    }

    fn method_and_body(&self, _url: &url::Url) -> (axum::http::Method, Option<String>) {
        let body = json!({ "cmd": self.command, "params": self.params });
        (axum::http::Method::POST, Some(body.to_string()))
    }
}

/// The WebDriver command for the accessible role or name of an element.
#[derive(Debug)]
struct Computed {
    element: String,
    what: &'static str,
}

impl WebDriverCompatibleCommand for Computed {
    fn endpoint(&self, base: &url::Url, session: Option<&str>) -> Result<url::Url, url::ParseError> {
        let session = session.unwrap_or_default();
        base.join(&format!("session/{session}/element/{}/{}", self.element, self.what))
    }

    fn method_and_body(&self, _url: &url::Url) -> (axum::http::Method, Option<String>) {
        (axum::http::Method::GET, None)
    }
}

/// The path of a browser program, from its variable or from `PATH`.
fn program(variable: &str, names: &[&str]) -> PathBuf {
    let named = std::env::var_os(variable).map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let found = || {
        let in_directory =
            |name: &&str| std::env::split_paths(&path).map(|at| at.join(name)).find(|at| at.is_file());
        names.iter().find_map(in_directory)
    };
    named.or_else(found).unwrap_or_else(|| {
        panic!("{} is missing: run the tests with `cargo xtask test`, which installs it", names[0])
    })
}

/// Capabilities of the browser: headless, without sandbox (the tests also run as root), software WebGL, no network fetches.
fn capabilities(chromium: &std::path::Path, profile: &TempDir) -> Capabilities {
    let mut arguments: Vec<String> = [
        "--headless=new",
        "--no-sandbox",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-dev-shm-usage",
        "--window-size=1600,1000",
    ]
    .map(str::to_owned)
    .into();
    arguments.push(format!("--user-data-dir={}", profile.path().display()));
    let options = json!({ "binary": chromium, "args": arguments });
    let all = [
        ("browserName", json!("chrome")),
        ("goog:chromeOptions", options),
        ("goog:loggingPrefs", json!({ "browser": "ALL" })),
    ];
    all.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// The character that encodes a key in the WebDriver protocol.
fn key_value(key: &str) -> char {
    let named = match key {
        "ArrowLeft" => Key::Left,
        "ArrowRight" => Key::Right,
        "ArrowUp" => Key::Up,
        "ArrowDown" => Key::Down,
        "Home" => Key::Home,
        "End" => Key::End,
        "PageUp" => Key::PageUp,
        "PageDown" => Key::PageDown,
        "Enter" => Key::Enter,
        "Escape" => Key::Escape,
        "Tab" => Key::Tab,
        "Control" => Key::Control,
        "Shift" => Key::Shift,
        "Backspace" => Key::Backspace,
        "Delete" => Key::Delete,
        _ => {
            let mut letters = key.chars();
            return match (letters.next(), letters.next()) {
                (Some(letter), None) => letter,
                _ => panic!("`{key}` is no key that the tests know: add it to `key_value`"),
            };
        }
    };
    named.into()
}
