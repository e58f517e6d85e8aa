//! Why, what if, what would have saved it, and the tree of runs, over HTTP.

use std::time::{Duration, Instant};

use axum::http::{Method, header};
use serde_json::{Value, json};
use sightline_tests::server::{TestServer, small_drive};
use tempfile::TempDir;

/// A server with a target whose run A is tracked to its end.
struct Fixture {
    drive: TempDir,
    folder: TempDir,
    server: TestServer,
    session: String,
}

impl Fixture {
    async fn new() -> Self {
        let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
        let server = TestServer::open(drive.path(), folder.path());
        let session = server.begin().await;
        server.pick(&session).await;
        server.ended(&session, 0, 0).await;
        Self { drive, folder, server, session }
    }

    fn runs(&self) -> String {
        format!("sessions/{}/targets/0/runs", self.session)
    }

    fn step(&self, run: u64, step: u64) -> String {
        format!("{}/{run}/steps/{step}", self.runs())
    }

    /// Forks a run and waits for its end.
    async fn fork(&self, new: &Value) -> Value {
        let run = self.server.post(&self.runs(), new).await.expect(202)["number"].as_u64().unwrap();
        self.server.ended(&self.session, 0, run).await
    }

    /// A run that loses the target at step 2 because of a strict limit.
    async fn lost(&self) -> Value {
        let run = self.fork(&json!({ "run": 0, "from_step": 2, "settings": { "ncc_min": 0.9999 } })).await;
        assert_eq!(run["rows"][2]["state"], json!("lost"), "{run}");
        run
    }

    async fn view(&self) -> Value {
        self.server.get(&format!("sessions/{}", self.session)).await.expect(200)
    }

    /// Waits for the answer to a counterfactual question about a step.
    async fn answered(&self, path: &str) -> Value {
        let begun = Instant::now();
        loop {
            let question = self.server.get(path).await.expect(200);
            if !["waiting", "running"].contains(&question["state"].as_str().unwrap()) {
                return question;
            }
            assert!(begun.elapsed() < Duration::from_secs(300), "no answer: {question}");
            tokio::time::sleep(Duration::from_millis(30)).await;
        }
    }

