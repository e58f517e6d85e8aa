//! Every export of a session has the format of its name, also with hostile labels; and the plain pages.

use std::path::Path;
use std::process::Command;

use axum::http::header;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;
use serde_json::{Value, json};
use sightline_session::metrics;
use sightline_tests::server::{Answer, PIXEL, TestServer, rows_of_run, small_drive, small_recording};

use crate::cli::program;

/// A label that could act as a formula, a script, two cells or a path.
const HOSTILE: &str = "=1+1,\"<script>alert('x')</script>\r\n../../etc";

/// A server with a session that has a target with that label, a fork and two notes.
async fn session(drive: &Path, folder: &Path) -> TestServer {
    let server = TestServer::open(drive, folder);
    server.begin().await;
    let [x, y] = PIXEL;
    let target = json!({ "step": 0, "pixel": { "x": x, "y": y }, "label": HOSTILE });
    server.post("sessions/s1/targets", &target).await.expect(201);
    server.ended("s1", 0, 0).await;
    let fork = json!({ "run": 0, "from_step": 2, "settings": { "ncc_min": 0.999 } });
    server.post("sessions/s1/targets/0/runs", &fork).await.expect(202);
    server.ended("s1", 0, 1).await;
    let note = json!({ "target": 0, "run": 1, "step": 3, "text": "**why** <img src=x onerror=alert(1)> [x](javascript:alert(1))" });
    server.post("sessions/s1/notes", &note).await.expect(201);
    server
}

/// A file of the session; checks its headers.
async fn file(server: &TestServer, name: &str, query: &str) -> Answer {
    let answer = server.get(&format!("sessions/s1/exports/{name}{query}")).await;
    assert_eq!(answer.status.as_u16(), 200, "{name}: {}", answer.text());
    let disposition = answer.headers[header::CONTENT_DISPOSITION].to_str().unwrap();
    let saved = disposition.strip_prefix("attachment; filename=\"").unwrap().strip_suffix('"').unwrap();
    let plain = |c: char| c.is_ascii_alphanumeric() || "-.".contains(c);
    assert!(saved.chars().all(plain) && saved.ends_with(name), "{disposition}");
    answer
}

#[tokio::test(flavor = "multi_thread")]
async fn the_tables_hold_the_same_rows_to_the_last_bit_and_no_formula() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = session(drive.path(), folder.path()).await;
    let jsonl = file(&server, "rows.jsonl", "").await.text();
    let rows: Vec<Value> = jsonl.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(rows.len(), 10);
    assert_eq!((&rows[0]["label"], &rows[9]["run"]), (&json!(HOSTILE), &json!(1)));

    let csv = cells(&file(&server, "rows.csv", "").await.text());
    assert!(csv.iter().all(|row| row.len() == csv[0].len()), "a label is one cell");
    assert_eq!(
        (csv.len(), csv[1][1].as_str()),
        (11, format!("'{HOSTILE}").as_str()),
        "no cell begins a formula"
    );
    let column = |name: &str| csv[0].iter().position(|cell| cell == name).unwrap();
    for (row, line) in rows.iter().zip(&csv[1..]) {
        let (score, written) = (row["ncc"].as_f64(), line[column("ncc")].parse().ok());
        assert_eq!((score, &row["state"]), (written, &json!(line[column("state")])));
    }

    let parquet = file(&server, "rows.parquet", "?target=0&run=1").await;
    let mut copy = tempfile::tempfile().unwrap();
    std::io::Write::write_all(&mut copy, &parquet.bytes).unwrap();
    let reader = SerializedFileReader::new(copy).unwrap();
    let about = reader.metadata().file_metadata();
    let unit = about.key_value_metadata().unwrap().iter().find(|pair| pair.key == "unit:err_px").unwrap();
    assert_eq!(unit.value.as_deref(), Some("px"));
    let names: Vec<String> = about.schema().get_fields().iter().map(|f| f.name().to_owned()).collect();
    assert_eq!(names, csv[0]);
    let read: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
    assert_eq!(read.len(), 5);
    for (read, row) in read.iter().zip(&rows[5..]) {
        assert_eq!(Some(read.get_long(column("step")).unwrap()), row["step"].as_i64());
        assert_eq!(read.get_double(column("ncc")).ok(), row["ncc"].as_f64());
        assert_eq!(read.get_double(column("sigma_m")).ok(), row["sigma_m"].as_f64());
        assert_eq!(read.get_string(column("label")).unwrap(), HOSTILE);
    }
}

