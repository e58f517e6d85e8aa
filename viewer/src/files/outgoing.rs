//! Sends the files of a recording to the server, one after the other; the browser reads each from disk while it is sent.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use sightline_api::endpoint::{NoQuery, path};
use sightline_api::endpoints::{SendArchive, SendFile};
use sightline_api::location::AtUpload;
use sightline_api::recording::UploadPath;

use crate::files::inbox::{Arrival, Chosen};
use crate::page::web::{self, RecordingFile};

/// The last chosen recording.
#[derive(Clone, Default)]
pub(crate) struct Outgoing {
    files: Rc<RefCell<Vec<RecordingFile>>>,
    is_archive: Rc<Cell<bool>>,
    /// Generation counter; incrementing it ends a running transfer.
    number: Rc<Cell<u64>>,
}

impl Outgoing {
    /// Stores the chosen files and reports them.
    pub(crate) fn chosen(&self, files: Vec<RecordingFile>, is_archive: bool, tell: &dyn Fn(Arrival)) {
        let first = files.first().map(|file| file.path.as_str()).unwrap_or_default();
        let name = first.split('/').next().unwrap_or_default().to_owned();
        let bytes = files.iter().map(|file| file.file.size() as u64).sum();
        let chosen = Chosen { name, file_count: files.len(), bytes };
        self.stop();
        self.files.replace(files);
        self.is_archive.set(is_archive);
        tell(Arrival::Chosen(chosen));
    }

    /// Stops sending.
    pub(crate) fn stop(&self) {
        self.number.set(self.number.get() + 1);
    }

    /// Sends all files to an upload, and reports the number of files sent.
    pub(crate) fn send(&self, origin: &str, upload: String, tell: impl Fn(Arrival) + 'static) {
        let (files, base) = (self.files.borrow().clone(), format!("{origin}/api/v1"));
        let (is_archive, number, own) = (self.is_archive.get(), self.number.clone(), self.number.get());
        let at = AtUpload { upload };
        wasm_bindgen_futures::spawn_local(async move {
            for (index, file) in files.iter().enumerate() {
                let below = if is_archive {
                    path::<SendArchive>(&at, &NoQuery {})
                } else {
                    path::<SendFile>(&at, &UploadPath { path: file.path.clone() })
                };
                let sent = web::put_file(&format!("{base}/{below}"), &file.file).await;
                if number.get() != own {
                    return;
                }
                if let Err(problem) = sent {
                    return tell(Arrival::NotSent(problem));
                }
                tell(Arrival::Sent(index + 1));
            }
        });
    }
}
