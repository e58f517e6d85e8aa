//! Calls to the browser: address, storage, files, and the attributes of the canvas.

use std::cell::RefCell;
use std::sync::OnceLock;

use sightline_api::wire::Problem;
use wasm_bindgen::prelude::*;

/// The id of the canvas on which the application runs.
static CANVAS: OnceLock<String> = OnceLock::new();

/// Stores the id of the canvas on which the application runs.
pub(crate) fn keep_canvas(id: String) {
    CANVAS.get_or_init(|| id);
}

/// Delay before a change is written to the address, ms: writing takes a browser some milliseconds, which would slow down
/// fast stepping.
const LINK_DELAY_MS: i32 = 250;

/// A fragment that waits to be written to the address.
struct LateLink {
    fragment: String,
    /// The fragment of the address when the write was requested.
    in_place_of: String,
}

thread_local! {
    static LATE_LINK: RefCell<Option<LateLink>> = const { RefCell::new(None) };
}

/// The current fragment of the address, or the one that waits to be written.
pub(crate) fn hash() -> String {
    let written = written_hash();
    LATE_LINK.with_borrow(|late| match late {
        Some(late) if late.in_place_of == written => late.fragment.clone(),
        _ => written,
    })
}

fn written_hash() -> String {
    let location = web_sys::window().map(|window| window.location());
    location.and_then(|location| location.hash().ok()).unwrap_or_default().trim_start_matches('#').to_owned()
}

/// Writes the fragment to the page's address: immediately as a new entry of the browser's history, or after a delay in
/// place of the current entry.
pub(crate) fn keep_link(fragment: &str, is_another_place: bool) {
    if is_another_place {
        write_late_link();
        write_link(fragment, true);
        return;
    }
    let late = LateLink { fragment: fragment.to_owned(), in_place_of: written_hash() };
    let is_timed = LATE_LINK.replace(Some(late)).is_some();
    if let Some(window) = web_sys::window().filter(|_| !is_timed) {
        let write = Closure::once_into_js(write_late_link);
        let timed = window
            .set_timeout_with_callback_and_timeout_and_arguments_0(write.unchecked_ref(), LINK_DELAY_MS);
        if timed.is_err() {
            write_late_link();
        }
    }
}

/// Writes the waiting fragment, unless the user has changed the address in the meantime.
fn write_late_link() {
    if let Some(late) = LATE_LINK.take().filter(|late| late.in_place_of == written_hash()) {
        write_link(&late.fragment, false);
    }
}

fn write_link(fragment: &str, is_another_place: bool) {
    let history = web_sys::window().and_then(|window| window.history().ok());
    if let Some(history) = history {
        let url = format!("#{fragment}");
        let written = if is_another_place {
            history.push_state_with_url(&JsValue::NULL, "", Some(&url))
        } else {
            history.replace_state_with_url(&JsValue::NULL, "", Some(&url))
        };
        // If the browser forbids or limits history changes, the page works without them.
        written.unwrap_or_default();
    }
}

/// The text that the browser stores for this page under a name.
pub(crate) fn stored_item(name: &str) -> Option<String> {
    web_sys::window()?.local_storage().ok()??.get_item(name).ok()?
}

/// Stores a text for this page in the browser.
pub(crate) fn store_item(name: &str, text: &str) {
    let storage = web_sys::window().and_then(|window| window.local_storage().ok().flatten());
    if let Some(storage) = storage {
        // If the browser does not store it, the defaults are used after a reload.
        storage.set_item(name, text).unwrap_or_default();
    }
}

/// Offers bytes to the user as a file with this name.
pub(crate) fn download(name: &str, media_type: &str, bytes: &[u8]) {
    // If the browser refuses the download, it reports that itself.
    let _ = try_download(name, media_type, bytes);
}

fn try_download(name: &str, media_type: &str, bytes: &[u8]) -> Result<(), JsValue> {
    let document = web_sys::window().and_then(|window| window.document()).ok_or(JsValue::NULL)?;
    let parts = js_sys::Array::of1(&js_sys::Uint8Array::from(bytes));
    let about = web_sys::BlobPropertyBag::new();
    about.set_type(media_type);
    let blob = web_sys::Blob::new_with_u8_array_sequence_and_options(&parts, &about)?;
    let url = web_sys::Url::create_object_url_with_blob(&blob)?;
    let anchor: web_sys::HtmlAnchorElement = document.create_element("a")?.dyn_into()?;
    anchor.set_href(&url);
    anchor.set_download(name);
    anchor.click();
    // The object URL is not revoked: some browsers do not save the file if it is revoked immediately.
    Ok(())
}

/// Sets an attribute of the canvas.
pub(crate) fn publish(name: &str, value: &str) {
    let document = web_sys::window().and_then(|window| window.document());
    let canvas = CANVAS.get().and_then(|id| document?.get_element_by_id(id));
    if let Some(canvas) = canvas {
        // Only tests read it; the page works without it.
        canvas.set_attribute(name, value).unwrap_or_default();
    }
}

/// Opens the file dialog; `chosen` receives the file, and is not called if the dialog is cancelled.
pub(crate) fn choose_file(chosen: impl FnOnce(web_sys::File) + 'static) {
    // If the browser refuses, no dialog opens; dropping a file still works.
    let _ = try_choose_file(chosen);
}

