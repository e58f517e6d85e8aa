//! The calls into the browser: address, storage, files, and the attributes of the canvas.

use std::cell::RefCell;
use std::sync::OnceLock;

use sightline_api::wire::Problem;
use wasm_bindgen::prelude::*;

/// The canvas on which the application runs.
static CANVAS: OnceLock<String> = OnceLock::new();

/// Keeps the id of the canvas on which the application runs.
pub(crate) fn keep_canvas(id: String) {
    CANVAS.get_or_init(|| id);
}

/// How long a change waits until it is written into the address, ms: browsers take some milliseconds for it, which a
/// person who steps quickly would wait for.
const LINK_DELAY_MS: i32 = 250;

/// What is to be written into the address.
struct LateLink {
    fragment: String,
    /// What the address had after its `#` when this was asked for.
    in_place_of: String,
}

thread_local! {
    static LATE_LINK: RefCell<Option<LateLink>> = const { RefCell::new(None) };
}

/// What the address has after its `#`, or will have as soon as it is written.
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

/// Writes what is looked at into the page's address: at once as a new place of the browser's history, or soon in place of
/// the present one.
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

/// Writes what waits, unless the person has gone to another address since.
fn write_late_link() {
    if let Some(late) = LATE_LINK.take().filter(|late| late.in_place_of == written_hash()) {
        write_link(&late.fragment, false);
    }
}

fn write_link(fragment: &str, is_another_place: bool) {
    let history = web_sys::window().and_then(|window| window.history().ok());
    if let Some(history) = history {
        let url = format!("#{fragment}");
        let kept = if is_another_place {
            history.push_state_with_url(&JsValue::NULL, "", Some(&url))
        } else {
            history.replace_state_with_url(&JsValue::NULL, "", Some(&url))
        };
        // Where the browser forbids it, or has enough of it, the page works all the same.
        kept.unwrap_or_default();
    }
}

/// What the browser keeps for this page under a name.
pub(crate) fn kept(name: &str) -> Option<String> {
    web_sys::window()?.local_storage().ok()??.get_item(name).ok()?
}

/// Lets the browser keep a text for this page.
pub(crate) fn keep(name: &str, text: &str) {
    let storage = web_sys::window().and_then(|window| window.local_storage().ok().flatten());
    if let Some(storage) = storage {
        // A browser that keeps nothing shows the overview the next time.
        storage.set_item(name, text).unwrap_or_default();
    }
}

/// Offers bytes to the person as a file of that name.
pub(crate) fn download(name: &str, media_type: &str, bytes: &[u8]) {
    // Where the browser refuses, nothing is saved, which it says itself.
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
    // The address lives as long as the page: some browsers save nothing when it is taken back at once.
    Ok(())
}

/// Sets an attribute of the canvas.
pub(crate) fn publish(name: &str, value: &str) {
    let document = web_sys::window().and_then(|window| window.document());
    let canvas = CANVAS.get().and_then(|id| document?.get_element_by_id(id));
    if let Some(canvas) = canvas {
        // Only tests read it; without it the page is the same.
        canvas.set_attribute(name, value).unwrap_or_default();
    }
}

/// Lets the person choose a file; `chosen` gets it, and is never called where none is chosen.
pub(crate) fn choose_file(chosen: impl FnOnce(web_sys::File) + 'static) {
    // Where the browser refuses, no dialog opens, and dropping a file works all the same.
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

/// A file of a recording that was chosen or dropped.
#[derive(Clone)]
pub(crate) struct RecordingFile {
    /// Its path from the folder's name on; the name of a single file.
    pub(crate) path: String,
    /// Its contents, which the browser reads when they are sent.
    pub(crate) file: web_sys::File,
}

impl RecordingFile {
    /// A file from the browser's dialog, or a single file.
    pub(crate) fn of(file: web_sys::File) -> Self {
        let path = js_sys::Reflect::get(&file, &"webkitRelativePath".into());
        let path = path.ok().and_then(|path| path.as_string()).filter(|path| !path.is_empty());
        Self { path: path.unwrap_or_else(|| file.name()), file }
    }

    /// A file of a dropped folder: a pair of path and file.
    fn dropped(pair: &JsValue) -> Option<Self> {
        let pair: &js_sys::Array = pair.dyn_ref()?;
        Some(Self { path: pair.get(0).as_string()?, file: pair.get(1).dyn_into().ok()? })
    }
}

/// The event with the files of a dropped folder, which `boot.js` reads: its detail is a list of pairs of path and file, or a
/// sentence if the folder cannot be read.
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
        // Where the browser refuses, a dropped folder is refused with the advice to use the dialog.
        let listener = dropped.as_ref().unchecked_ref();
        document.add_event_listener_with_callback(FOLDER_EVENT, listener).unwrap_or_default();
    }
    dropped.forget();
}

/// Lets the person choose a folder, or one archive; `chosen` gets its files, and is never called where none is chosen.
pub(crate) fn choose_recording(is_archive: bool, chosen: impl FnOnce(Vec<RecordingFile>) + 'static) {
    // Where the browser refuses, no dialog opens.
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
    // With the cookie that has the access token.
    request.set_credentials(web_sys::RequestCredentials::SameOrigin);
    request.set_headers(&headers);
    request.set_body(file);
    let window = web_sys::window().ok_or(JsValue::NULL)?;
    let answer = wasm_bindgen_futures::JsFuture::from(window.fetch_with_str_and_init(url, &request));
    answer.await?.dyn_into()
}
