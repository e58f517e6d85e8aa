//! kill −9 at random moments during changes to everything that the server stores.
//!
//! One client makes one change after the other and records the acknowledged ones. The change in progress at the kill may be
//! stored or not; everything else must be exactly as acknowledged.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::PoisonError;
use std::time::Duration;

use serde_json::{Value, json};
use sightline_tests::server::{PIXEL, TOKEN, small_drive};

use super::{EXCLUSIVE, has_ended, print_row, until};
use crate::persistence::ServerProcess;

/// Kills in the ordinary tests.
const KILLS: u64 = 3;
/// Maximum number of sessions; the oldest is removed to make room.
const SESSIONS: usize = 4;
/// Maximum number of forks of a session.
const FORKS: u64 = 3;

fn kills() -> u64 {
    std::env::var("SIGHTLINE_KILLS").map_or(KILLS, |text| text.parse().expect("a number"))
}

/// A pseudo-random sequence, the same in each run.
struct Rng(u64);

impl Rng {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }
}

/// The data that the server stores, by the API path that shows them, without values that depend on time.
type Facts = BTreeMap<String, Value>;

/// Key of a fact that only the client has: the largest number that a session had.
const LAST: &str = "last";
/// Placeholder for the new form of a session, of which only its growth is checked.
const LONGER: &str = "longer";

/// A run as requested: number, fork, settings.
fn run(view: &Value) -> Value {
    json!([view["number"], view["fork"], view["settings"]])
}

/// The targets of a session as designated, with their runs.
fn targets(view: &Value) -> Value {
    let runs = |target: &Value| target["runs"].as_array().unwrap().iter().map(run).collect::<Value>();
    let targets = view["targets"].as_array().unwrap().iter();
    targets
        .map(|target| json!([target["number"], target["label"], target["designation"], runs(target)]))
        .collect()
}

/// The stored data at a path, without values that depend on time.
fn shown(server: &ServerProcess, path: &str) -> Value {
    let (status, body) = server.answer("GET", path, "", "");
    if status != 200 {
        return Value::Null;
    }
    let value: Value = serde_json::from_str(&body).unwrap();
    let each = |list: &Value, of: &dyn Fn(&Value) -> Value| list.as_array().unwrap().iter().map(of).collect();
    match path.rsplit('/').next().unwrap() {
        "sessions" => each(&value, &|session| session["id"].clone()),
        "notes" => each(&value, &|note| json!([note["id"], note["text"]])),
        "breakpoints" => each(&value, &|breakpoint| breakpoint["expression"].clone()),
        "jobs" => each(&value, &|job| json!([job["id"], job["study"]])),
        "counterfactual" => json!(value["state"] != "unasked"),
        _ if path.starts_with("documents/") => value["value"].clone(),
        _ => targets(&value),
    }
}

/// The client: the acknowledged changes, and the one in progress.
struct Client {
    address: String,
    facts: Facts,
    in_progress: Option<(String, Value)>,
    acknowledged: u64,
    rng: Rng,
}