fn try_choose_file(chosen: impl FnOnce(web_sys::File) + 'static) -> Result<(), JsValue> {
    let document = web_sys::window().and_then(|window| window.document()).ok_or(JsValue::NULL)?;
    let input: web_sys::HtmlInputElement = document.create_element("input")?.dyn_into()?;
    input.set_type("file");
    input.set_accept(".toml,.json");
    let from = input.clone();
    let changed = Closure::once_into_js(move || {
        if let Some(file) = from.files().and_then(|files| files.get(0)) {
            chosen(file);
        }
    });
    input.add_event_listener_with_callback("change", changed.unchecked_ref())?;
    input.click();
    Ok(())
}

/// A chosen or dropped file of a recording.
#[derive(Clone)]
pub(crate) struct RecordingFile {
    /// Path that starts with the folder's name; for a single file, its name.
    pub(crate) path: String,
    /// The file, which the browser reads when it is sent.
    pub(crate) file: web_sys::File,
}

impl RecordingFile {
    /// Creates it from a file of the browser's dialog, or a single file.
    pub(crate) fn of(file: web_sys::File) -> Self {
        let path = js_sys::Reflect::get(&file, &"webkitRelativePath".into());
        let path = path.ok().and_then(|path| path.as_string()).filter(|path| !path.is_empty());
        Self { path: path.unwrap_or_else(|| file.name()), file }
    }

    /// Creates it from a file of a dropped folder: a pair of path and file.
    fn dropped(pair: &JsValue) -> Option<Self> {
        let pair: &js_sys::Array = pair.dyn_ref()?;
        Some(Self { path: pair.get(0).as_string()?, file: pair.get(1).dyn_into().ok()? })
    }
}

/// The event with the files of a dropped folder, which `boot.js` reads: its detail is a list of pairs of path and file, or
/// a sentence if the folder cannot be read.
const FOLDER_EVENT: &str = "sightline-folder";

/// Calls `found` with the files of every folder that is dropped on the page.
pub(crate) fn watch_folders(found: impl Fn(Result<Vec<RecordingFile>, String>) + 'static) {
    let dropped = Closure::<dyn Fn(web_sys::CustomEvent)>::new(move |event: web_sys::CustomEvent| {
        let detail = event.detail();
        found(match detail.dyn_ref::<js_sys::Array>() {
            Some(pairs) => Ok(pairs.iter().filter_map(|pair| RecordingFile::dropped(&pair)).collect()),
            None => Err(detail.as_string().unwrap_or_default()),
        });
    });
    if let Some(document) = web_sys::window().and_then(|window| window.document()) {
        // Without the listener, a dropped folder is refused with the advice to use the dialog.
        let listener = dropped.as_ref().unchecked_ref();
        document.add_event_listener_with_callback(FOLDER_EVENT, listener).unwrap_or_default();
    }
    dropped.forget();
}

/// Opens the dialog for a folder or one archive; `chosen` receives its files, and is not called if the dialog is
/// cancelled.
pub(crate) fn choose_recording(is_archive: bool, chosen: impl FnOnce(Vec<RecordingFile>) + 'static) {
    // If the browser refuses, no dialog opens.
    let _ = try_choose_recording(is_archive, chosen);
}

fn try_choose_recording(
    is_archive: bool,
    chosen: impl FnOnce(Vec<RecordingFile>) + 'static,
) -> Result<(), JsValue> {
    let document = web_sys::window().and_then(|window| window.document()).ok_or(JsValue::NULL)?;
    let input: web_sys::HtmlInputElement = document.create_element("input")?.dyn_into()?;
    input.set_type("file");
    if is_archive {
        input.set_accept(".zip");
    } else {
        input.set_attribute("webkitdirectory", "")?;
    }
    let from = input.clone();
    let changed = Closure::once_into_js(move || {
        let files = from.files();
        let count = files.as_ref().map_or(0, web_sys::FileList::length);
        let all = (0..count).filter_map(|index| files.as_ref().and_then(|files| files.get(index)));
        chosen(all.map(RecordingFile::of).collect());
    });
    input.add_event_listener_with_callback("change", changed.unchecked_ref())?;
    input.click();
    Ok(())
}

/// Sends a file as the body of a PUT.
pub(crate) async fn put_file(url: &str, file: &web_sys::File) -> Result<(), Problem> {
    let unreachable = |_| {
        Problem::new(
            0,
            "unreachable",
            "no answer",
            "The server does not answer; check that it runs, and try again.",
        )
    };
    let response = try_put_file(url, file).await.map_err(unreachable)?;
    if response.ok() {
        return Ok(());
    }
    let text = match response.text() {
        Ok(text) => wasm_bindgen_futures::JsFuture::from(text).await.ok().and_then(|text| text.as_string()),
        Err(_) => None,
    };
    let problem = text.and_then(|text| serde_json::from_str(&text).ok());
    let status = response.status();
    Err(problem
        .unwrap_or_else(|| Problem::new(status, "unexpected", "", format!("The server answered {status}."))))
}

async fn try_put_file(url: &str, file: &web_sys::File) -> Result<web_sys::Response, JsValue> {
    let headers = web_sys::Headers::new()?;
    headers.set("Content-Type", "application/octet-stream")?;
    let request = web_sys::RequestInit::new();
    request.set_method("PUT");
    // Includes the cookie with the access token.
    request.set_credentials(web_sys::RequestCredentials::SameOrigin);
    request.set_headers(&headers);
    request.set_body(file);
    let window = web_sys::window().ok_or(JsValue::NULL)?;
    let answer = wasm_bindgen_futures::JsFuture::from(window.fetch_with_str_and_init(url, &request));
    answer.await?.dyn_into()
}
