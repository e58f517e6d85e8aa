//! Several cameras per stop over REST and in recordings: listed, shown by name, used for designation, and refused with an
//! error.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};
use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::Pixel;
use sightline_recordings::{Existing, IndexFormat, Traverse, create_simulated, write};
use sightline_server::rerun_log::{RunLog, export};
use sightline_session::track;
use sightline_tests::rrd;
use sightline_tests::server::{PIXEL, TestServer, small_drive, small_scenario};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::scenario::{CameraRig, FurtherRig};
use sightline_world::target_truth::TruthSource;

fn name(text: &str) -> CameraName {
    text.parse().unwrap()
}

/// The small drive with pancams, which stop 2 lacks, and hazcams, of which stop 1 has only the left one; nothing is
/// rendered.
fn drive(folder: &Path) -> Traverse {
    let mut scenario = small_scenario();
    let further =
        |text: &str, rig, image_size| FurtherRig { name: name(text), rig, look_deg: None, image_size };
    scenario.camera.further = vec![
        further("front_hazcam", CameraRig::MerFrontHazcam, 128),
        further("pancam", CameraRig::MerPancam, 512),
    ];
    let whole = create_simulated(&scenario, folder).unwrap();
    let mut index = whole.index().clone();
    index.stops[1].cameras[0].right = None;
    index.stops[2].cameras.remove(1);
    write(&index, folder, IndexFormat::Toml, Existing::Replace).unwrap();
    Traverse::open(folder).unwrap()
}

