//! A number that a stage declares is in every view of the record, although none of them names it. (The views of the page are
//! tested in `viewer/src/tests/records.rs`.)

use std::io::Write;

use axum::body::Body;
use axum::http::Method;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::RowAccessor;
use serde_json::{Value, json};
use sightline_record::Unit;
use sightline_session::records::{self, StageQuantity};
use sightline_tests::rrd;
use sightline_tests::server::{TestServer, request, small_drive};

/// The number: declared in the `impl Record` of its stage, and not a field of the evidence.
const NAME: &str = "match_template.match_sigma_px";
const STEP: usize = 2;

#[tokio::test(flavor = "multi_thread")]
async fn one_declaration_puts_a_number_into_every_view() {
    let declared = StageQuantity::named(NAME).expect("a declared quantity").declared();
    assert_eq!((declared.unit, declared.label.as_ref()), (Unit::Pixel, "match sigma"));
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let server = TestServer::open(drive.path(), folder.path());
    let session = server.begin().await;
    server.pick(&session).await;
    server.ended(&session, 0, 0).await;
    let exported = |name: &str| {
        let path = format!("sessions/{session}/exports/{name}?target=0&run=0");
        let server = &server;
        async move {
            let answer = server.get(&path).await;
            assert_eq!(answer.status.as_u16(), 200, "{path}: {}", answer.text());
            answer
        }
    };

    // Tables: JSON Lines, CSV and Parquet.
    let jsonl = exported("rows.jsonl").await.text();
    let row: Value = serde_json::from_str(jsonl.lines().nth(STEP).unwrap()).unwrap();
    let value = row[NAME].as_f64().expect("the step has the number");
    let csv = exported("rows.csv").await.text();
    let header =
        csv.lines().next().unwrap().split(',').position(|cell| cell == "match_template_match_sigma_px");
    let column = records::columns().iter().find(|column| column.name == NAME).unwrap();
    assert_eq!(column.header, "match_template_match_sigma_px");
    let parquet = SerializedFileReader::new(stored(&exported("rows.parquet").await.bytes)).unwrap();
    let read = parquet.get_row_iter(None).unwrap().nth(STEP).unwrap().unwrap();
    assert_eq!(read.get_double(header.expect("a column of the CSV")).ok(), Some(value));

    // Comparison.
    server
        .post(&format!("sessions/{session}/targets/0/runs"), &json!({ "run": 0, "from_step": 1 }))
        .await
        .expect(202);
    server.ended(&session, 0, 1).await;
    let runs = json!([{ "target": 0, "run": 0 }, { "target": 0, "run": 1 }]);
    let asked = json!({ "runs": runs, "columns": [NAME] });
    let compared = server.post(&format!("sessions/{session}/compare"), &asked).await.expect(200);
    let column = &compared["columns"][0];
    assert_eq!((&column["name"], &column["unit"]), (&json!(NAME), &json!("px")));
    assert_eq!(column["values"][0][STEP].as_f64(), Some(value));

    // Expressions, and through them breakpoints and derived plots.
    let asked = json!({ "expression": NAME, "values": true, "target": 0 });
    let answer = server.post(&format!("sessions/{session}/query"), &asked).await.expect(200);
    assert_eq!(answer["unit"], json!("px"));
    assert_eq!(answer["runs"][0]["values"][STEP].as_f64(), Some(value));

    // Why.
    let why = format!("sessions/{session}/targets/0/runs/0/steps/{STEP}/why?value={NAME}");
    let tree = server.get(&why).await.expect(200)["tree"].clone();
    assert_eq!((tree["numbers"][0].as_f64(), &tree["unit"]), (Some(value), &json!("px")));
    assert!(!tree["inputs"].as_array().unwrap().is_empty(), "its formula has inputs: {tree}");

    // The plain page and the report.
    let page = format!("sessions/{session}/targets/0/runs/0/steps/{STEP}/page");
    let page = server.send(request(Method::GET, &page).body(Body::empty()).unwrap()).await.text();
    assert!(page.contains("match sigma px"), "{page}");
    let report = exported("report.html").await.text();
    let meaning = declared.description.split('\'').next().unwrap_or_default();
    assert!(report.contains(NAME) && report.contains(meaning), "{meaning}");

    // The recording for Rerun.
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(&exported("recording.rrd").await.bytes).unwrap();
    let recording = rrd::read(file.path());
    let entity = &recording.entities["/target_1/record/match_template/match_sigma_px"];
    assert_eq!(entity.numbers[&("Scalars:scalars".to_owned(), STEP as i64)], [value]);
}

fn stored(bytes: &[u8]) -> std::fs::File {
    let mut file = tempfile::tempfile().unwrap();
    file.write_all(bytes).unwrap();
    file
}
