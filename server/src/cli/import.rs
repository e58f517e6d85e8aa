//! `sightline import`: converts a foreign recording to a traverse.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use clap::{Args, ValueEnum};
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Existing;
use sightline_recordings::import::{ImportOptions, import, recognise};

use super::terminal::{self, Progress};

/// Convert a foreign recording to a traverse.
#[derive(Debug, Args)]
pub(super) struct Import {
    /// The recording: a folder or a file.
    path: PathBuf,
    /// The folder to create.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// The format; by default it is recognised.
    #[arg(long)]
    format: Option<Format>,
    /// The name of the traverse; by default that of the recording.
    #[arg(long)]
    name: Option<String>,
    /// A left file of a stop, relative to the recording; can be given more than once, each with its own --right.
    #[arg(long, value_name = "FILE")]
    left: Vec<PathBuf>,
    /// The right file of the stop of the same --left.
    #[arg(long, value_name = "FILE")]
    right: Vec<PathBuf>,
    /// The first frame of a sequence.
    #[arg(long, default_value_t = 0)]
    first_frame: usize,
    /// The largest number of stops.
    #[arg(long, value_name = "N")]
    max_stops: Option<usize>,
    /// Take every n-th frame of a sequence.
    #[arg(long, value_name = "N", default_value_t = 1)]
    every: usize,
    /// For true poses: 1σ error of the simulated odometry, as a fraction of the distance driven.
    #[arg(long, value_name = "FRACTION", default_value_t = ImportOptions::default().odometry_fraction)]
    odometry_fraction: f64,
    /// For true poses: 1σ error of the simulated attitude at each step, deg.
    #[arg(long, value_name = "DEG", default_value_t = ImportOptions::default().attitude_deg)]
    attitude_deg: f64,
    /// The seed of the simulated odometry.
    #[arg(long, default_value_t = ImportOptions::default().seed)]
    seed: u64,
    /// Replace a traverse that is in the folder already.
    #[arg(long)]
    replace: bool,
}

/// A foreign format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// KITTI odometry.
    Kitti,
    /// PDS3 products of MER and MSL.
    Pds3,
}

impl Import {
    /// Imports the recording and reports progress.
    ///
    /// # Errors
    /// As [`import`], and when the recording has another format than the requested one.
    pub(super) fn run(self) -> Result<()> {
        if let Some(format) = self.format {
            check_format(format, recognise(&self.path)?.name(), &self.path)?;
        }
        if self.left.len() != self.right.len() {
            let (left, right) = (self.left.len(), self.right.len());
            return Err(Error::Request(format!(
                "--left and --right go in pairs, but there are {left} and {right}"
            )));
        }
        let files = self.left.into_iter().zip(self.right).flat_map(|(left, right)| [left, right]).collect();
        let options = ImportOptions {
            name: self.name,
            files,
            first_frame: self.first_frame,
            max_stops: self.max_stops.unwrap_or(usize::MAX),
            every: self.every,
            odometry_fraction: self.odometry_fraction,
            attitude_deg: self.attitude_deg,
            seed: self.seed,
            existing: if self.replace { Existing::Replace } else { Existing::Refuse },
            within: None,
        };
        let mut progress = Progress::new("imported image");
        let mut tell = |done, all| progress.tell(done, all);
        let imported = import(&self.path, &options, &self.out, &mut tell, &AtomicBool::new(false))?;
        for note in &imported.notes {
            terminal::error(&format!("note: {note}"));
        }
        let (folder, stops, images) =
            (self.out.display(), imported.index.stops.len(), imported.images_written);
        terminal::line(&format!("{folder}: {stops} stops, {images} images"))
    }
}

fn check_format(wanted: Format, found: &str, path: &std::path::Path) -> Result<()> {
    let word = match wanted {
        Format::Kitti => "kitti",
        Format::Pds3 => "pds3",
    };
    if found.to_ascii_lowercase().contains(word) {
        return Ok(());
    }
    Err(Error::format(path, format!("looks like {found}, not like {word}; leave out --format")))
}
