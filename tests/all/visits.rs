//! Drives to several targets by REST: the visits equal those of the command line and survive a restart; an injected fault.

use std::path::Path;
use std::process::Command;

use serde_json::{Value, json};
use sightline_geometry::frames::Pixel;
use sightline_recordings::{Traverse, create_simulated};
use sightline_tests::scenario::several_targets;
use sightline_tests::server::TestServer;
use sightline_world::choose_targets;

use crate::cli::program;
use crate::driving::{has_ended, waited};

fn visits_by_command_line(drive: &Path, targets: &[Pixel]) -> Value {
    let mut program = Command::new(program());
    program.arg("drive").arg(drive.join("scenario.toml")).args(["--tolerance", "0.02"]);
    for target in targets {
        program.args(["--target", &format!("{},{}", target.x, target.y)]);
    }
    let output = program.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    last["visits"].clone()
}

#[tokio::test(flavor = "multi_thread")]
async fn rest_visits_targets_in_turn_like_the_command_line() {
    let (drive, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let path = drive.path().join("drive");
    create_simulated(&several_targets(), &path).unwrap();
    let traverse = Traverse::open(&path).unwrap();
    let all = choose_targets(traverse.world().unwrap(), &several_targets(), traverse.index());
    let targets = [all[0], all[2]];
    let expected = visits_by_command_line(&path, &targets);

    let server = TestServer::open(&path, folder.path());
    let session = server.begin().await;
    for pixel in &targets {
        let target = json!({ "step": 0, "pixel": { "x": pixel.x, "y": pixel.y } });
        server.post(&format!("sessions/{session}/targets"), &target).await.expect(201);
    }
    let begin = format!("sessions/{session}/targets/0/runs/0/drive");
    let wrong = json!({ "then": [0] });
    let problem = server.post(&begin, &wrong).await.expect(422);
    assert!(problem["detail"].as_str().unwrap().contains("then[0]"), "{problem}");
    let new = json!({ "command": { "tolerance_m": 0.02 }, "then": [1] });
    let begun = server.post(&begin, &new).await.expect(201);
    let session = begun["id"].as_str().unwrap().to_owned();
    let is_over = |count: usize| {
        move |drive: &Value| {
            has_ended(drive) && drive["visits"].as_array().is_some_and(|visits| visits.len() == count)
        }
    };
    let driven = waited(&server, &session, is_over(2)).await;
    assert_eq!(driven["visits"], expected, "the same as by the command line");
    assert_eq!(driven["steering"]["target"], 1);

    // A branch in which the first target is hidden at the next stops: it is dropped, and the rover drives to the second.
    let from = 4;
    let fault = json!({ "kind": "occluder", "from_stop": from + 1, "to_stop": from + 4, "target": 0 });
    let begin = format!("sessions/{session}/targets/0/runs/0/drive");
    let command = json!({ "tolerance_m": 0.02 });
    let late = json!({ "command": command, "from_step": from, "faults": [{ "kind": "shadow", "from_stop": 2, "to_stop": 9 }] });
    let problem = server.post(&begin, &late).await.expect(422);
    assert!(problem["detail"].as_str().unwrap().contains("come to stop 4 already"), "{problem}");
    let new = json!({ "command": command, "then": [1], "from_step": from, "faults": [fault] });
    let branch = server.post(&begin, &new).await.expect(201)["id"].as_str().unwrap().to_owned();
    let branched = waited(&server, &branch, is_over(2)).await;
    println!("{}", branched["visits"]);
    assert_eq!(branched["visits"][0]["reason"], "lost");
    assert_eq!(branched["visits"][1]["since"], branched["visits"][0]["until"]);
    assert_eq!(branched["faults"][0]["kind"], "occluder");
    assert_eq!(driven["cycles"][0], branched["cycles"][0], "the stops before are shared");

    // In a branch from a stop before the visit, the approach to the second target counts from its designation.
    let begin = format!("sessions/{session}/targets/1/runs/0/drive");
    let early = json!({ "command": { "tolerance_m": 0.02, "stops_max": 4 }, "from_step": 2 });
    let early = server.post(&begin, &early).await.expect(201)["id"].as_str().unwrap().to_owned();
    let ended = waited(&server, &early, has_ended).await;
    assert_eq!(ended["steering"]["command"]["since"], Value::Null, "{}", ended["steering"]);

    drop(server);
    let again = TestServer::open(&path, folder.path());
    for (session, before) in [(&session, &driven), (&branch, &branched)] {
        let after = waited(&again, session, is_over(2)).await;
        for field in ["visits", "steering", "faults", "cycles"] {
            assert_eq!(after[field], before[field], "{field} of {session}");
        }
    }
}