/// The cells of a CSV table, read by RFC 4180.
fn cells(text: &str) -> Vec<Vec<String>> {
    let (mut rows, mut row, mut cell, mut quoted) = (Vec::new(), Vec::new(), String::new(), false);
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        match (c, quoted) {
            ('"', true) if rest.peek() == Some(&'"') => cell.push(rest.next().unwrap()),
            ('"', _) => quoted = !quoted,
            (',', false) => row.push(std::mem::take(&mut cell)),
            ('\n', false) => {
                row.push(std::mem::take(&mut cell));
                rows.push(std::mem::take(&mut row));
            }
            (c, _) => cell.push(c),
        }
    }
    assert!(cell.is_empty() && row.is_empty() && !quoted, "the last line has an end");
    rows
}

#[tokio::test(flavor = "multi_thread")]
async fn animation_and_sheet_have_one_image_per_step() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = session(drive.path(), folder.path()).await;
    let animation = file(&server, "steps.apng", "?target=0&run=0").await;
    let mut reader = png::Decoder::new(std::io::Cursor::new(&animation.bytes)).read_info().unwrap();
    let frames = reader.info().animation_control.expect("it is animated").num_frames;
    assert_eq!(frames, 5);
    let size = reader.output_buffer_size().unwrap();
    let decoded: Vec<Vec<u8>> = (0..frames)
        .map(|_| {
            let mut frame = vec![0; size];
            reader.next_frame(&mut frame).unwrap();
            frame
        })
        .collect();
    assert!(decoded.windows(2).all(|pair| pair[0] != pair[1]), "every step looks different");
    let sheet = file(&server, "steps.png", "?target=0&run=1").await;
    let sheet = image::load_from_memory(&sheet.bytes).unwrap();
    assert!(sheet.width() > 5 * 320 && sheet.height() > 320, "{} × {}", sheet.width(), sheet.height());
    assert_ne!(file(&server, "steps.apng", "?target=0&run=1").await.bytes, animation.bytes);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_report_is_self_contained_and_well_formed() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = session(drive.path(), folder.path()).await;
    let report = file(&server, "report.html", "").await;
    assert!(
        report.headers[header::CONTENT_SECURITY_POLICY].to_str().unwrap().starts_with("default-src 'none'")
    );
    let html = report.text();
    safe(&html, "report");
    let missing: Vec<_> = metrics::NAMES.into_iter().filter(|name| !html.contains(*name)).collect();
    assert!(missing.is_empty(), "the report has the metrics of the page: {missing:?}");
    for part in [
        "Worst steps",
        "The target was not lost at any step.",
        "First loss: step 2",
        "<strong>why</strong>",
        "ncc_min",
        "SHA-256",
        "sightline track",
        "&lt;script&gt;",
        "Match score (NCC)",
    ] {
        assert!(html.contains(part), "{part} is missing");
    }
    let why = server.get("sessions/s1/targets/0/runs/1/steps/2/why").await.json()["sentence"].clone();
    assert!(html.contains(why.as_str().unwrap()), "why the target was lost: {why}");
    assert_eq!(html.matches("data:image/png").count(), 2 * 4, "four steps after the designation of two runs");
    for path in [drive.path(), folder.path()] {
        assert!(!html.contains(path.to_str().unwrap()), "no path of this machine");
    }
    let remote = html.replace("http://www.w3.org", "");
    assert!(!remote.contains("http://") && !remote.contains("src=\"http"), "nothing remote");
}

