//! Recordings uploaded by a page: file by file, or as one zip archive, into a separate folder until they are imported.
//!
//! Names are confined to that folder: relative, without `..`, and an archive may contain no links. Bytes are counted while
//! they are received and unpacked, independent of the headers. Uploads do not survive a restart.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex};

use axum::body::Body;
use futures_util::StreamExt;
use sightline_api::recording::UploadView;
use sightline_geometry::error::Error;
use zip::ZipArchive;
use zip::read::ZipFile;
use zip::result::ZipError;

use crate::folders::{Folders, make_private};
use crate::import_session::remove_folder;
use crate::jobs::{blocking, lock};
use crate::limits::{Limits, SharedLimits};
use crate::printable::printable;
use crate::problem::{ApiError, ApiResult};

/// The name of an archive in the folder of its upload; uploaded files cannot have it, because it is not a valid path in a
/// recording.
const ARCHIVE: &str = ".archive.zip";
/// Bytes per read while unpacking.
const CHUNK: usize = 1 << 16;
/// Maximum length of a file name in a message, characters.
const NAME_SHOWN: usize = 120;

/// The uploads of a server.
pub(crate) struct Uploads {
    list: Mutex<UploadList>,
    limits: SharedLimits,
}

#[derive(Default)]
struct UploadList {
    uploads: Vec<Arc<Upload>>,
    number: u64,
}

/// An upload.
pub(crate) struct Upload {
    id: String,
    folder: PathBuf,
    size: Mutex<UploadSize>,
    limits: SharedLimits,
}

/// The size of an upload so far.
#[derive(Clone, Copy, Default)]
struct UploadSize {
    files: usize,
    bytes: u64,
}

impl Uploads {
    /// An empty list.
    pub(crate) fn new(limits: &SharedLimits) -> Self {
        Self { list: Mutex::default(), limits: Arc::clone(limits) }
    }

    /// Starts an upload.
    ///
    /// # Errors
    /// A problem if there are too many, or its folder cannot be created.
    pub(crate) fn begin(&self, folders: &Folders) -> ApiResult<UploadView> {
        let mut list = lock(&self.list);
        if list.uploads.len() >= self.limits.uploads.count() {
            let way_out = "Import one of them, or remove one: DELETE uploads/{upload}.";
            let detail = format!("There are {} uploads already.", list.uploads.len());
            return Err(ApiError::conflict(detail).hint(self.limits.uploads.hint(way_out)));
        }
        list.number += 1;
        let id = format!("upload-{}", list.number);
        let folder = folders.uploads.join(&id);
        make_private(&folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
        let folder = folder.canonicalize().map_err(|source| Error::Write { path: folder, source })?;
        let upload = Upload { id, folder, size: Mutex::default(), limits: Arc::clone(&self.limits) };
        let view = upload.view();
        list.uploads.push(Arc::new(upload));
        Ok(view)
    }

    /// The upload named `id`.
    ///
    /// # Errors
    /// A problem if it does not exist.
    pub(crate) fn upload(&self, id: &str) -> ApiResult<Arc<Upload>> {
        let found = lock(&self.list).uploads.iter().find(|upload| upload.id == id).cloned();
        found.ok_or_else(|| ApiError::not_found("There is no such upload."))
    }

    /// Removes an upload with its files.
    ///
    /// # Errors
    /// A problem if it does not exist, or its folder cannot be removed.
    pub(crate) fn remove(&self, id: &str) -> ApiResult<()> {
        let upload = self.upload(id)?;
        lock(&self.list).uploads.retain(|other| other.id != id);
        Ok(remove_folder(&upload.folder)?)
    }

    /// The folder of the upload that contains `path`.
    pub(crate) fn root_of(&self, path: &Path) -> Option<PathBuf> {
        let list = lock(&self.list);
        list.uploads
            .iter()
            .find(|upload| path.starts_with(&upload.folder))
            .map(|upload| upload.folder.clone())
    }

    /// Removes the upload in this folder after its import.
    pub(crate) fn imported(&self, root: &Path) {
        lock(&self.list).uploads.retain(|upload| upload.folder != root);
        // Remaining files are removed at the next start.
        let _ = remove_folder(root);
    }
}

impl Upload {
    /// The view of the upload for pages.
    pub(crate) fn view(&self) -> UploadView {
        let UploadSize { files, bytes } = *lock(&self.size);
        UploadView { id: self.id.clone(), path: self.folder.display().to_string(), files, bytes }
    }

    /// Stores a file at its path in the recording.
    ///
    /// # Errors
    /// A name that is invalid or in use, or too many files or bytes.
    pub(crate) async fn store_file(&self, name: &str, body: Body) -> ApiResult<UploadView> {
        let path = self.destination(name, "path")?;
        self.take_file()?;
        self.write(&path, name, body).await?;
        Ok(self.view())
    }

    /// Unpacks an archive into an empty upload.
    ///
    /// # Errors
    /// A damaged archive, an invalid entry, or too many files or bytes.
    pub(crate) async fn unpack(self: Arc<Self>, body: Body) -> ApiResult<UploadView> {
        let path = self.folder.join(ARCHIVE);
        self.write(&path, "the archive", body).await?;
        // The limit applies separately to the archive and to its contents.
        lock(&self.size).bytes = 0;
        blocking(move || {
            let unpacked = File::open(&path)
                .map_err(|source| Error::Read { path: path.clone(), source }.into())
                .and_then(|file| self.unpack_file(file));
            // A remaining file is removed with the upload.
            let _ = std::fs::remove_file(&path);
            unpacked.map(|()| self.view())
        })
        .await
    }

