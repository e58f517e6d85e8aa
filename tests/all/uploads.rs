//! Recordings that a page sends: a folder file by file, or a zip archive; refused if names leave the folder or a limit is
//! exceeded.

use std::io::{Cursor, Write};
use std::path::Path;

use axum::body::Body;
use axum::http::{Method, header};
use serde_json::{Value, json};
use sightline_api::endpoint::escaped;
use sightline_recordings::Traverse;
use sightline_server::app;
use sightline_server::limits::Limits;
use sightline_server::state::AppState;
use sightline_tests::data;
use sightline_tests::server::{Answer, PORT, TestServer, access, request, small_drive, small_recording};
use tempfile::TempDir;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::recordings::{ended, kitti};

/// A server with these limits, and its folder.
fn server(moved: &[&str]) -> (TestServer, TempDir) {
    let (drive, folder) = (small_drive(), tempfile::tempdir().unwrap());
    let mut limits = Limits::default();
    moved.iter().for_each(|text| limits.set(text).unwrap());
    let traverse = Traverse::open(drive.path()).unwrap();
    let state = AppState::with_limits(vec![traverse], folder.path(), access(PORT), limits).unwrap();
    let traverse = state.traverses()[0].id.clone();
    (TestServer { app: app(state.clone()), state, traverse }, folder)
}

async fn begin(server: &TestServer) -> Value {
    server.post("uploads", &json!({})).await.expect(201)
}

async fn put(server: &TestServer, path: &str, bytes: Vec<u8>) -> Answer {
    let request = request(Method::PUT, path).header(header::CONTENT_TYPE, "application/octet-stream");
    server.send(request.body(Body::from(bytes)).unwrap()).await
}

async fn send_file(server: &TestServer, upload: &Value, name: &str, bytes: Vec<u8>) -> Answer {
    let id = upload["id"].as_str().unwrap();
    put(server, &format!("uploads/{id}/files?path={}", escaped(name)), bytes).await
}

async fn send_archive(server: &TestServer, upload: &Value, bytes: Vec<u8>) -> Answer {
    put(server, &format!("uploads/{}/archive", upload["id"].as_str().unwrap()), bytes).await
}

async fn contents(server: &TestServer, upload: &Value) -> Answer {
    let path = upload["path"].as_str().unwrap();
    server.get(&format!("recordings/contents?path={}", escaped(path))).await
}

/// Imports the contents of an upload; returns the view of its drive.
async fn import(server: &TestServer, upload: &Value) -> Value {
    let view = contents(server, upload).await.expect(200);
    let job = server.post("imports", &json!({ "path": view["path"] })).await.expect(202);
    let job = ended(server, job["id"].as_str().unwrap()).await;
    assert_eq!(job["state"], json!("done"), "{job}");
    server.get(&format!("traverses/{}", job["traverse"].as_str().unwrap())).await.expect(200)
}

/// The files below a folder, with their relative paths.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut waiting = vec![folder.to_owned()];
    let mut found = Vec::new();
    while let Some(next) = waiting.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_str().unwrap().to_owned();
                found.push((name, std::fs::read(path).unwrap()));
            }
        }
    }
    found
}

