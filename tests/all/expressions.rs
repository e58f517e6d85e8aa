//! Expressions, breakpoints and queries over HTTP, and the document of the language.

use axum::body::Body;
use axum::http::Method;
use serde_json::json;
use sightline_recordings::create_simulated;
use sightline_tests::server::{Answer, TestServer, request, small_drive, small_scenario};

/// A server with a session whose target was tracked to the end, and its folders.
async fn tracked() -> (TestServer, String, [tempfile::TempDir; 2]) {
    let folders = [small_drive(), tempfile::tempdir().unwrap()];
    let server = TestServer::open(folders[0].path(), folders[1].path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    (server, session, folders)
}

/// A server with a session on a drive that was never rendered, for requests that need no images.
async fn begun() -> (TestServer, String, [tempfile::TempDir; 2]) {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    create_simulated(&small_scenario(), folders[0].path()).unwrap();
    let server = TestServer::open(folders[0].path(), folders[1].path());
    let session = server.begin().await;
    (server, session, folders)
}

async fn delete(server: &TestServer, path: &str) -> Answer {
    server.send(request(Method::DELETE, path).body(Body::empty()).unwrap()).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_query_answers_for_every_run_at_once_as_the_rows_do() {
    let (server, session, _folders) = tracked().await;
    let new = json!({ "run": 0, "from_step": 3, "settings": { "ncc_min": 0.999 } });
    server.post(&format!("sessions/{session}/targets/0/runs"), &new).await.expect(202);
    let fork = server.ended(&session, 0, 1).await;
    assert_eq!(fork["rows"][3]["state"], json!("lost"));
    let path = format!("sessions/{session}/query");
    let lost =
        server.post(&path, &json!({ "expression": "state == lost and state changes" })).await.expect(200);
    assert_eq!((&lost["answers"], &lost["count"]), (&json!("truth"), &json!(1)), "{lost}");
    assert_eq!((&lost["runs"][0]["hits"], &lost["runs"][1]["hits"]), (&json!([]), &json!([3])));
    let asked = json!({ "expression": "sigma_m * 100", "values": true, "target": 0 });
    let sigma = server.post(&path, &asked).await.expect(200);
    assert_eq!((&sigma["answers"], &sigma["unit"]), (&json!("number"), &json!("m")));
    for (run, view) in [(0, server.ended(&session, 0, 0).await), (1, fork)] {
        for (k, row) in view["rows"].as_array().unwrap().iter().enumerate() {
            let expected = row["sigma_m"].as_f64().map(|sigma| sigma * 100.0);
            assert_eq!(sigma["runs"][run]["values"][k].as_f64(), expected, "run {run}, step {k}");
        }
    }
    let differs = server.post(&path, &json!({ "expression": "differs(A, B, state)" })).await.expect(200);
    assert_eq!(differs["runs"][0]["hits"][0], json!(3), "the runs part at step 3: {differs}");
}

#[tokio::test(flavor = "multi_thread")]
async fn breakpoints_can_be_edited_and_survive_a_restart() {
    let (server, session, folders) = tracked().await;
    let path = format!("sessions/{session}/breakpoints");
    let mut events = server.state.events().subscribe();
    let high = server.post(&path, &json!({ "expression": "ncc > 0.5" })).await.expect(201);
    assert_eq!(
        (&high["number"], &high["on"], &high["count"]),
        (&json!(0), &json!(true), &json!(4)),
        "{high}"
    );
    assert_eq!(high["hits"], json!([{ "target": 0, "run": 0, "steps": [1, 2, 3, 4] }]));
    let event = serde_json::to_value(events.try_recv().unwrap()).unwrap();
    assert_eq!(event["event"], json!("session_changed"), "other pages hear of it");
    let here = server.post(&path, &json!({ "step": 2 })).await.expect(201);
    assert_eq!((&here["expression"], &here["count"]), (&json!("step == 2"), &json!(1)));
    let off = server.json(Method::PATCH, &format!("{path}/0"), &json!({ "on": false })).await.expect(200);
    assert_eq!((&off["on"], &off["count"], &off["hits"]), (&json!(false), &json!(0), &json!([])));
    let other = json!({ "expression": "step >= 3", "on": true });
    let other = server.json(Method::PATCH, &format!("{path}/0"), &other).await.expect(200);
    assert_eq!(other["count"], json!(2));
    assert_eq!(server.get(&path).await.expect(200), json!([other, here]));
    let view = server.get(&format!("sessions/{session}")).await.expect(200);
    assert_eq!(view["breakpoints"][1], json!({ "number": 1, "expression": "step == 2", "on": true }));
    drop(server);
    let server = TestServer::open(folders[0].path(), folders[1].path());
    server.get(&format!("sessions/{session}")).await.expect(200);
    server.ended(&session, 0, 0).await;
    assert_eq!(server.get(&path).await.expect(200), json!([other, here]));
    assert_eq!(delete(&server, &format!("{path}/1")).await.status, 204);
    assert_eq!(server.get(&path).await.expect(200), json!([other]));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_resumed_run_adds_hits() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    std::fs::remove_dir_all(drive.path().join("images")).unwrap();
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    let path = format!("sessions/{session}/breakpoints");
    server.post(&path, &json!({ "expression": "step >= 0" })).await.expect(201);
    server.pick(&session).await;
    let early = server.get(&path).await.expect(200)[0]["count"].as_u64().unwrap();
    server.ended(&session, 0, 0).await;
    assert_eq!(server.get(&path).await.expect(200)[0]["count"], json!(5));
    assert!(early < 5, "each step has to be rendered first, so the run was under way");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_expression_is_a_problem_with_field_position_and_hint() {
    let (server, session, _folders) = begun().await;
    let query = format!("sessions/{session}/query");
    let breakpoints = format!("sessions/{session}/breakpoints");
    let unknown = server.post(&query, &json!({ "expression": "step > 1 && nccc < 0.6" })).await;
    assert!(unknown.problem(422, "expression").contains("no name `nccc`"));
    let body = unknown.json();
    assert_eq!((&body["field"], &body["position"]), (&json!("expression"), &json!({ "from": 12, "to": 16 })));
    assert_eq!(body["hint"], json!("Did you mean `ncc`?"));
    for (expression, words) in [
        ("sigma_m < err_px", "in px"),
        ("ncc < ", "ends too soon"),
        ("1 < step < 3", "do not chain"),
        ("ncc", "a breakpoint is a condition"),
        ("", "no expression yet"),
    ] {
        let refused = server.post(&breakpoints, &json!({ "expression": expression })).await;
        let sentence = refused.problem(422, "expression");
        assert!(sentence.contains(words), "{sentence}");
        assert!(refused.json()["position"]["to"].is_u64());
    }
    let long = "1+".repeat(400) + "1 > 0";
    assert!(
        server.post(&query, &json!({ "expression": long })).await.problem(422, "expression").contains("500")
    );
    let deep = "(".repeat(200);
    assert!(
        server
            .post(&query, &json!({ "expression": deep }))
            .await
            .problem(422, "expression")
            .contains("levels of nesting")
    );
    assert_eq!(server.get(&breakpoints).await.expect(200), json!([]), "nothing was set");
}

#[tokio::test(flavor = "multi_thread")]
async fn unknown_fields_targets_and_breakpoints_are_refused() {
    let (server, session, _folders) = begun().await;
    let query = format!("sessions/{session}/query");
    let path = format!("sessions/{session}/breakpoints");
    let extra = json!({ "expression": "fault", "colour": "red" });
    assert!(server.post(&query, &extra).await.problem(422, "field").contains("colour"));
    assert!(server.post(&path, &extra).await.problem(422, "field").contains("colour"));
    let nowhere = json!({ "expression": "fault", "target": 7 });
    assert!(server.post(&query, &nowhere).await.problem(422, "field").contains("target 7"));
    let word = json!({ "expression": "state", "values": true });
    assert!(server.post(&query, &word).await.problem(422, "expression").contains("cannot be plotted"));
    server.post(&path, &json!({})).await.problem(422, "field");
    server.post(&path, &json!({ "expression": "fault", "step": 1 })).await.problem(422, "field");
    assert!(server.post(&path, &json!({ "step": 5 })).await.problem(422, "field").contains("5 stops"));
    server.json(Method::PATCH, &format!("{path}/9"), &json!({ "on": true })).await.problem(404, "not_found");
    delete(&server, &format!("{path}/9")).await.problem(404, "not_found");
    server.post("sessions/s99/query", &json!({ "expression": "fault" })).await.problem(404, "not_found");
    for step in 0..64 {
        server.post(&path, &json!({ "expression": format!("step > {step}") })).await.expect(201);
    }
    let full = server.post(&path, &json!({ "expression": "fault" })).await.problem(422, "expression");
    assert!(full.contains("64 breakpoints"), "{full}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_language_and_completion_are_served() {
    let (server, _session, _folders) = begun().await;
    let language = server.get("expressions").await.expect(200);
    let names = language["names"].as_array().unwrap();
    let sigma = names.iter().find(|name| name["name"] == json!("sigma_m")).unwrap();
    assert_eq!(
        (&sigma["unit"], &sigma["stage"], &sigma["kind"]),
        (&json!("m"), &json!("row"), &json!("number"))
    );
    let margin = names.iter().find(|name| name["name"] == json!("judge.gates.left_right_px.margin")).unwrap();
    assert_eq!((&margin["unit"], &margin["stage"]), (&json!("px"), &json!("judge")));
    assert!(language["functions"].to_string().contains("differs(A, B, x, by)"));
    let asked = json!({ "text": "step > 3 && sig", "cursor": 15 });
    let offered = server.post("expressions/complete", &asked).await.expect(200);
    assert_eq!((&offered["from"], &offered["candidates"][0]["text"]), (&json!(12), &json!("sigma_m")));
    server.post("expressions/complete", &json!({ "text": "a" })).await.problem(422, "field");
}

/// The tables and examples of docs/expressions.md.
struct Page {
    text: String,
}

impl Page {
    fn read() -> Self {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/expressions.md");
        Self { text: std::fs::read_to_string(path).unwrap() }
    }

    /// The cells of the table below a heading, without their backticks.
    fn column(&self, heading: &str) -> Vec<Vec<String>> {
        let below = self.text.split(&format!("## {heading}\n")).nth(1).unwrap_or_default();
        let section = below.split("\n## ").next().unwrap_or_default();
        let rows = section.lines().filter(|line| line.starts_with("| `"));
        let code = |cell: &str| cell.strip_prefix('`')?.strip_suffix('`').map(str::to_owned);
        let cell = |cell: &str| code(cell.trim()).unwrap_or_else(|| cell.trim().to_owned());
        rows.map(|row| row.trim_matches('|').split(" | ").map(cell).collect()).collect()
    }

    /// The lines of all code blocks of a kind.
    fn blocks(&self, kind: &str) -> Vec<String> {
        let begin = format!("```{kind}\n");
        let blocks = self.text.split(&begin).skip(1);
        let lines = blocks.flat_map(|block| block.split("```").next().unwrap_or_default().lines());
        lines.filter(|line| !line.trim().is_empty()).map(str::to_owned).collect()
    }
}

#[test]
fn the_language_page_lists_exactly_the_catalogue() {
    use sightline_session::expression::{catalogue, functions, unit};
    let page = Page::read();
    let known: Vec<Vec<String>> = catalogue::short_names()
        .into_iter()
        .map(|name| vec![name.name, name.unit, name.stage, name.meaning])
        .collect();
    let written = page.column("Names");
    for name in &known {
        assert!(written.contains(name), "docs/expressions.md lacks the row | {} |", name.join(" | "));
    }
    assert_eq!(written.len(), known.len(), "docs/expressions.md has rows that the catalogue has not");
    let functions: Vec<Vec<String>> =
        functions::FUNCTIONS.iter().map(|f| vec![f.form.to_owned(), f.meaning.to_owned()]).collect();
    assert_eq!(page.column("Functions"), functions);
    let units: Vec<String> = page.column("Units").into_iter().map(|row| row[0].clone()).collect();
    assert_eq!(units, unit::Unit::words().collect::<Vec<_>>());
}

#[test]
fn documented_expressions_parse_or_fail_as_documented() {
    use sightline_session::expression::Expression;
    let page = Page::read();
    let examples = page.blocks("expression");
    assert!(examples.len() > 15, "{examples:?}");
    for example in examples {
        Expression::read(&example).unwrap_or_else(|refused| panic!("{example}: {refused}"));
    }
    let refused: Vec<Vec<String>> = page.column("What is refused");
    assert!(refused.len() > 5);
    for row in refused {
        let wrong = Expression::read(&row[0]).expect_err(&row[0]);
        assert_eq!(wrong.to_string(), row[1], "{}", row[0]);
    }
    let limits = [("characters", 500_usize), ("parts", 200), ("levels of nesting", 32)];
    for (what, limit) in limits {
        assert!(page.text.contains(&format!("{limit}")), "the limit of {what}");
    }
}
