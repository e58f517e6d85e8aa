//! The goodness map of a drive by REST: the map on which the navigator decided, and the reason if there is none.

use serde_json::{Value, json};
use sightline_recordings::{Traverse, create_simulated};
use sightline_tests::rrd;
use sightline_tests::scenario::rock_on_the_way;
use sightline_tests::server::{TestServer, small_drive};
use sightline_world::choose_targets;

use crate::driving::{begin, waited, waits_at};

/// The cells that a decision rejects because of a step that is too high, x and y in the site frame, m. Unknown ground can be
/// rejected without a rock.
fn vetoes(cycle: &Value) -> Vec<[f64; 2]> {
    let at = |veto: &Value| [0, 1].map(|axis| veto["in_site_m"][axis].as_f64().unwrap());
    let all = cycle["choice"]["candidates"].as_array().into_iter().flatten();
    all.map(|one| &one["veto"]).filter(|veto| veto["term"] == "step").map(at).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_hazard_map_contains_the_rock_that_vetoed_paths() {
    let scenario = rock_on_the_way();
    let (drive, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let path = drive.path().join("drive");
    create_simulated(&scenario, &path).unwrap();
    let traverse = Traverse::open(&path).unwrap();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];

    let server = TestServer::open(&path, folder.path());
    let session = server.begin().await;
    let target = json!({ "step": 0, "pixel": { "x": pixel.x, "y": pixel.y } });
    server.post(&format!("sessions/{session}/targets"), &target).await.expect(201);
    let new = json!({ "command": { "navigator": "gestalt", "goal": "fixed" } });
    let begun = server.post(&format!("sessions/{session}/targets/0/runs/0/drive"), &new).await.expect(201);
    let session = begun["id"].as_str().unwrap();
    let is_vetoed =
        |drive: &Value| drive["cycles"].as_array().unwrap().iter().any(|one| !vetoes(one).is_empty());
    let driven = waited(&server, session, is_vetoed).await;
    let cycles = driven["cycles"].as_array().unwrap();
    let mut with_vetoes = cycles.iter().map(vetoes).enumerate();
    let (step, vetoed) = with_vetoes.rfind(|(_, vetoed)| !vetoed.is_empty()).unwrap();

    let map = server.get(&format!("sessions/{session}/drive/steps/{step}/hazards")).await.expect(200);
    let side = map["side"].as_u64().unwrap() as usize;
    for column in ["goodness_percent", "limited_by", "value", "basis"] {
        assert_eq!(map[column].as_array().unwrap().len(), side * side, "{column}");
    }
    assert_eq!(map["range_points"], cycles[step]["range_points"]);
    let number = |axis: usize, at_m: f64| {
        let corner_m = map["corner_m"][axis].as_f64().unwrap();
        ((at_m - corner_m) / map["cell_m"].as_f64().unwrap()).floor() as usize
    };
    for [north, east] in vetoed {
        let index = number(0, north) * side + number(1, east);
        let goodness = map["goodness_percent"][index].as_i64().unwrap();
        assert!((0..16).contains(&goodness), "a failing cell at {north} {east} has the goodness {goodness}");
        assert_eq!(map["limited_by"][index], "step");
    }
    let file = folder.path().join("drive.rrd");
    let exported = server.get(&format!("sessions/{session}/exports/recording.rrd")).await;
    std::fs::write(&file, exported.bytes).unwrap();
    let recording = rrd::read(&file);
    let rows = |part: &str| &recording.entities[&format!("/drive/{part}")];
    for (part, archetype) in [
        ("set_goal/goal", "Points3D"),
        ("map_hazards/ground", "Mesh3D"),
        ("select_path/paths", "LineStrips3D"),
        ("select_path/way", "LineStrips3D"),
        ("decision", "TextLog"),
    ] {
        assert!(rows(part).archetypes.contains(archetype), "{part}: {:?}", rows(part).archetypes);
        assert!(rows(part).data.contains(&(step as i64)), "{part}: {:?}", rows(part).data);
    }
    let corners = &rows("map_hazards/ground").numbers[&("Mesh3D:vertex_positions".to_owned(), step as i64)];
    let known = map["basis"].as_array().unwrap().iter().filter(|basis| **basis != "unknown").count();
    // Cells that are assumed to be good have no height if nothing was measured there.
    assert!(corners.len() > 12 * known / 2 && corners.len() <= 12 * known, "{} {known}", corners.len());
    let later = server.get(&format!("sessions/{session}/drive/steps/99/hazards")).await;
    assert!(later.problem(404, "not_found").contains("has not come to step 99"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_drive_without_a_map_explains_how_to_get_one() {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = begin(&server, &json!({ "command": { "standoff_m": 3.0 }, "pause_at": 0 })).await;
    waited(&server, &session, waits_at(0)).await;
    let refused = server.get(&format!("sessions/{session}/drive/steps/0/hazards")).await;
    assert!(refused.problem(409, "conflict").contains("`arcs` uses no hazard map"));
    let refused = server.get("sessions/s1/drive/steps/0/hazards").await;
    assert!(refused.problem(409, "conflict").contains("not on commands"));
}