fn archive(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive.start_file(name.as_str(), SimpleFileOptions::default()).unwrap();
        archive.write_all(bytes).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// The number of entries in the folder of uploads.
fn file_count(folder: &TempDir) -> usize {
    std::fs::read_dir(folder.path().join("uploads")).unwrap().count()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_is_sent_file_by_file_examined_and_imported() {
    let ((server, folder), recording) = (server(&[]), kitti(3));
    let upload = begin(&server).await;
    let all = files(recording.path());
    for (name, bytes) in &all {
        send_file(&server, &upload, name, bytes.clone()).await.expect(200);
    }
    let view = contents(&server, &upload).await.expect(200);
    assert_eq!((&view["format"], &view["stop_count"]), (&json!("KITTI odometry"), &json!(3)));
    assert_eq!(view["pairs"][0]["right"], json!("image_1/000000.png"));
    let traverse = import(&server, &upload).await;
    assert_eq!(
        (&traverse["name"], file_count(&folder)),
        (&json!("drive"), 0),
        "the upload is imported and removed"
    );
    server
        .json(Method::DELETE, &format!("uploads/{}", upload["id"].as_str().unwrap()), &json!({}))
        .await
        .problem(404, "not_found");
}

#[tokio::test(flavor = "multi_thread")]
async fn an_archive_is_unpacked_examined_and_imported() {
    let recorded = data::set("mer1-navcam-sol4087-pair", "its import from an archive");
    let (kitti, native) = (kitti(3), small_recording());
    let both = [(Some(kitti.path().to_owned()), 3), (Some(native.path().to_owned()), 5), (recorded, 1)];
    for (recording, stop_count) in both {
        let Some(recording) = recording else { continue };
        let (server, folder) = server(&[]);
        let upload = begin(&server).await;
        let all = files(&recording);
        let sent = send_archive(&server, &upload, archive(&all)).await.expect(200);
        let bytes: usize = all.iter().map(|(_, bytes)| bytes.len()).sum();
        assert_eq!((&sent["files"], &sent["bytes"]), (&json!(all.len()), &json!(bytes)));
        let traverse = import(&server, &upload).await;
        assert_eq!((traverse["stops"].as_array().unwrap().len(), file_count(&folder)), (stop_count, 0));
        let source = traverse["source"].as_str().unwrap();
        assert!(Path::new(source).starts_with(folder.path().join("imported")), "{source}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn no_file_is_stored_outside_its_upload() {
    let (server, folder) = server(&[]);
    let upload = begin(&server).await;
    for name in ["", "../x", "a/../../x", "/etc/x", "a\\x", "c:x", "a\0x", ".archive.zip"] {
        let sentence = send_file(&server, &upload, name, b"x".to_vec()).await.problem(422, "path");
        assert!(sentence.starts_with("path: ") && !sentence.contains('\n'), "{sentence}");
    }
    for name in ["../x", "drive/../../x", "/x", "a\\..\\x"] {
        let bytes = archive(&[("fine".to_owned(), vec![1]), (name.to_owned(), vec![1])]);
        let other = begin(&server).await;
        let sentence = send_archive(&server, &other, bytes).await.problem(422, "zip");
        assert!(sentence.contains("inside the recording"), "{sentence}");
        let id = other["id"].as_str().unwrap();
        server.json(Method::DELETE, &format!("uploads/{id}"), &json!({})).await;
    }
    let mut link = ZipWriter::new(Cursor::new(Vec::new()));
    link.add_symlink("drive/image_0", "/etc", SimpleFileOptions::default()).unwrap();
    let bytes = link.finish().unwrap().into_inner();
    let sentence = send_archive(&server, &upload, bytes).await.problem(422, "zip");
    assert!(sentence.contains("is a link"), "{sentence}");
    let outside = files(folder.path()).into_iter().filter(|(name, _)| name.ends_with('x'));
    assert_eq!(outside.count(), 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn too_much_is_refused_with_the_limit_and_how_to_raise_it() {
    let (server, folder) = server(&["upload_bytes=20000", "upload_files=2", "uploads=1"]);
    let upload = begin(&server).await;
    let refused = server.post("uploads", &json!({})).await;
    assert!(refused.json()["hint"].as_str().unwrap().contains("--limit uploads=2"));
    refused.problem(409, "conflict");
    // 100 kB that are a few hundred bytes in the archive: the sizes in its headers cannot be trusted.
    let bomb = archive(&[("drive/a".to_owned(), vec![0; 100_000])]);
    assert!(bomb.len() < 20_000);
    let refused = send_archive(&server, &upload, bomb).await;
    assert!(refused.json()["hint"].as_str().unwrap().contains("--limit upload_bytes=40000"));
    refused.problem(413, "too_large");
    server.json(Method::DELETE, "uploads/upload-1", &json!({})).await;
    assert_eq!(file_count(&folder), 0);

    let upload = begin(&server).await;
    let three = ["a", "b", "c"].map(|name| (name.to_owned(), vec![1]));
    send_archive(&server, &upload, archive(&three)).await.problem(422, "too_many_files");
    send_file(&server, &upload, "a", vec![1; 15_000]).await.expect(200);
    send_file(&server, &upload, "a", vec![1]).await.problem(409, "conflict");
    server.json(Method::DELETE, "uploads/upload-2", &json!({})).await;
    let upload = begin(&server).await;
    send_file(&server, &upload, "a", vec![1; 15_000]).await.expect(200);
    send_file(&server, &upload, "b", vec![1; 15_000]).await.problem(413, "too_large");
    send_file(&server, &upload, "c", vec![1]).await.problem(422, "too_many_files");
}

#[tokio::test(flavor = "multi_thread")]
async fn files_without_a_recording_are_rejected() {
    let (server, _folder) = server(&[]);
    let upload = begin(&server).await;
    let sentence = contents(&server, &upload).await.problem(422, "file");
    assert!(sentence.contains("is empty"), "{sentence}");
    let sentence = send_archive(&server, &upload, b"no archive".to_vec()).await.problem(422, "zip");
    assert!(sentence.contains("the archive cannot be read") && !sentence.contains('\n'), "{sentence}");
    send_file(&server, &upload, "notes.txt", b"x".to_vec()).await.expect(200);
    let sentence = contents(&server, &upload).await.problem(422, "file");
    assert!(sentence.contains("known are KITTI odometry"), "{sentence}");
    let id = upload["id"].as_str().unwrap();
    let wrong = request(Method::PUT, &format!("uploads/{id}/files?path=a"))
        .header(header::CONTENT_TYPE, "text/plain");
    server.send(wrong.body(Body::from("x")).unwrap()).await.problem(415, "not_bytes");
    let unknown = json!({ "id": "upload-9" });
    send_file(&server, &unknown, "a", vec![1]).await.problem(404, "not_found");
}
