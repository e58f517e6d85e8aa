//! Recordings on the server's machine: listed, examined, imported and opened again, and refused with one sentence if they
//! are damaged or outside the named folders.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use axum::http::Method;
use serde_json::{Value, json};
use sightline_recordings::Traverse;
use sightline_server::app;
use sightline_server::limits::Limits;
use sightline_server::state::AppState;
use sightline_tests::data;
use sightline_tests::server::{PORT, TestServer, access, copy_folder, small_drive, small_recording};
use sightline_vision::image::{GrayImage, io};
use tempfile::TempDir;

/// Maximum time of an import.
const PATIENCE: Duration = Duration::from_secs(120);

/// A server whose pages may open the recordings below `root`.
fn server(drive: &Path, sessions: &Path, root: &[PathBuf]) -> TestServer {
    let traverse = Traverse::open(drive).unwrap();
    let state =
        AppState::with_recordings(vec![traverse], sessions, access(PORT), Limits::default(), root).unwrap();
    let traverse = state.traverses()[0].id.clone();
    TestServer { app: app(state.clone()), state, traverse }
}

/// A folder with a KITTI recording `drive` of `frames` frames of 12 × 8 px.
pub(crate) fn kitti(frames: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let drive = folder.path().join("drive");
    let matrix = |shift: f64| format!("40 0 5.5 {shift} 0 40 3.5 0 0 0 1 0");
    for side in ["image_0", "image_1"] {
        std::fs::create_dir_all(drive.join(side)).unwrap();
        for frame in 0..frames {
            let image = GrayImage::from_fn(12, 8, |x, _| [0.1 + 0.01 * x as f32].into());
            io::write_png_u8(drive.join(format!("{side}/{frame:06}.png")), &image).unwrap();
        }
    }
    std::fs::write(drive.join("calib.txt"), format!("P0: {}\nP1: {}\n", matrix(0.0), matrix(-20.0))).unwrap();
    let pose = |frame: usize| format!("1 0 0 0 0 1 0 0 0 0 1 {frame}\n");
    std::fs::write(drive.join("poses.txt"), (0..frames).map(pose).collect::<String>()).unwrap();
    folder
}

fn query(path: &Path) -> String {
    let path = path.to_str().unwrap();
    format!("recordings/contents?path={}", sightline_api::endpoint::escaped(path))
}

/// Imports the recording at `path`, and returns the final state of the import.
async fn import(server: &TestServer, path: &Path) -> Value {
    let job = server.post("imports", &json!({ "path": path.to_str().unwrap() })).await.expect(202);
    ended(server, job["id"].as_str().unwrap()).await
}