impl Client {
    /// Sends a request; `None` if the server was killed during it.
    fn send(&self, method: &str, path: &str, body: &Value) -> Option<(u16, Value)> {
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let mut stream = TcpStream::connect(&self.address).ok()?;
        let (length, host) = (body.len(), &self.address);
        let head = format!(
            "{method} /api/v1/{path} HTTP/1.0\r\nHost: {host}\r\nAuthorization: Bearer {TOKEN}\r\nIf-Match: *\r\n\
             Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
        );
        stream.write_all(head.as_bytes()).ok()?;
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).ok()?;
        let answer = String::from_utf8(answer).ok()?;
        let (head, body) = answer.split_once("\r\n\r\n")?;
        Some((head.split(' ').nth(1)?.parse().ok()?, serde_json::from_str(body).unwrap_or(Value::Null)))
    }

    /// Makes a change; `after` is the value at the path `at` after it. `None` if the server was killed during it.
    fn change(&mut self, method: &str, path: &str, body: &Value, at: &str, after: Value) -> Option<Value> {
        self.in_progress = Some((at.to_owned(), after.clone()));
        let (status, answer) = self.send(method, path, body)?;
        self.in_progress = None;
        assert!(status < 500 || status == 503, "{method} {path}: {status} {answer}");
        if (200..300).contains(&status) {
            self.facts.insert(at.to_owned(), after);
            self.acknowledged += 1;
        }
        Some(answer)
    }

    /// The list at a path with one more entry.
    fn with(&self, path: &str, entry: Value) -> Value {
        let mut list = self.facts.get(path).and_then(Value::as_array).cloned().unwrap_or_default();
        list.push(entry);
        list.into()
    }

    fn sessions(&self) -> Vec<String> {
        let list = self.facts.get("sessions").and_then(Value::as_array).cloned().unwrap_or_default();
        list.iter().map(|id| id.as_str().unwrap().to_owned()).collect()
    }

    /// Begins a session with a target. Its number follows the largest one so far, including a change in progress at a kill.
    fn begin(&mut self, traverse: &str) -> Option<()> {
        let next = 1 + self.facts.get(LAST).and_then(Value::as_u64).unwrap_or(0);
        let id = format!("s{next}");
        let after = self.with("sessions", json!(id));
        self.change("POST", "sessions", &json!({ "traverse": traverse }), "sessions", after)?;
        self.facts.insert(LAST.to_owned(), json!(next));
        for part in ["", "/notes", "/breakpoints"] {
            self.facts.insert(format!("sessions/{id}{part}"), json!([]));
        }
        let [x, y] = PIXEL;
        let target = json!({ "step": 0, "pixel": { "x": x, "y": y }, "label": "rock" });
        self.grow(&format!("sessions/{id}"), "targets", &target)
    }

    /// Makes a change whose result is only in the response; without a response, the session is only known to have grown.
    fn grow(&mut self, session: &str, below: &str, body: &Value) -> Option<()> {
        self.in_progress = Some((session.to_owned(), json!(LONGER)));
        let (status, answer) = self.send("POST", &format!("{session}/{below}"), body)?;
        self.in_progress = None;
        assert!(status < 500 || status == 503, "{session}/{below}: {status} {answer}");
        if (200..300).contains(&status) {
            self.acknowledged += 1;
            let targets = match answer.get("session") {
                Some(whole) => targets(whole),
                None => {
                    let mut targets = self.facts[session].clone();
                    targets[0][3].as_array_mut()?.push(run(&answer));
                    targets
                }
            };
            self.facts.insert(session.to_owned(), targets);
        }
        Some(())
    }

    /// Makes changes until the server is killed.
    fn change_until_killed(&mut self, traverse: &str) -> Option<()> {
        loop {
            let sessions = self.sessions();
            if sessions.len() < 2 {
                self.begin(traverse)?;
                continue;
            }
            let id = sessions[self.rng.below(sessions.len() as u64) as usize].clone();
            let session = format!("sessions/{id}");
            match self.rng.below(16) {
                0 if sessions.len() < SESSIONS => self.begin(traverse)?,
                0 => {
                    let oldest = &sessions[0];
                    let rest: Value = json!(sessions[1..]);
                    self.change("DELETE", &format!("sessions/{oldest}"), &Value::Null, "sessions", rest)?;
                    let of_it = format!("sessions/{oldest}");
                    self.facts.retain(|path, _| *path != of_it && !path.starts_with(&format!("{of_it}/")));
                }
                1..=4 => {
                    let at = format!("{session}/notes");
                    let number = self.facts[&at].as_array().unwrap().len() + 1;
                    let text = format!("note {number} {}", "y".repeat(self.rng.below(3000) as usize));
                    let after = self.with(&at, json!([number, text]));
                    self.change("POST", &at, &json!({ "step": 0, "text": text }), &at, after)?;
                }
                5..=8 => {
                    let name = format!("documents/layout-{}", self.rng.below(3));
                    let value = json!({ "count": self.acknowledged, "third": 1.0 / 3.0 });
                    self.change("PUT", &name, &value.clone(), &name, value.clone())?;
                }
                9..=10 => self.mark(&session)?,
                11..=12 => self.branch(&session)?,
                13 => self.question(&session)?,
                14 if self.rng.below(8) == 0 => self.study()?,
                _ => {
                    let cursor = json!({ "target": 0, "run": 0, "step": self.rng.below(5) });
                    self.send("PUT", &format!("{session}/cursor"), &cursor)?;
                }
            }
        }
    }

    /// Sets a new breakpoint.
    fn mark(&mut self, session: &str) -> Option<()> {
        let at = format!("{session}/breakpoints");
        let expression = format!("ncc < 0.{}", 100 + self.facts[&at].as_array().unwrap().len());
        let after = self.with(&at, json!(expression));
        self.change("POST", &at, &json!({ "expression": expression }), &at, after).map(|_| ())
    }

    /// Runs the target again from a step, with a limit that loses it.
    fn branch(&mut self, session: &str) -> Option<()> {
        if self.facts[session][0][3].as_array().is_none_or(|runs| runs.len() as u64 > FORKS) {
            return Some(());
        }
        let new = json!({ "run": 0, "from_step": 2, "settings": { "ncc_min": 0.9999 } });
        self.grow(session, "targets/0/runs", &new)
    }

    /// Requests the counterfactual answer for the step that the first branch lost.
    fn question(&mut self, session: &str) -> Option<()> {
        let at = format!("{session}/targets/0/runs/1/steps/2/counterfactual");
        self.change("POST", &at, &json!({}), &at, json!(true)).map(|_| ())
    }

    /// Starts a study and stops it, so that it takes no time.
    fn study(&mut self) -> Option<()> {
        let at = "studies/jobs";
        let number = self.facts.get(at).and_then(Value::as_array).map_or(1, |jobs| jobs.len() + 1);
        let after = self.with(at, json!([format!("study-{number}"), "straight"]));
        self.change("POST", at, &json!({ "study": "straight", "seeds": [1] }), at, after)?;
        self.send("POST", &format!("studies/jobs/study-{number}/cancel"), &Value::Null).map(|_| ())
    }
}

