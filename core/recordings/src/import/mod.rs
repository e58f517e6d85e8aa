//! Importers: convert a foreign recording to a native folder, one file per format.
//!
//! | format | file | input |
//! |---|---|---|
//! | KITTI odometry | `kitti` | `calib.txt`, `poses.txt`, `image_0`, `image_1` |
//! | PDS3 | `pds3` (labels: `odl`) | images of MER and MSL with camera model and rover pose in the label |
//!
//! An importer writes the images through [`Output`] and returns the index; the index is written last, so a folder
//! with an index is complete. If the import fails or is cancelled, its files are removed.

pub mod examine;
pub mod kitti;
mod links;
pub(crate) mod odl;
pub mod pds3;

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::files::{self, write_atomically};
use super::index_file::{self, Existing, IndexFormat};
use super::native;
use sightline_geometry::error::{Error, Result};
use sightline_world::traverse::TraverseIndex;

/// The largest file that is copied, bytes.
const FILE_LIMIT: u64 = 256 << 20;

/// Options of an import; each format uses those that apply to it.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportOptions {
    /// The name of the traverse; by default that of the recording.
    pub name: Option<String>,
    /// The files to import, relative to the recording's folder; for PDS3 left and right alternately. Empty: chosen by
    /// the format.
    pub files: Vec<PathBuf>,
    /// The first frame of a sequence.
    pub first_frame: usize,
    /// The largest number of stops.
    pub max_stops: usize,
    /// Import every n-th frame of a sequence.
    pub every: usize,
    /// For recordings whose poses are true: 1σ error of the simulated odometry, as a fraction of the distance driven.
    pub odometry_fraction: f64,
    /// 1σ error of the simulated odometry about each axis at each step, deg.
    pub attitude_deg: f64,
    /// The seed of the simulated odometry.
    pub seed: u64,
    /// Whether files in the output folder may be replaced.
    pub existing: Existing,
    /// The folder that no file of the recording may leave, not even by a symbolic link; `None`: links are followed anywhere.
    pub within: Option<PathBuf>,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            name: None,
            files: Vec::new(),
            first_frame: 0,
            max_stops: usize::MAX,
            every: 1,
            odometry_fraction: 0.02,
            attitude_deg: 0.2,
            seed: 1,
            existing: Existing::Refuse,
            within: None,
        }
    }
}

impl ImportOptions {
    fn check(&self) -> Result<()> {
        for (key, value, limit) in
            [("odometry_fraction", self.odometry_fraction, 1.0), ("attitude_deg", self.attitude_deg, 45.0)]
        {
            if !(0.0..=limit).contains(&value) {
                return Err(Error::setting(key, format!("is {value}, but it must be between 0 and {limit}")));
            }
        }
        for (key, value) in [("every", self.every), ("max_stops", self.max_stops)] {
            if value == 0 {
                return Err(Error::setting(key, "is 0, but it must be at least 1"));
            }
        }
        Ok(())
    }
}

/// The result of an import.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The index that was written.
    pub index: TraverseIndex,
    /// The number of images written.
    pub images_written: usize,
    /// Omissions and assumptions, one sentence each.
    pub notes: Vec<String>,
}

/// A foreign format.
pub trait ImportFormat: Sync {
    /// The name of the format, for users.
    fn name(&self) -> &'static str;
    /// The content by which a recording of this format is recognised, for users.
    fn expects(&self) -> &'static str;
    /// Whether `path` looks like this format.
    fn sniff(&self, path: &Path) -> bool;
    /// Writes the images of the recording at `path` into `output` and returns the index.
    ///
    /// # Errors
    /// A damaged or incomplete recording, a folder that cannot be written, or [`Error::Cancelled`].
    fn import(&self, path: &Path, options: &ImportOptions, output: &mut Output<'_>) -> Result<TraverseIndex>;
}

/// All formats, in the order in which they are tried.
pub(crate) const FORMATS: [&dyn ImportFormat; 2] = [&kitti::Kitti, &pds3::Pds3];

/// The destination of an importer's images; reports progress, and lists the files for removal on failure.
pub struct Output<'a> {
    folder: &'a Path,
    existing: Existing,
    /// Whether the recording is only examined: files get only quick checks, and nothing is written.
    is_dry: bool,
    cancel: &'a AtomicBool,
    progress: &'a mut dyn FnMut(usize, usize),
    expected: usize,
    written: Vec<PathBuf>,
    notes: Vec<String>,
}