/// Asserts that a page is well-formed like XML, except for the void elements of HTML, and contains no script.
fn safe(html: &str, what: &str) {
    const VOID: [&str; 6] = ["meta", "img", "br", "hr", "link", "!doctype"];
    let lower = html.to_lowercase();
    for bad in ["<script", "<iframe", "<object", "javascript:", "<img src=x", "<form", " onerror=alert(1)>\""]
    {
        assert!(!lower.contains(bad), "{what}: {bad}");
    }
    let mut open: Vec<String> = Vec::new();
    let mut rest = html;
    while let Some(start) = rest.find('<') {
        let end =
            start + rest[start..].find('>').unwrap_or_else(|| panic!("{what}: an element without an end"));
        let tag = &rest[start + 1..end];
        assert_eq!(tag.matches('"').count() % 2, 0, "{what}: {tag}");
        let name: String =
            tag.trim_start_matches('/').chars().take_while(|c| !c.is_whitespace() && *c != '/').collect();
        if name == "style" && !tag.starts_with('/') {
            rest = &rest[end + rest[end..].find("</style>").unwrap()..];
            open.push(name);
            continue;
        }
        match (tag.starts_with('/'), tag.ends_with('/') || VOID.contains(&name.to_lowercase().as_str())) {
            (true, _) => assert_eq!(open.pop(), Some(name), "{what}"),
            (false, true) => {}
            (false, false) => open.push(name),
        }
        rest = &rest[end + 1..];
    }
    assert!(open.is_empty(), "{what}: {open:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_command_of_a_bundle_reproduces_its_rows() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = session(drive.path(), folder.path()).await;
    let bundle: Value = serde_json::from_slice(&file(&server, "reproduce.json", "").await.bytes).unwrap();
    assert_eq!(bundle["format"], json!("sightline-reproduce"));
    assert!(bundle["traverse"]["seed"].is_u64() && bundle["traverse"]["scenario_toml"].is_string());
    assert_eq!(bundle["session"]["targets"][0]["runs"].as_array().unwrap().len(), 2);
    assert_eq!((&bundle["notes"][0]["step"], &bundle["runs"][1]["command"]), (&json!(3), &Value::Null));
    let rows = file(&server, "rows.jsonl", "?target=0&run=0").await;
    assert_eq!(bundle["runs"][0]["rows_sha256"], json!(sightline_server::naming::hash(&rows.bytes)));
    let command = bundle["runs"][0]["command"].as_str().unwrap();
    let arguments: Vec<&str> = command.split(' ').skip(3).collect();
    let output = Command::new(program()).arg("track").arg(drive.path()).args(arguments).output().unwrap();
    let tracked = String::from_utf8(output.stdout).unwrap();
    let own = rows_of_run(&server.get("sessions/s1/exports/rows.jsonl?target=0&run=0").await.text());
    assert_eq!(tracked.lines().take(5).collect::<Vec<_>>(), own.lines().collect::<Vec<_>>(), "{command}");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_list_of_exports_has_sizes_and_commands() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = session(drive.path(), folder.path()).await;
    let list = server.get("sessions/s1/exports?target=0&run=1").await.expect(200);
    let entries = list.as_array().unwrap();
    assert_eq!(entries.len(), 8);
    for entry in entries {
        let answer = server.get(entry["path"].as_str().unwrap()).await;
        let (bytes, stated) = (answer.bytes.len() as f64, entry["size"]["bytes"].as_f64().unwrap());
        assert_eq!(answer.headers[header::CONTENT_LENGTH].to_str().unwrap(), bytes.to_string(), "{entry}");
        let exact = entry["size"]["is_exact"] == json!(true);
        let factor = if exact { 1.0 } else { 4.0 };
        assert!(
            bytes <= factor * stated && stated <= factor * bytes,
            "{bytes} bytes, said {stated}: {entry}"
        );
        let command = entry["command"].as_str().unwrap();
        assert!(command.starts_with("sightline export ") && command.ends_with("--run 0/1"), "{command}");
    }
    server.get("sessions/s1/exports/rows.xlsx").await.problem(404, "not_found");
    server.get("sessions/s1/exports/rows.csv?target=7").await.problem(404, "not_found");
    server.get("sessions/s1/exports/rows.csv?run=0").await.problem(422, "query");
    server.get("sessions/s1/exports/rows.csv?colour=0").await.problem(422, "query");
    server.post("sessions", &json!({ "traverse": server.traverse })).await.expect(201);
    server.get("sessions/s2/exports/rows.csv").await.problem(409, "conflict");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_command_line_exports_identical_files() {
    let (drive, data) = (small_drive(), tempfile::tempdir().unwrap());
    let server = session(drive.path(), &data.path().join("sessions")).await;
    let folder = data.path().to_str().unwrap();
    for name in ["rows.csv", "rows.parquet", "steps.apng", "report.html", "reproduce.json"] {
        let out = data.path().join(name);
        let export = || {
            Command::new(program())
                .args([
                    "export",
                    name,
                    drive.path().to_str().unwrap(),
                    "--session",
                    "s1",
                    "--data-dir",
                    folder,
                    "--out",
                ])
                .arg(&out)
                .output()
                .unwrap()
        };
        let output = export();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(std::fs::read(&out).unwrap() == file(&server, name, "").await.bytes, "{name} differs");
        assert_eq!(export().status.code(), Some(3), "nothing is overwritten");
    }
    let out = data.path().join("two.csv");
    let target = format!("{},{}", PIXEL[0], PIXEL[1]);
    let arguments = ["export", "rows.csv", drive.path().to_str().unwrap(), "--target", &target, "--out"];
    let output = Command::new(program()).args(arguments).arg(&out).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (own, theirs) =
        (cells(&std::fs::read_to_string(&out).unwrap()), cells(&file(&server, "rows.csv", "").await.text()));
    assert_eq!(own[1][3..], theirs[1][3..], "the same rows without a session");
    for (arguments, code, culprit) in [
        (vec!["export", "rows.xlsx", "--session", "s1"], 2, "rows.csv"),
        (vec!["export", "rows.csv"], 2, "--session"),
        (vec!["export", "rows.csv", "--session", "s9", "--data-dir", folder], 3, "s9"),
        (vec!["export", "rows.csv", "--session", "s1", "--data-dir", "/nowhere/at/all"], 3, "no sessions"),
        (vec!["export", "rows.csv", "--session", "s1", "--data-dir", folder], 3, "name its folder"),
    ] {
        let output = Command::new(program()).args(&arguments).output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        assert!(stderr.contains(culprit), "{arguments:?}: {stderr}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_step_has_an_accessible_plain_page() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = session(drive.path(), folder.path()).await;
    for run in 0..2 {
        for step in 0..5 {
            let answer = server.get(&format!("sessions/s1/targets/0/runs/{run}/steps/{step}/page")).await;
            let html = answer.text();
            assert_eq!(answer.status.as_u16(), 200, "{html}");
            safe(&html, &format!("run {run}, step {step}"));
            assert_eq!(html.matches("<h1>").count(), 1);
            for img in html.split("<img ").skip(1) {
                let alt = img.split("alt=\"").nth(1).unwrap().split('"').next().unwrap();
                assert!(alt.len() > 20, "a picture is described: {alt}");
            }
            for table in html.split("<table>").skip(1) {
                assert!(table.starts_with("<caption>") && table.contains("scope=\"col\""), "{table}");
            }
            let policy = answer.headers[header::CONTENT_SECURITY_POLICY].to_str().unwrap();
            assert!(policy.starts_with("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
            assert_eq!(html.contains("Next step"), step < 4, "run {run}, step {step}");
        }
    }
    let lost = server.get("sessions/s1/targets/0/runs/1/steps/3/page").await.text();
    for part in [
        "lost",
        "at least 0.999<",
        "fail",
        "<strong>why</strong>",
        "Previous event: step",
        "The same step of run A",
        "match_template",
    ] {
        assert!(lost.contains(part), "{part} is missing");
    }
    for (path, status) in [
        ("sessions/s1/targets/0/runs/0/steps/99/page", 404),
        ("sessions/s7/page", 404),
        ("sessions/s1/page", 200),
        ("page", 200),
    ] {
        let answer = server.get(path).await;
        assert_eq!(answer.status.as_u16(), status, "{path}");
        assert!(answer.headers[header::CONTENT_TYPE].to_str().unwrap().starts_with("text/html"));
        safe(&answer.text(), path);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_of_all_branches_names_its_makers_and_its_layout() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = session(drive.path(), folder.path()).await;
    let bytes = file(&server, "recording.rrd", "").await.bytes;
    let path = folder.path().join("all.rrd");
    std::fs::write(&path, bytes).unwrap();
    let recording = sightline_tests::rrd::read(&path);
    assert!(recording.blueprint_activated, "the layout is complete and shall be shown");
    for entity in ["/__properties/sightline", "/target_1/update/position", "/target_1_run_1/update/position"]
    {
        assert!(recording.entities.contains_key(entity), "{entity}: {:?}", recording.entities.keys());
    }
    let one = file(&server, "recording.rrd", "?target=0&run=1").await.bytes;
    let path = folder.path().join("one.rrd");
    std::fs::write(&path, one).unwrap();
    let recording = sightline_tests::rrd::read(&path);
    assert!(!recording.entities.contains_key("/target_1/update/position"), "the other run is left out");
}

#[tokio::test(flavor = "multi_thread")]
async fn no_file_contains_the_folder_of_the_recording() {
    let mut tables = Vec::new();
    for _ in 0..2 {
        let (drive, folder) = (small_recording(), tempfile::tempdir().unwrap());
        std::fs::remove_file(drive.path().join("images/left_0002.png")).unwrap();
        let server = TestServer::open(drive.path(), folder.path());
        server.begin().await;
        server.pick("s1").await;
        server.ended("s1", 0, 0).await;
        let place = drive.path().file_name().unwrap().to_str().unwrap();
        for name in
            ["rows.csv", "rows.jsonl", "rows.parquet", "report.html", "recording.rrd", "reproduce.json"]
        {
            let bytes = file(&server, name, "").await.bytes;
            let contains = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
            assert!(!contains(place), "{name}");
            // A recording is compressed, and a bundle contains no reasons.
            let has_reasons = !matches!(name, "reproduce.json" | "recording.rrd");
            assert!(!has_reasons || contains("images/left_0002.png"), "{name}");
        }
        let [csv, jsonl, parquet] = [
            file(&server, "rows.csv", "").await,
            file(&server, "rows.jsonl", "").await,
            file(&server, "rows.parquet", "").await,
        ];
        let reproduced = file(&server, "reproduce.json", "").await.json()["runs"][0]["rows_sha256"].clone();
        tables.push((csv.bytes, jsonl.bytes, parquet.bytes, reproduced));
    }
    assert!(tables[0] == tables[1], "equal recordings in two folders give the same bytes");
}