    /// Restarts the server with the same folders.
    async fn restarted(self) -> Self {
        let Self { drive, folder, server, session } = self;
        drop(server);
        let server = TestServer::open(drive.path(), folder.path());
        server.get(&format!("sessions/{session}")).await.expect(200);
        Self { drive, folder, server, session }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn trying_a_step_with_other_settings_stores_nothing() {
    let fixture = Fixture::new().await;
    let before = fixture.view().await;
    let path = format!("{}/what_if", fixture.step(0, 2));
    let same = fixture.server.post(&path, &json!({})).await.expect(200);
    assert_eq!(same["row"], before["targets"][0]["runs"][0]["rows"][2]);
    assert_eq!((&same["deltas"]["ncc"], &same["deltas"]["moved_px"]), (&json!(0.0), &json!(0.0)));
    let strict = json!({ "settings": { "ncc_min": 0.9999, "search_window_px": 61 }, "arrays": ["surface"] });
    let tried = fixture.server.post(&path, &strict).await.expect(200);
    assert_eq!(tried["row"]["state"], json!("lost"));
    assert_eq!(tried["deltas"]["state_recorded"], json!("tracking"));
    assert_eq!(tried["search_window"]["width"], json!(61));
    assert_eq!(tried["what_if"], strict);
    let surface = &tried["arrays"][0];
    assert_eq!((&surface["name"], &surface["size"]), (&json!("surface"), &json!([41, 41])));
    assert_eq!(surface["values"].as_array().unwrap().len(), 41 * 41);
    let gates = tried["verdict"]["gates"].as_array().unwrap();
    assert!(gates.iter().any(|gate| gate["name"] == "ncc" && gate["limit"] == json!(0.9999)));
    let predicted = &same["predicted_left"];
    let put = json!({ "x": predicted["x"].as_f64().unwrap() + 12.5, "y": predicted["y"] });
    let moved = fixture.server.post(&path, &json!({ "prediction_px": put })).await.expect(200);
    for axis in ["x", "y"] {
        let (shown, requested) = (moved["predicted_left"][axis].as_f64(), put[axis].as_f64());
        assert!((shown.unwrap() - requested.unwrap()).abs() < 1e-6, "{moved}");
    }
    assert_eq!(fixture.view().await, before, "trying changes nothing");
}

#[tokio::test(flavor = "multi_thread")]
async fn invalid_trials_are_rejected_in_one_sentence() {
    let fixture = Fixture::new().await;
    let path = format!("{}/what_if", fixture.step(0, 2));
    for (body, code, names) in [
        (json!({ "settings": { "ncc_min": 3 } }), "setting", "ncc_min"),
        (json!({ "settings": { "ncc_mim": 0.3 } }), "setting", "did you mean ncc_min"),
        (json!({ "setting": {} }), "field", "setting"),
        (json!({ "prediction_px": { "x": 1e9, "y": 0.0 } }), "field", "prediction_px"),
        (json!({ "arrays": ["nonsense"] }), "field", "arrays"),
    ] {
        let sentence = fixture.server.post(&path, &body).await.problem(422, code);
        assert!(sentence.contains(names), "{body}: {sentence}");
    }
    let designated = format!("{}/what_if", fixture.step(0, 0));
    let put = json!({ "prediction_px": { "x": 10.0, "y": 10.0 } });
    fixture.server.post(&designated, &put).await.problem(422, "request");
    fixture.server.post(&designated, &json!({})).await.expect(200);
    fixture
        .server
        .post(&format!("{}/what_if", fixture.step(0, 9)), &json!({}))
        .await
        .problem(404, "not_found");
    fixture
        .server
        .post(&format!("{}/what_if", fixture.step(7, 2)), &json!({}))
        .await
        .problem(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_displaced_branch_has_the_same_bits_after_a_restart() {
    let fixture = Fixture::new().await;
    let same = fixture.server.post(&format!("{}/what_if", fixture.step(0, 2)), &json!({})).await.expect(200);
    let put = json!({ "x": same["predicted_left"]["x"].as_f64().unwrap() - 9.0,
        "y": same["predicted_left"]["y"].as_f64().unwrap() + 4.0 });
    let new =
        json!({ "run": 0, "from_step": 2, "settings": { "search_window_px": 81 }, "prediction_px": put });
    let tried = json!({ "settings": new["settings"], "prediction_px": put });
    let tried = fixture.server.post(&format!("{}/what_if", fixture.step(0, 2)), &tried).await.expect(200);
    let branch = fixture.fork(&new).await;
    assert_eq!(branch["fork"], json!({ "run": 0, "from_step": 2, "prediction_px": put }));
    assert_eq!(branch["rows"][2], tried["row"], "the branch begins with what was tried");
    let view = fixture.view().await;
    assert_eq!(branch["rows"][1], view["targets"][0]["runs"][0]["rows"][1], "steps before it are shared");
    let traces: Vec<Vec<u8>> = {
        let mut traces = Vec::new();
        for step in 0..5 {
            traces.push(fixture.server.get(&fixture.step(1, step)).await.bytes);
        }
        traces
    };
    // A fork at the same step displaces the prediction as its parent did.
    let again = fixture.fork(&json!({ "run": 1, "from_step": 2 })).await;
    assert_eq!((&again["rows"], &again["fork"]["prediction_px"]), (&branch["rows"], &put));
    let fixture = fixture.restarted().await;
    let restored = fixture.server.ended(&fixture.session, 0, 1).await;
    assert_eq!((&restored["rows"], &restored["fork"]), (&branch["rows"], &branch["fork"]));
    for (step, trace) in traces.iter().enumerate() {
        assert_eq!(&fixture.server.get(&fixture.step(1, step as u64)).await.bytes, trace, "step {step}");
    }
    let first = json!({ "run": 0, "from_step": 0, "prediction_px": put });
    let sentence = fixture.server.post(&fixture.runs(), &first).await.problem(422, "field");
    assert!(sentence.starts_with("prediction_px"), "{sentence}");
}

#[tokio::test(flavor = "multi_thread")]
async fn counterfactual_answers_are_verified_changes() {
    let fixture = Fixture::new().await;
    let lost = fixture.lost().await;
    let path = format!("{}/counterfactual", fixture.step(1, 2));
    assert_eq!(fixture.server.get(&path).await.expect(200)["state"], json!("unasked"));
    let nowhere = format!("{}/counterfactual", fixture.step(1, 99));
    fixture.server.get(&nowhere).await.problem(404, "not_found");
    let requested = fixture.server.post(&path, &json!({})).await;
    assert_eq!(requested.headers[header::LOCATION], format!("/api/v1/{path}"));
    assert_eq!(requested.expect(202)["step"], json!(2));
    let question = fixture.answered(&path).await;
    assert_eq!(question["state"], json!("done"), "{question}");
    let answer = &question["answer"];
    assert_eq!(answer["k"], answer["n"]);
    let findings = answer["findings"].as_array().unwrap();
    let by_limit = findings.iter().find(|finding| finding["changes"][0]["setting"] == "ncc_min").unwrap();
    let ncc = lost["rows"][2]["ncc"].as_f64().unwrap();
    let to = by_limit["changes"][0]["to"].as_f64().unwrap();
    assert!(to <= ncc && ncc - to <= 0.1 * (0.9999 - ncc), "{to} for {ncc}");
    assert_eq!(by_limit["outcome"], json!("right"));
    // A what-if with the change, and a branch, give the promised result.
    let changes = json!({ "ncc_min": to });
    let tried = json!({ "settings": changes });
    let tried = fixture.server.post(&format!("{}/what_if", fixture.step(1, 2)), &tried).await.expect(200);
    assert_eq!(tried["row"], by_limit["row"]);
    let branch = fixture.fork(&json!({ "run": 1, "from_step": 2, "settings": changes })).await;
    assert_eq!(branch["rows"][2], by_limit["row"]);
    // A repeated question has its answer already.
    assert_eq!(fixture.server.post(&path, &json!({})).await.expect(202), question);
    fixture.server.post(&format!("{path}/cancel"), &json!({})).await.problem(409, "conflict");
    let fine = format!("{}/counterfactual", fixture.step(0, 2));
    let sentence = fixture.server.post(&fine, &json!({})).await.problem(422, "request");
    assert!(sentence.contains("nothing to save"), "{sentence}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancelled_question_keeps_its_findings() {
    let fixture = Fixture::new().await;
    fixture.lost().await;
    let path = format!("{}/counterfactual", fixture.step(1, 2));
    fixture.server.post(&path, &json!({})).await.expect(202);
    let cancelled = fixture.server.post(&format!("{path}/cancel"), &json!({})).await.expect(200);
    assert_eq!(cancelled["state"], json!("cancelled"));
    let found = cancelled["answer"].clone();
    tokio::time::sleep(Duration::from_millis(200)).await;
    assert_eq!(fixture.server.get(&path).await.expect(200)["answer"], found, "nothing is found after it");
    // It can be asked again.
    assert_ne!(fixture.server.post(&path, &json!({})).await.expect(202)["state"], json!("cancelled"));
    assert_eq!(fixture.answered(&path).await["state"], json!("done"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_value_links_to_its_inputs_file_and_pose() {
    let fixture = Fixture::new().await;
    fixture.lost().await;
    let path = format!("{}/why", fixture.step(1, 2));
    let verdict = fixture.server.get(&path).await.expect(200);
    assert!(verdict["sentence"].as_str().unwrap().contains("Rejected: match score "), "{verdict}");
    assert_eq!((&verdict["gates"][0]["name"], &verdict["tree"]), (&json!("ncc"), &Value::Null));
    let row = fixture.server.get(&fixture.step(1, 2)).await.expect(200);
    let score = &row["locate"]["evidence"]["match_template"]["score"];
    let tree = fixture.server.get(&format!("{path}?value=ncc")).await.expect(200)["tree"].clone();
    assert_eq!((&tree["numbers"][0], &tree["stage"]), (score, &json!("match_template")));
    let text = tree.to_string();
    let open = fixture.server.state.traverses().remove(0);
    let files = &open.traverse.index().stops[2];
    assert!(text.contains(&files.left.image), "{text}");
    assert!(text.contains("pose estimate of stop 2") && text.contains("\"kind\":\"setting\""), "{text}");
    for name in verdict["values"].as_array().unwrap() {
        let name = name.as_str().unwrap();
        let tree = fixture.server.get(&format!("{path}?value={name}")).await.expect(200);
        assert_eq!(tree["tree"]["value"], json!(name));
    }
    let sentence = fixture.server.get(&format!("{path}?value=nonsense")).await.problem(422, "request");
    assert!(sentence.starts_with("value: "), "{sentence}");
    fixture.server.get(&format!("{path}?valve=ncc")).await.problem(422, "query");
}

#[tokio::test(flavor = "multi_thread")]
async fn removed_runs_and_targets_can_be_restored() {
    let fixture = Fixture::new().await;
    let child = fixture.fork(&json!({ "run": 0, "from_step": 2, "settings": { "focus_px": 0.0 } })).await;
    let remove = |path: String| {
        let server = &fixture.server;
        async move { server.json(Method::DELETE, &path, &json!({})).await }
    };
    let view = remove(format!("{}/0", fixture.runs())).await.expect(200);
    let numbers: Vec<u64> = view["targets"][0]["runs"]
        .as_array()
        .unwrap()
        .iter()
        .map(|run| run["number"].as_u64().unwrap())
        .collect();
    assert_eq!(numbers, [1]);
    fixture.server.get(&fixture.step(0, 1)).await.problem(404, "not_found");
    remove(format!("{}/0", fixture.runs())).await.problem(404, "not_found");
    // The last run stays: its target is removed instead.
    let sentence = remove(format!("{}/1", fixture.runs())).await.problem(422, "request");
    assert!(sentence.contains("remove the target instead"), "{sentence}");
    let fixture = fixture.restarted().await;
    assert_eq!(fixture.server.ended(&fixture.session, 0, 1).await["rows"], child["rows"]);
    fixture.server.get(&fixture.step(0, 1)).await.problem(404, "not_found");
    let restore = format!("{}/0/restore", fixture.runs());
    let view = fixture.server.post(&restore, &json!({})).await.expect(200);
    assert_eq!(view["targets"][0]["runs"].as_array().unwrap().len(), 2);
    fixture.server.post(&restore, &json!({})).await.problem(404, "not_found");
    fixture.server.get(&fixture.step(0, 1)).await.expect(200);
    // The same for the target.
    let target = format!("sessions/{}/targets/0", fixture.session);
    let view = fixture.server.json(Method::DELETE, &target, &json!({})).await.expect(200);
    assert_eq!(view["targets"], json!([]));
    let view = fixture.server.post(&format!("{target}/restore"), &json!({})).await.expect(200);
    assert_eq!(view["targets"][0]["number"], json!(0));
    assert_eq!(fixture.server.ended(&fixture.session, 0, 1).await["rows"], child["rows"]);
    fixture.server.post(&format!("{target}/restore"), &json!({})).await.problem(404, "not_found");
}
