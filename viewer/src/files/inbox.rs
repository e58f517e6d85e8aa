//! Files opened by the page: dropped on it, chosen in the browser's dialog, or named by path.
//!
//! Name and size are checked before a byte is read, so that a file of a gigabyte costs nothing. The contents, or the
//! reason for a refusal, arrive through a channel.

use std::sync::mpsc::{Receiver, Sender, channel};

use egui::Context;
use sightline_api::wire::Problem;

use crate::files::documents;
#[cfg(target_arch = "wasm32")]
use crate::page::web::RecordingFile;

/// The outcome of opening a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Arrival {
    /// The file is not read; the reason.
    Refused(String),
    /// The contents of a file.
    Read {
        /// The file's name.
        name: String,
        /// The file's bytes.
        bytes: Vec<u8>,
    },
    /// A recording was chosen: a folder, or an archive.
    Chosen(Chosen),
    /// Number of files of the chosen recording that have been sent.
    Sent(usize),
    /// A file of the recording was refused; the rest is not sent.
    NotSent(Problem),
}

/// A recording that was chosen for sending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// The name of the folder or archive.
    pub name: String,
    /// Number of files; an archive counts as one.
    pub file_count: usize,
    /// Its size, bytes.
    pub bytes: u64,
}

/// Receives opened files.
pub(crate) struct Inbox {
    sender: Sender<Arrival>,
    receiver: Receiver<Arrival>,
    context: Context,
    #[cfg(target_arch = "wasm32")]
    outgoing: crate::files::outgoing::Outgoing,
}

impl Inbox {
    /// Creates an empty inbox; repaints `context` when a file arrives.
    pub(crate) fn new(context: Context) -> Self {
        let (sender, receiver) = channel();
        let inbox = Self {
            sender,
            receiver,
            context,
            #[cfg(target_arch = "wasm32")]
            outgoing: Default::default(),
        };
        #[cfg(target_arch = "wasm32")]
        inbox.watch_folders();
        inbox
    }

    /// The files that arrived since the last call, including those dropped in this frame.
    pub(crate) fn poll(&mut self) -> Vec<Arrival> {
        let dropped = self.context.input(|input| input.raw.dropped_files.clone());
        let names: Vec<String> = dropped.iter().map(|file| name_of(file.path())).collect();
        match documents::only_one(&names) {
            Err(why) => self.refuse(why),
            Ok(()) => dropped.iter().for_each(|file| self.take(file)),
        }
        self.receiver.try_iter().collect()
    }

    /// Whether files are being dragged over the page.
    pub(crate) fn is_hovered(&self) -> bool {
        self.context.input(|input| !input.raw.hovered_files.is_empty())
    }

    fn refuse(&self, why: String) {
        tell(&self.sender, &self.context, Arrival::Refused(why));
    }
}

/// Sends an arrival and requests a repaint; a missing receiver means that the page is closing.
fn tell(sender: &Sender<Arrival>, context: &Context, arrival: Arrival) {
    if sender.send(arrival).is_ok() {
        context.request_repaint();
    }
}

fn name_of(path: &std::path::Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

#[cfg(not(target_arch = "wasm32"))]
impl Inbox {
    fn take(&self, file: &egui::DroppedFileHandle) {
        self.open_path(file.path());
    }

    /// Reads a file by its path.
    pub(crate) fn open_path(&self, path: &std::path::Path) {
        let name = name_of(path);
        let read = std::fs::metadata(path).map_err(|_| documents::unreadable(&name)).and_then(|about| {
            documents::before_reading(&name, about.len(), about.is_dir())?;
            std::fs::read(path).map_err(|_| documents::unreadable(&name))
        });
        match read {
            Ok(bytes) => tell(&self.sender, &self.context, Arrival::Read { name, bytes }),
            Err(why) => self.refuse(why),
        }
    }
}

#[cfg(target_arch = "wasm32")]
impl Inbox {
    fn take(&self, file: &egui::DroppedFileHandle) {
        if let Some(file) = file.web_file() {
            let (sender, context) = (self.sender.clone(), self.context.clone());
            if file.name().to_lowercase().ends_with(".zip") {
                return self.outgoing.chosen(vec![RecordingFile::of(file.clone())], true, &|arrival| {
                    tell(&sender, &context, arrival);
                });
            }
            read_file(file.clone(), sender, context);
        }
    }

    /// Treats every dropped folder as a chosen recording.
    fn watch_folders(&self) {
        let (sender, context, outgoing) = (self.sender.clone(), self.context.clone(), self.outgoing.clone());
        crate::page::web::watch_folders(move |found| match found {
            Ok(files) => outgoing.chosen(files, false, &|arrival| tell(&sender, &context, arrival)),
            Err(why) => tell(&sender, &context, Arrival::Refused(why)),
        });
    }

    /// Opens the browser's dialog for the folder of a recording, or for an archive of one.
    pub(crate) fn choose_recording(&self, is_archive: bool) {
        let (sender, context, outgoing) = (self.sender.clone(), self.context.clone(), self.outgoing.clone());
        crate::page::web::choose_recording(is_archive, move |files| {
            outgoing.chosen(files, is_archive, &|arrival| tell(&sender, &context, arrival));
        });
    }

    /// Sends the last chosen recording.
    pub(crate) fn send_recording(&self, origin: &str, upload: String) {
        let (sender, context) = (self.sender.clone(), self.context.clone());
        self.outgoing.send(origin, upload, move |arrival| tell(&sender, &context, arrival));
    }

    /// Stops sending the recording.
    pub(crate) fn stop_sending(&self) {
        self.outgoing.stop();
    }

    /// Opens the browser's dialog for a file.
    pub(crate) fn choose(&self) {
        let (sender, context) = (self.sender.clone(), self.context.clone());
        crate::page::web::choose_file(move |file| read_file(file, sender, context));
    }
}

#[cfg(target_arch = "wasm32")]
fn read_file(file: web_sys::File, sender: Sender<Arrival>, context: Context) {
    let name = file.name();
    // A browser presents a folder like a file until it is read.
    if let Err(why) = documents::before_reading(&name, file.size() as u64, false) {
        return tell(&sender, &context, Arrival::Refused(why));
    }
    wasm_bindgen_futures::spawn_local(async move {
        let arrival = match wasm_bindgen_futures::JsFuture::from(file.array_buffer()).await {
            Ok(buffer) => Arrival::Read { name, bytes: js_sys::Uint8Array::new(&buffer).to_vec() },
            Err(_) => Arrival::Refused(documents::unreadable(&name)),
        };
        tell(&sender, &context, arrival);
    });
}