pub(crate) async fn ended(server: &TestServer, id: &str) -> Value {
    let begun = Instant::now();
    loop {
        let job = server.get(&format!("imports/{id}")).await.expect(200);
        if job["state"] != "waiting" && job["state"] != "running" {
            return job;
        }
        assert!(begun.elapsed() < PATIENCE, "the import does not end: {job}");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

/// The number of entries in the folder of imports.
fn file_count(sessions: &Path) -> usize {
    std::fs::read_dir(sessions.join("imported")).unwrap().count()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_kitti_folder_is_imported_and_open_after_a_restart() {
    let (given, sessions, root) = (small_drive(), tempfile::tempdir().unwrap(), kitti(5));
    let roots = [root.path().to_owned()];
    let server = self::server(given.path(), sessions.path(), &roots);
    let list = server.get("recordings").await.expect(200);
    let path = root.path().canonicalize().unwrap().join("drive");
    assert_eq!(list["recordings"], json!([{ "path": path, "format": "KITTI odometry" }]));
    assert_eq!((&list["folders"][0], &list["is_complete"]), (&json!(path.parent()), &json!(true)));

    let view = server.get("recordings/contents?path=drive").await.expect(200);
    assert_eq!(
        (&view["name"], &view["stop_count"], &view["image_count"]),
        (&json!("drive"), &json!(5), &json!(10))
    );
    assert_eq!((&view["left_size"], &view["right_size"]), (&json!([12, 8]), &json!([12, 8])));
    assert_eq!((&view["stereo"], &view["has_truth"]), (&json!("lateral"), &json!(true)));
    let steps: Vec<_> = view["pairs"].as_array().unwrap().iter().map(|pair| pair["step"].as_u64()).collect();
    assert_eq!(steps, [Some(0), Some(1), Some(2), Some(4)]);
    let last = json!({ "step": 4, "left": "image_0/000004.png", "right": "image_1/000004.png" });
    assert_eq!(view["pairs"][3], last);
    assert_eq!(file_count(sessions.path()), 0, "nothing is imported yet");

    let job = import(&server, &path).await;
    assert_eq!((&job["state"], &job["k"], &job["n"]), (&json!("done"), &json!(10), &json!(10)), "{job}");
    let id = job["traverse"].as_str().unwrap().to_owned();
    let left = server.get(&format!("traverses/{id}/steps/4/images/left.png")).await;
    assert_eq!(&left.bytes[1..4], b"PNG");
    let again = import(&server, &path).await;
    assert_eq!(
        (&again["traverse"], file_count(sessions.path())),
        (&job["traverse"], 1),
        "the same recording is one drive"
    );
    let session = server.post("sessions", &json!({ "traverse": id })).await.expect(201);
    drop(server);

    let server = self::server(given.path(), sessions.path(), &[]);
    let name = session["id"].as_str().unwrap();
    assert_eq!(server.get(&format!("sessions/{name}")).await.expect(200)["traverse"], json!(id));
    server.json(Method::DELETE, &format!("sessions/{name}"), &json!({})).await;
    let removed = server.json(Method::DELETE, &format!("traverses/{id}"), &json!({})).await;
    assert_eq!((removed.status.as_u16(), file_count(sessions.path())), (204, 0), "{}", removed.text());
    assert!(path.join("calib.txt").is_file(), "the recording itself stays");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_native_drive_opens_in_place_while_its_folder_is_named() {
    let (given, sessions, root) = (small_drive(), tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let path = root.path().canonicalize().unwrap().join("mine");
    copy_folder(small_recording().path(), &path);
    let roots = [root.path().to_owned()];
    let server = self::server(given.path(), sessions.path(), &roots);
    let view = server.get(&query(&path)).await.expect(200);
    assert_eq!((&view["format"], &view["stop_count"]), (&json!("Sightline drive"), &json!(5)));
    assert_eq!((&view["left_size"], &view["is_opened_in_place"]), (&json!([256, 256]), &json!(true)));
    let id = import(&server, &path).await["traverse"].as_str().unwrap().to_owned();
    let source = server.get(&format!("traverses/{id}")).await.expect(200)["source"].clone();
    assert_eq!(source, json!(path), "nothing was copied");
    drop(server);

    let named = self::server(given.path(), sessions.path(), &roots);
    named.get(&format!("traverses/{id}")).await.expect(200);
    drop(named);
    let unnamed = self::server(given.path(), sessions.path(), &[]);
    unnamed.get(&format!("traverses/{id}")).await.problem(404, "not_found");
    let notices = unnamed.get("health").await.expect(200)["notices"].to_string();
    assert!(notices.contains("sightline serve --recordings FOLDER"), "{notices}");
    drop(unnamed);
    let named = self::server(given.path(), sessions.path(), &roots);
    let removed = named.json(Method::DELETE, &format!("traverses/{id}"), &json!({})).await;
    assert_eq!((removed.status.as_u16(), file_count(sessions.path())), (204, 0));
    assert!(path.join("traverse.toml").is_file(), "the drive itself stays");
}

#[tokio::test(flavor = "multi_thread")]
async fn recorded_excerpts_are_recognised_with_their_stereo_pairs() {
    for (set, format, stops, size, stereo, left, right) in [
        (
            "kitti-seq1-frames-0-19",
            "KITTI odometry",
            20,
            [1226, 370],
            "lateral",
            "image_0/000000.png",
            "image_1/000000.png",
        ),
        ("mer1-navcam-sol4087-pair", "PDS3", 1, [1024, 1024], "convergent", "1N491020376", "1N491020519"),
    ] {
        let Some(source) = data::set(set, "its contents and import over REST") else { continue };
        let (given, sessions) = (small_drive(), tempfile::tempdir().unwrap());
        let server = self::server(given.path(), sessions.path(), &[source.parent().unwrap().to_owned()]);
        let view = server.get(&query(&source)).await.expect(200);
        assert_eq!((&view["format"], &view["stop_count"]), (&json!(format), &json!(stops)), "{view}");
        assert_eq!((&view["left_size"], &view["stereo"]), (&json!(size), &json!(stereo)), "{view}");
        let pair = &view["pairs"][0];
        assert!(pair["left"].as_str().unwrap().starts_with(left), "{pair}");
        assert!(pair["right"].as_str().unwrap().starts_with(right), "{pair}");
        let job = import(&server, &source).await;
        assert_eq!((&job["state"], &job["n"]), (&json!("done"), &view["image_count"]), "{job}");
        let id = job["traverse"].as_str().unwrap();
        let stops = server.get(&format!("traverses/{id}")).await.expect(200)["stops"].clone();
        assert_eq!(
            (&json!(stops.as_array().unwrap().len()), &stops[0]["left_size"]),
            (&view["stop_count"], &json!(size))
        );
    }
}

/// Damages a recording.
type Damage = fn(&Path);

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_recording_is_rejected_without_leftovers() {
    let cases: [(Damage, &str); 6] = [
        (|drive| std::fs::remove_file(drive.join("image_1/000002.png")).unwrap(), "image_1/000002.png"),
        (|drive| std::fs::write(drive.join("calib.txt"), "P0: 1 2 3\n").unwrap(), "calib.txt"),
        (|drive| std::fs::write(drive.join("poses.txt"), "1 0 0\n").unwrap(), "line 1"),
        (|drive| std::fs::write(drive.join("image_0/000000.png"), "x").unwrap(), "image_0/000000.png"),
        (|drive| std::fs::remove_file(drive.join("calib.txt")).unwrap(), "known are KITTI odometry"),
        (
            |drive| {
                std::fs::remove_dir_all(drive).unwrap();
                std::fs::create_dir(drive).unwrap();
            },
            "is empty; choose the folder of a recording",
        ),
    ];
    let given = small_drive();
    for (damage, named) in cases {
        let (sessions, root) = (tempfile::tempdir().unwrap(), kitti(3));
        damage(&root.path().join("drive"));
        let server = self::server(given.path(), sessions.path(), &[root.path().to_owned()]);
        let sentence = server.get("recordings/contents?path=drive").await.problem(422, "file");
        assert!(sentence.contains(named) && !sentence.contains('\n'), "{sentence}");
        let job = import(&server, Path::new("drive")).await;
        assert_eq!((&job["state"], &job["traverse"]), (&json!("failed"), &json!(null)));
        assert!(job["problem"].as_str().unwrap().contains(named), "{job}");
        assert_eq!((file_count(sessions.path()), server.state.traverses().len()), (0, 1));
    }
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn nothing_outside_of_the_named_folders_is_opened() {
    use std::os::unix::fs::symlink;
    let (given, sessions, root, outside) = (small_drive(), tempfile::tempdir().unwrap(), kitti(2), kitti(2));
    let away = outside.path().join("drive");
    symlink(&away, root.path().join("linked")).unwrap();
    let drive = root.path().join("drive");
    std::fs::remove_file(drive.join("image_1/000001.png")).unwrap();
    symlink(away.join("image_1/000001.png"), drive.join("image_1/000001.png")).unwrap();
    let server = self::server(given.path(), sessions.path(), &[root.path().to_owned()]);

    let up = format!("../{}/drive", outside.path().file_name().unwrap().to_str().unwrap());
    for path in [away.to_str().unwrap(), "/etc", "..", &up, "linked", "missing", " ", "drive\0"] {
        let contents = server.get(&query(Path::new(path))).await.problem(422, "path");
        let import = server.post("imports", &json!({ "path": path })).await.problem(422, "path");
        assert_eq!(contents, import);
        assert!(import.starts_with("path: ") && !import.contains('\n'), "{import}");
    }
    let listed = server.get("recordings").await.expect(200)["recordings"].clone();
    assert_eq!(listed.as_array().map(Vec::len), Some(1), "no link is followed: {listed}");
    let sentence = server.get("recordings/contents?path=drive").await.problem(422, "file");
    assert!(sentence.contains("image_1/000001.png") && sentence.contains("leads out"), "{sentence}");
    let job = import(&server, &drive).await;
    assert!(job["problem"].as_str().unwrap().contains("leads out"), "{job}");

    let elsewhere = tempfile::tempdir().unwrap();
    let none = self::server(given.path(), elsewhere.path(), &[]);
    let answer = none.get(&query(&drive)).await;
    assert!(answer.json()["hint"].as_str().unwrap().contains("sightline serve --recordings FOLDER"));
    answer.problem(422, "path");
    assert_eq!(none.get("recordings").await.expect(200)["folders"], json!([]));
    none.get("imports/import-9").await.problem(404, "not_found");
    none.post("imports/import-9/cancel", &json!({})).await.problem(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancelled_import_leaves_nothing_behind() {
    let (given, sessions, root) = (small_drive(), tempfile::tempdir().unwrap(), kitti(1500));
    let server = self::server(given.path(), sessions.path(), &[root.path().to_owned()]);
    let job = server.post("imports", &json!({ "path": "drive" })).await.expect(202);
    let id = job["id"].as_str().unwrap();
    let begun = Instant::now();
    while server.get(&format!("imports/{id}")).await.expect(200)["k"].as_u64() < Some(1) {
        assert!(begun.elapsed() < PATIENCE, "no image is imported");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    server.post(&format!("imports/{id}/cancel"), &json!({})).await.expect(200);
    let job = ended(&server, id).await;
    assert_eq!((&job["state"], &job["problem"]), (&json!("cancelled"), &json!(null)), "{job}");
    assert_eq!((file_count(sessions.path()), server.state.traverses().len()), (0, 1));
}