/// The pixel of the pancams' first left image that shows the target at [`PIXEL`].
fn pixel_in_pancam(traverse: &Traverse) -> Pixel {
    let point = traverse.surface_point_in_site(0, None, Pixel::new(PIXEL[0], PIXEL[1])).unwrap();
    let in_rover = traverse.true_site_from_rover(0).unwrap().inverse_transform_point(&point);
    TruthSource::true_left_camera(traverse, 0, Some(name("pancam"))).unwrap().project(&in_rover).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn cameras_are_listed_and_their_images_are_served_by_name() {
    let (folder, sessions) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    drive(folder.path());
    let server = TestServer::open(folder.path(), sessions.path());
    let view = server.get(&format!("traverses/{}", server.traverse)).await.expect(200);
    let names = |stop: usize| -> Vec<&str> {
        let cameras = view["stops"][stop]["cameras"].as_array().unwrap();
        cameras.iter().map(|camera| camera["name"].as_str().unwrap()).collect()
    };
    assert_eq!((names(0), names(2)), (vec!["front_hazcam", "pancam"], vec!["front_hazcam"]));
    let [hazcam, pancam] = [0, 1].map(|k| &view["stops"][1]["cameras"][k]);
    assert_eq!((&hazcam["right_size"], &hazcam["mast"]), (&Value::Null, &Value::Null));
    assert_eq!(pancam["right_size"], json!([512, 512]));
    assert!(pancam["mast"]["azimuth_rad"].is_number());
    let path = format!("traverses/{}/steps", server.traverse);
    let detail = server.get(&format!("{path}/1")).await.expect(200);
    assert_eq!(
        (&detail["cameras"][0]["right"], &detail["cameras"][1]["name"]),
        (&Value::Null, &json!("pancam"))
    );

    let images = |rest: &str| format!("{path}/{rest}");
    let left = server.get(&images("1/images/left.png?camera=pancam")).await;
    let size = |bytes: &[u8]| image::load_from_memory(bytes).unwrap().width();
    assert_eq!((left.status.as_u16(), size(&left.bytes)), (200, 512));
    let right = server.get(&images("1/images/right.png?camera=pancam&bits=16")).await;
    assert_eq!(size(&right.bytes), 512);
    assert_eq!(size(&server.get(&images("1/images/left.png?camera=front_hazcam")).await.bytes), 128);
    assert_eq!(size(&server.get(&images("1/images/left.png")).await.bytes), 256);
    let refused = async |rest: &str| server.get(&images(rest)).await.problem(404, "not_found");
    assert_eq!(refused("2/images/left.png?camera=pancam").await, "Step 2 has no camera `pancam`.");
    assert_eq!(
        refused("1/images/right.png?camera=front_hazcam").await,
        "The camera `front_hazcam` of step 1 is a single one: it has left.png only."
    );
    let wrong = server.get(&images("1/images/left.png?camera=../x")).await.problem(422, "query");
    assert!(wrong.contains("is no name of a camera"), "{wrong}");

    // A drive with only its main pair has no new fields.
    let (plain, sessions) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(plain.path(), sessions.path());
    let view = server.get(&format!("traverses/{}", server.traverse)).await.expect(200);
    assert_eq!(view["stops"][0].get("cameras"), None);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_target_keeps_the_pair_in_which_it_was_designated() {
    let (folder, sessions) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let traverse = drive(folder.path());
    let Pixel { x, y } = pixel_in_pancam(&traverse);
    let server = TestServer::open(folder.path(), sessions.path());
    let session = server.begin().await;
    let targets = format!("sessions/{session}/targets");
    let new =
        |step: usize, camera: &str| json!({ "step": step, "camera": camera, "pixel": { "x": x, "y": y } });
    let refused = async |step, camera| server.post(&targets, &new(step, camera)).await.problem(422, "target");
    assert_eq!(refused(0, "chemcam").await, "target: stop 0 has no pair `chemcam`");
    assert_eq!(refused(2, "pancam").await, "target: stop 2 has no pair `pancam`");
    assert_eq!(refused(1, "front_hazcam").await, "target: stop 1 has only a single image of `front_hazcam`");
    let nonsense = server.post(&targets, &new(0, "Pan cam")).await;
    assert_eq!(nonsense.status.as_u16(), 422, "{}", nonsense.text());

    server.post(&targets, &new(0, "pancam")).await.expect(201);
    let run = server.ended(&session, 0, 0).await;
    assert_eq!(run["complete"], json!(true), "{run}");
    let reason = run["rows"][2]["reason"].as_str().unwrap();
    assert_eq!(reason, "stop 2 has no pair `pancam`, which the target was designated in");
    for (step, row) in run["rows"].as_array().unwrap().iter().enumerate() {
        assert_eq!(row["state"], "tracking", "stop {step}: {row}");
    }
    assert!(!server.state.traverses()[0].traverse.is_rendered(3, Some(name("front_hazcam"))));
    // The session file contains the name, and a restarted server computes the same.
    drop(server);
    let server = TestServer::open(folder.path(), sessions.path());
    let view = server.get(&format!("sessions/{session}")).await.expect(200);
    assert_eq!(view["targets"][0]["designation"]["camera"], "pancam");
    let again = server.ended(&session, 0, 0).await;
    assert_eq!(again["rows"], run["rows"]);
    // The plain page shows the images of that pair.
    let page = server.get(&format!("sessions/{session}/targets/0/runs/0/steps/1/page")).await;
    assert!(page.text().contains("images/left.png?camera=pancam"), "{}", page.text());
}

#[test]
fn a_recording_has_the_images_and_pyramids_of_further_cameras() {
    let folder = tempfile::tempdir().unwrap();
    let traverse = drive(folder.path());
    let designation =
        Designation { step: 0, pixel: pixel_in_pancam(&traverse), camera: Some(name("pancam")) };
    let steps = track::run(&traverse, designation, &Settings::default()).unwrap();
    // The hazcam image of one stop was requested: it exists and is not rendered again.
    traverse.capture_one(3, Some(name("front_hazcam")), true).unwrap();
    let steps: Vec<_> = steps.into_iter().map(Arc::new).collect();
    let last = steps.len() as i64 - 1;
    let run = RunLog { target: 0, run: 0, label: "rock", steps: &steps };
    let path = folder.path().join("cameras.rrd");
    export(&path, "cameras", &traverse, (&[run], None), &mut |_, _| ControlFlow::Continue(())).unwrap();
    let recording = rrd::read(&path);
    let data = |entity: &str| {
        let mut steps = recording.entities.get(entity).map_or_else(Vec::new, |rows| rows.data.clone());
        steps.sort_unstable();
        steps
    };
    let all: Vec<i64> = (0..=last).collect();
    let but = |missing: i64| all.iter().copied().filter(|step| *step != missing).collect::<Vec<_>>();
    assert_eq!(data("/rover/pose/pancam/left"), but(2));
    assert_eq!(data("/rover/pose/front_hazcam/left"), all);
    assert_eq!(data("/rover/pose/front_hazcam/right"), but(1));
    for eye in ["left", "right"] {
        assert_eq!(data(&format!("/capture/pancam/{eye}")), but(2));
        assert_eq!(data(&format!("/capture/front_hazcam/{eye}")), [3]);
        assert_eq!(recording.entities[&format!("/capture/pancam/{eye}")].cleared, [2]);
    }
    assert!(data("/capture/left").is_empty(), "nothing is tracked in the main pair");
}
