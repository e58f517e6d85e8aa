//! The command line: results, exit codes and messages; its results equal those of the server.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::{Value, json};
use sightline_tests::server::{PIXEL, TOKEN, TestServer, rows_of_run, small_drive, small_scenario};

/// The program: the one named by `SIGHTLINE_BIN`, otherwise the one beside this test.
pub(crate) fn program() -> PathBuf {
    if let Some(named) = std::env::var_os("SIGHTLINE_BIN") {
        return named.into();
    }
    let own = std::env::current_exe().unwrap();
    let beside = own.ancestors().nth(2).unwrap().join(format!("sightline{}", std::env::consts::EXE_SUFFIX));
    assert!(beside.is_file(), "build the program first: {} is missing", beside.display());
    beside
}

fn run(arguments: &[&str]) -> Output {
    let home = tempfile::tempdir().unwrap();
    Command::new(program()).args(arguments).env("SIGHTLINE_HOME", home.path()).output().unwrap()
}

/// Asserts a failure with that exit code, an empty standard output, and one sentence that names `culprit`.
fn refused(arguments: &[&str], code: i32, culprit: &str) {
    let output = run(arguments);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {complaint}");
    assert!(output.stdout.is_empty() && complaint.contains(culprit), "{arguments:?}: {complaint}");
    if code == 3 {
        assert_eq!(complaint.trim().lines().count(), 1, "{complaint}");
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn lines(output: &Output) -> Vec<Value> {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn target() -> String {
    format!("{},{}", PIXEL[0], PIXEL[1])
}

#[test]
fn bad_commands_and_bad_input_have_their_own_exit_codes() {
    let drive = small_drive();
    let folder = text(drive.path());
    let target = target();
    refused(&["track"], 2, "--target");
    refused(&["track", folder, "--target", "12"], 2, "x,y");
    refused(&["fly"], 2, "fly");
    refused(&["track", "/nowhere/at/all", "--target", "1,2"], 3, "/nowhere/at/all");
    refused(&["track", folder, "--target", "900,2"], 3, "(900, 2)");
    refused(&["track", folder, "--target", "-5,2"], 3, "(-5, 2)");
    refused(&["track", folder, "--target", &target, "--from-step", "77"], 3, "step 77");
    refused(&["track", folder, "--target", &target, "--set", "ncc_mim=0.5"], 3, "ncc_min");
    refused(&["track", folder, "--target", &target, "--set", "ncc_min"], 3, "key=value");
    refused(
        &["track", folder, "--target", &target, "--csv", text(&drive.path().join("traverse.toml"))],
        3,
        "exists",
    );
    refused(
        &["drive", "obstacles-10", "--target", "1,2", "--tolerance", "-1"],
        3,
        "tolerance_m: -1 is outside",
    );
    refused(&["study", "drive-grid", "--rows", "/nowhere/at/all"], 3, "cannot write /nowhere/at/all");
    refused(&["info", folder, "--colour"], 2, "--colour");
    refused(&["simulate", "--out", folder, "--set", "sun.height=3"], 3, "sun.height");
    refused(&["import", folder, "--out", "x"], 3, "native traverse");
    refused(&["serve", "/nowhere/at/all", "--port", "0"], 3, "/nowhere/at/all");
    let kitti = crate::recordings::kitti(1);
    let sequence = kitti.path().join("drive");
    refused(&["serve", text(&sequence), "--port", "0"], 3, "sightline serve --recordings");
    refused(&["serve", folder, "--port", "0", "--recordings", "/nowhere/at/all"], 3, "/nowhere/at/all");
    refused(&["serve", folder, "--port", "0", "--listen", "0.0.0.0"], 3, "--allow-host");
    let beyond = ["serve", folder, "--port", "0", "--listen", "0.0.0.0", "--allow-host", "rover.example"];
    refused(&[&beyond[..], &["--no-token"]].concat(), 3, "access token");
    refused(&[&beyond[..], &["--token", "short"]].concat(), 2, "16 to 256");
    refused(&["serve", folder, "--token", "0123456789abcdef", "--no-token"], 2, "--no-token");
    refused(&["serve", folder, "--behind-proxy", "rover.example"], 2, "https://rover.example/sightline/");
}

#[test]
fn info_writes_no_control_characters_of_a_file() {
    let drive = small_drive();
    let index = drive.path().join("traverse.toml");
    let named = std::fs::read_to_string(&index).unwrap().replacen("small drive", "\\u001b[31mred\\u0007", 1);
    std::fs::write(&index, named).unwrap();
    let output = run(&["info", text(drive.path())]);
    let output_text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && output_text.contains("name          [31mred"), "{output_text:?}");
    assert!(output_text.chars().all(|c| c == '\n' || !c.is_control()), "{output_text:?}");
}

#[test]
fn a_port_in_use_is_reported_with_a_way_out() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    refused(&["serve", text(small_drive().path()), "--port", &port], 3, "--port");
}

#[test]
fn a_simulated_traverse_is_rendered_described_and_tracked() {
    let home = tempfile::tempdir().unwrap();
    let (scenario, out) = (home.path().join("small.toml"), home.path().join("drive"));
    std::fs::write(&scenario, small_scenario().to_toml()).unwrap();
    let made = run(&["simulate", text(&scenario), "--out", text(&out), "--set", "drive.end_distance_m=5"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let info = run(&["info", text(&out)]);
    let info = String::from_utf8(info.stdout).unwrap();
    assert!(info.contains("all 6 there") && info.contains("simulated"), "{info}");
    let from_scenario = lines(&run(&["track", text(&scenario), "--target", &target()]));
    assert_eq!(from_scenario.len(), 6);
}

#[test]
fn several_targets_are_numbered_and_each_has_a_summary() {
    let drive = small_drive();
    let (csv, rrd) = (drive.path().join("table.csv"), drive.path().join("recording.rrd"));
    let folder = text(drive.path());
    let target = target();
    let output = run(&[
        "track",
        folder,
        "--target",
        &target,
        "--target",
        "100,160.5",
        "--from-step",
        "1",
        "--set",
        "ncc_min=0.6",
        "--csv",
        text(&csv),
        "--rrd",
        text(&rrd),
    ]);
    let lines = lines(&output);
    let summaries: Vec<_> = lines.iter().filter(|line| line.get("summary").is_some()).collect();
    assert_eq!((lines.len(), summaries.len()), (10, 2));
    assert_eq!(summaries[1]["target"], json!(1));
    assert_eq!(summaries[0]["summary"]["steps"], json!(4));
    for key in ["step", "state", "scale", "roll_deg", "ncc", "stereo_score", "err_px", "err_m", "sigma_m"] {
        assert!(lines[1].get(key).is_some(), "{key}");
    }
    assert_eq!(std::fs::read_to_string(csv).unwrap().lines().count(), 9);
    assert_eq!(&std::fs::read(rrd).unwrap()[..4], b"RRF2");
}

#[tokio::test(flavor = "multi_thread")]
async fn server_and_command_line_give_the_same_rows_to_the_last_digit() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    let run_view = server.ended(&session, 0, 0).await;
    let rest = server.get(&format!("sessions/{session}/exports/rows.jsonl?target=0&run=0")).await.text();
    let rest = rows_of_run(&rest);
    let output = run(&["track", text(drive.path()), "--target", &target()]);
    let cli = String::from_utf8(output.stdout).unwrap();
    let (rows, summary) = cli.trim_end().rsplit_once('\n').unwrap();
    assert_eq!(rows, rest.trim_end());
    assert_eq!(serde_json::from_str::<Value>(summary).unwrap(), json!({ "summary": run_view["summary"] }));
}

#[test]
fn serve_prints_one_line_and_survives_being_killed() {
    let (drive, home) = (small_drive(), tempfile::tempdir().unwrap());
    let start = || {
        let mut server = Command::new(program())
            .args(["serve", text(drive.path()), "--port", "0", "--data-dir", text(home.path())])
            .env("SIGHTLINE_TOKEN", TOKEN)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut output = std::io::BufReader::new(server.stdout.take().unwrap());
        std::io::BufRead::read_line(&mut output, &mut line).unwrap();
        let url =
            line.trim().strip_prefix("Sightline is ready: ").unwrap_or_else(|| panic!("{line}")).to_owned();
        (server, url)
    };
    let (mut server, url) = start();
    let address = url.trim_start_matches("http://").split_once('/').unwrap().0.to_owned();
    let traverses = http(&address, "GET", "traverses", "");
    let id = traverses.split('"').nth(3).unwrap().to_owned();
    let begun = http(&address, "POST", "sessions", &json!({ "traverse": id }).to_string());
    assert!(begun.contains("\"id\":\"s1\""), "{begun}");
    refused(&["serve", text(drive.path()), "--port", "0", "--data-dir", text(home.path())], 3, "--data-dir");
    server.kill().unwrap();
    server.wait().unwrap();
    let (mut server, url) = start();
    let address = url.trim_start_matches("http://").split_once('/').unwrap().0.to_owned();
    assert!(http(&address, "GET", "sessions", "").contains("\"s1\""));
    server.kill().unwrap();
    server.wait().unwrap();
}

/// Returns the body of the response to one request.
fn http(address: &str, method: &str, path: &str, body: &str) -> String {
    use std::io::{Read, Write};
    let mut stream = std::net::TcpStream::connect(address).unwrap();
    let length = body.len();
    let token = format!("Authorization: Bearer {TOKEN}");
    let head =
        format!("{method} /api/v1/{path} HTTP/1.1\r\nHost: {address}\r\n{token}\r\nConnection: close\r\n");
    let json = format!("Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}");
    stream.write_all((head + &json).as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer.split_once("\r\n\r\n").unwrap().1.to_owned()
}