impl Output<'_> {
    /// Announces the number of images that will be written.
    pub fn expect(&mut self, images: usize) {
        self.expected = images;
        (self.progress)(0, images);
    }

    /// Writes one image file under `name`, a path relative to the folder with `/`.
    ///
    /// # Errors
    /// [`Error::Cancelled`], a file that exists and may not be replaced, or one that cannot be written.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        self.check_cancelled()?;
        if self.is_dry {
            return Ok(());
        }
        let path = self.folder.join(name);
        if self.existing == Existing::Refuse && path.exists() {
            return Err(Error::format(path, "is already there; choose an empty folder"));
        }
        write_atomically(&path, bytes)?;
        self.written.push(path);
        (self.progress)(self.written.len(), self.expected);
        Ok(())
    }

    /// Copies one image file, bit for bit.
    ///
    /// # Errors
    /// As [`Output::write`], or a source that cannot be read.
    pub fn copy(&mut self, source: &Path, name: &str) -> Result<()> {
        self.check_cancelled()?;
        let unreadable = |error| Error::Read { path: source.to_owned(), source: error };
        let too_large = || {
            let limit = FILE_LIMIT >> 20;
            Error::format(source, format!("the file has more than the {limit} MiB allowed"))
        };
        let file = files::open(source)?;
        if file.metadata().map_err(unreadable)?.len() > FILE_LIMIT {
            return Err(too_large());
        }
        if self.is_dry {
            return Ok(());
        }
        let mut bytes = Vec::new();
        let length = file.take(FILE_LIMIT + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        if length as u64 > FILE_LIMIT {
            return Err(too_large());
        }
        self.write(name, &bytes)
    }

    /// Whether nothing is written, so that no image needs to be encoded.
    pub(crate) fn is_dry(&self) -> bool {
        self.is_dry
    }

    /// Adds a sentence for the user about an omission or an assumption.
    pub fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// # Errors
    /// [`Error::Cancelled`] if the user requested to stop.
    pub(crate) fn check_cancelled(&self) -> Result<()> {
        if self.cancel.load(Ordering::Relaxed) { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Imports the recording at `path` into `folder`; `progress` receives (images written, images in total).
///
/// # Errors
/// An unknown format, a damaged recording, an output folder that contains a traverse or the recording itself, or
/// [`Error::Cancelled`]. Files that this import wrote are removed.
pub fn import(
    path: &Path,
    options: &ImportOptions,
    folder: &Path,
    progress: &mut dyn FnMut(usize, usize),
    cancel: &AtomicBool,
) -> Result<Imported> {
    options.check()?;
    if let Some(root) = &options.within {
        links::check(path, root, cancel)?;
    }
    let format = recognise(path)?;
    check_folder(path, folder, options.existing)?;
    let mut output = Output {
        folder,
        existing: options.existing,
        is_dry: false,
        cancel,
        progress,
        expected: 0,
        written: Vec::new(),
        notes: Vec::new(),
    };
    let index = format.import(path, options, &mut output).and_then(|index| {
        output.check_cancelled()?;
        native::write(&index, folder, IndexFormat::Toml, options.existing)?;
        Ok(index)
    });
    let index = index.inspect_err(|_| {
        for file in &output.written {
            // The first error is the one to report.
            let _ = std::fs::remove_file(file);
            // Fails, as intended, for a subfolder with other files.
            let _ = file.parent().filter(|parent| *parent != folder).map(std::fs::remove_dir);
        }
    })?;
    Ok(Imported { index, images_written: output.written.len(), notes: output.notes })
}

/// The format of the recording at `path`.
///
/// # Errors
/// No such path, a native traverse, or an unknown format; the message lists the known ones.
pub fn recognise(path: &Path) -> Result<&'static dyn ImportFormat> {
    if !path.exists() {
        return Err(Error::format(path, "does not exist"));
    }
    if index_file::find(path).is_ok() {
        return Err(Error::format(path, "is a native traverse already; open it without importing"));
    }
    FORMATS.into_iter().find(|format| format.sniff(path)).ok_or_else(|| {
        let known: Vec<_> =
            FORMATS.iter().map(|format| format!("{} ({})", format.name(), format.expects())).collect();
        Error::format(path, format!("is of no known format; known are {}", known.join("; ")))
    })
}

/// Rejects an output folder that would overwrite a traverse or the recording itself.
fn check_folder(path: &Path, folder: &Path, existing: Existing) -> Result<()> {
    let source = if path.is_dir() { path } else { path.parent().unwrap_or(path) };
    if let (Ok(source), Ok(target)) = (source.canonicalize(), folder.canonicalize())
        && source == target
    {
        return Err(Error::format(folder, "is the recording's own folder; import into another one"));
    }
    match index_file::find(folder) {
        Ok((index, _)) if folder.is_dir() && existing == Existing::Refuse => {
            Err(Error::format(index, "is already there; choose another folder or remove it first"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests;