    async fn write(&self, path: &Path, name: &str, body: Body) -> ApiResult<()> {
        let failed = |source| ApiError::from(Error::Write { path: path.to_owned(), source });
        let mut file = create(path, name)?;
        let mut body = body.into_data_stream();
        let patience = self.limits.body_s.time().unwrap_or(std::time::Duration::MAX);
        loop {
            let next = tokio::time::timeout(patience, body.next()).await.map_err(|_| {
                let detail = format!("“{}” stopped arriving.", shown(name));
                ApiError::new(axum::http::StatusCode::REQUEST_TIMEOUT, "slow", detail)
                    .hint(self.limits.body_s.raise())
            })?;
            let Some(chunk) = next else { break };
            let chunk = chunk
                .map_err(|_| ApiError::invalid("body", format!("“{}” did not arrive whole.", shown(name))))?;
            self.take_bytes(chunk.len())?;
            file = blocking(move || Ok(file.write_all(&chunk).map(|()| file))).await?.map_err(failed)?;
        }
        Ok(())
    }

    fn unpack_file(&self, file: File) -> ApiResult<()> {
        let mut archive = ZipArchive::new(file).map_err(|error| damaged(&error))?;
        // Checked before any file is written.
        self.limits.check_upload_files(archive.len())?;
        for index in 0..archive.len() {
            let mut entry = archive.by_index(index).map_err(|error| damaged(&error))?;
            self.unpack_entry(&mut entry)?;
        }
        Ok(())
    }

    fn unpack_entry<R: Read>(&self, entry: &mut ZipFile<'_, R>) -> ApiResult<()> {
        let name = entry.name().to_owned();
        if entry.is_symlink() {
            let detail = format!("zip: “{}” is a link.", shown(&name));
            return Err(ApiError::invalid("zip", detail).hint("Pack the files themselves (zip without -y)."));
        }
        let path = self.destination(name.trim_end_matches('/'), "zip")?;
        if entry.is_dir() {
            let made = std::fs::create_dir_all(&path);
            return made.map_err(|source| Error::Write { path, source }.into());
        }
        self.take_file()?;
        let mut file = create(&path, &name)?;
        let mut chunk = vec![0; CHUNK];
        loop {
            let count = entry.read(&mut chunk).map_err(|error| {
                let detail = format!("zip: “{}” cannot be unpacked ({error}).", shown(&name));
                ApiError::invalid("zip", detail).hint("Pack the folder again, with the method deflate.")
            })?;
            if count == 0 {
                return Ok(());
            }
            self.take_bytes(count)?;
            file.write_all(&chunk[..count]).map_err(|source| Error::Write { path: path.clone(), source })?;
        }
    }

    /// The path of a file in the folder of the upload.
    fn destination(&self, name: &str, field: &str) -> ApiResult<PathBuf> {
        let is_normal = |part: Component<'_>| matches!(part, Component::Normal(_));
        let stays = !name.is_empty() && Path::new(name).components().all(is_normal);
        if !stays || name.contains(['\\', '\0', ':']) || name.starts_with(ARCHIVE) {
            let detail = format!(
                "{field}: “{}” must be a path inside the recording, with “/” and without “..”.",
                shown(name)
            );
            return Err(
                ApiError::invalid(field, detail).hint("Choose or pack the folder of the recording itself.")
            );
        }
        Ok(self.folder.join(name))
    }

    fn take_file(&self) -> ApiResult<()> {
        let mut size = lock(&self.size);
        self.limits.check_upload_files(size.files + 1)?;
        size.files += 1;
        Ok(())
    }

    fn take_bytes(&self, count: usize) -> ApiResult<()> {
        let limit = &self.limits.upload_bytes;
        let mut size = lock(&self.size);
        size.bytes += count as u64;
        if size.bytes <= limit.count() as u64 {
            return Ok(());
        }
        let detail = format!("The upload has more than {} bytes.", limit.count());
        let way_out = "Copy the recording to the server's machine, and start it with `sightline serve --recordings FOLDER`.";
        Err(ApiError::new(axum::http::StatusCode::PAYLOAD_TOO_LARGE, "too_large", detail)
            .hint(limit.hint(way_out)))
    }
}

impl Limits {
    /// Rejects an upload with too many files.
    fn check_upload_files(&self, count: usize) -> ApiResult<()> {
        if count <= self.upload_files.count() {
            return Ok(());
        }
        let detail = format!("The upload has more than {} files.", self.upload_files.count());
        Err(ApiError::invalid("too_many_files", detail).hint(self.upload_files.raise()))
    }
}

/// Creates a new file and its parent folders.
fn create(path: &Path, name: &str) -> ApiResult<File> {
    let failed = |source| ApiError::from(Error::Write { path: path.to_owned(), source });
    path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(failed)?;
    File::create_new(path).map_err(|error| match error.kind() {
        std::io::ErrorKind::AlreadyExists => {
            let detail = format!("“{}” is sent twice.", shown(name));
            ApiError::conflict(detail).hint("Begin another upload.")
        }
        _ => failed(error),
    })
}

fn damaged(error: &ZipError) -> ApiError {
    ApiError::invalid("zip", format!("zip: the archive cannot be read ({error})."))
        .hint("Send a zip archive of the recording's folder, not encrypted, packed with the method deflate.")
}

fn shown(name: &str) -> String {
    printable(name).chars().take(NAME_SHOWN).collect()
}