/// Compares all facts with the acknowledged ones, adopts the change in progress, and returns the number of facts compared.
fn check(server: &ServerProcess, client: &mut Client, round: u64) -> u64 {
    assert_eq!(server.get("health")["notices"], json!([]), "round {round}");
    let in_progress = client.in_progress.take();
    if let Some((at, after)) = &in_progress {
        let (now, before) = (shown(server, at), client.facts.get(at).cloned().unwrap_or_default());
        let is_longer = *after == json!(LONGER) && now.to_string().len() > before.to_string().len();
        let is_not_asked = before.is_null() && now == json!(false);
        assert!(
            now == before || now == *after || is_longer || is_not_asked,
            "round {round}, {at}: {now} for {before}"
        );
        if now != before && !is_not_asked {
            client.facts.insert(at.clone(), now);
        }
        if at == "sessions" {
            settle_sessions(server, client);
        }
    }
    for (path, expected) in client.facts.iter().filter(|(path, _)| *path != LAST) {
        assert_eq!(&shown(server, path), expected, "round {round}: {path}");
    }
    client.facts.len() as u64
}

/// Reconciles a session whose creation or removal was in progress at the kill: its parts exist or are gone with it.
fn settle_sessions(server: &ServerProcess, client: &mut Client) {
    let sessions = client.sessions();
    let is_of = |path: &str, id: &str| {
        path == format!("sessions/{id}") || path.starts_with(&format!("sessions/{id}/"))
    };
    client
        .facts
        .retain(|path, _| !path.starts_with("sessions/") || sessions.iter().any(|id| is_of(path, id)));
    for id in &sessions {
        let number: u64 = id[1..].parse().unwrap();
        let last = client.facts.get(LAST).and_then(Value::as_u64).unwrap_or(0);
        client.facts.insert(LAST.to_owned(), json!(last.max(number)));
        for part in ["", "/notes", "/breakpoints"] {
            let path = format!("sessions/{id}{part}");
            let now = shown(server, &path);
            client.facts.entry(path).or_insert(now);
        }
    }
}

/// The rows of a session's runs by their fork, once all have ended.
fn rows(server: &ServerProcess, session: &str) -> BTreeMap<String, String> {
    let runs = shown(server, &format!("sessions/{session}"));
    let runs = runs[0][3].as_array().cloned().unwrap_or_default();
    let mut found = BTreeMap::new();
    for run in runs {
        let number = &run[0];
        until(server, &format!("sessions/{session}/targets/0/runs/{number}"), has_ended);
        let path = format!("sessions/{session}/exports/rows.jsonl?target=0&run={number}");
        let text = server.raw("GET", &path, "", "").replace(&format!("\"run\":{number}"), "\"run\":0");
        found.insert(run[1].to_string(), text);
    }
    found
}

#[test]
fn killed_at_any_moment_the_program_loses_nothing_confirmed() {
    let _exclusive = EXCLUSIVE.lock().unwrap_or_else(PoisonError::into_inner);
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let kills = kills();
    let mut client = Client {
        address: String::new(),
        facts: Facts::new(),
        in_progress: None,
        acknowledged: 0,
        rng: Rng(2026),
    };
    let (mut checked, mut runs) = (0, 0);
    let mut bits = BTreeMap::<String, String>::new();
    for round in 0..=kills {
        let server = ServerProcess::start(drive.path(), data.path());
        checked += check(&server, &mut client, round);
        // Interrupted runs continue to the same bits; each round checks one session.
        let sessions = client.sessions();
        if let Some(id) = sessions.get(client.rng.below(SESSIONS as u64) as usize) {
            for (fork, text) in rows(&server, id) {
                runs += 1;
                let first = bits.entry(fork.clone()).or_insert_with(|| text.clone());
                assert_eq!(&text, first, "round {round}, session {id}, fork {fork}");
            }
        }
        if round == kills {
            break;
        }
        let traverse = server.get("traverses")[0]["id"].as_str().unwrap().to_owned();
        client.address.clone_from(&server.address);
        let moment = Duration::from_millis(5 + client.rng.below(400));
        client = std::thread::scope(|scope| {
            let working = scope.spawn(move || {
                assert!(client.change_until_killed(&traverse).is_none());
                client
            });
            std::thread::sleep(moment);
            server.kill();
            working.join().unwrap()
        });
    }
    assert!(client.acknowledged >= kills, "{} changes in {kills} rounds", client.acknowledged);
    print_row(
        "kill −9 at random moments",
        &format!(
            "{kills} kills, {} changes acknowledged, {checked} facts compared: 0 lost, 0 invented; {runs} runs with the same bits",
            client.acknowledged
        ),
    );
}
