//! What can be exported: the names of the files, what each is for, and how large it will be.

use serde::{Deserialize, Serialize};
use sightline_core::session::exports::{ExportEntry, Size};
use utoipa::IntoParams;

use super::source::Source;
use super::{bundle, rows, sheet};

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A Rerun recording.
    Recording,
    /// Rows as JSON Lines.
    Jsonl,
    /// Rows as CSV.
    Csv,
    /// Rows as Parquet.
    Parquet,
    /// An animated contact sheet.
    Animation,
    /// A still contact sheet.
    Sheet,
    /// A report.
    Report,
    /// What is needed to do the same again.
    Bundle,
}

/// Which part of a session is wanted; all of it by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct Part {
    /// One target by its number.
    #[serde(default)]
    pub target: Option<usize>,
    /// One run of that target by its number.
    #[serde(default)]
    pub run: Option<usize>,
}

impl Kind {
    /// All of them, in the order of the menu.
    pub const ALL: [Self; 8] = [
        Self::Report,
        Self::Recording,
        Self::Csv,
        Self::Jsonl,
        Self::Parquet,
        Self::Animation,
        Self::Sheet,
        Self::Bundle,
    ];

    /// The name in paths and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Recording => "recording.rrd",
            Self::Jsonl => "rows.jsonl",
            Self::Csv => "rows.csv",
            Self::Parquet => "rows.parquet",
            Self::Animation => "steps.apng",
            Self::Sheet => "steps.png",
            Self::Report => "report.html",
            Self::Bundle => "reproduce.json",
        }
    }

    /// The kind of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// What the bytes are.
    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Recording => "application/octet-stream",
            Self::Jsonl => "application/jsonl",
            Self::Csv => "text/csv; charset=utf-8",
            Self::Parquet => "application/vnd.apache.parquet",
            Self::Animation => "image/apng",
            Self::Sheet => "image/png",
            Self::Report => "text/html; charset=utf-8",
            Self::Bundle => "application/json",
        }
    }

    /// What it is called in a menu.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Recording => "Rerun recording",
            Self::Jsonl => "Rows, JSON Lines",
            Self::Csv => "Rows, CSV",
            Self::Parquet => "Rows, Parquet",
            Self::Animation => "Steps, animated picture",
            Self::Sheet => "Steps, contact sheet",
            Self::Report => "Report",
            Self::Bundle => "Reproduce bundle",
        }
    }

    /// What it holds and is good for, as one sentence.
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Recording => {
                "Everything that every step saw, laid out for the Rerun viewer 0.36; images included."
            }
            Self::Jsonl => "One JSON object a step with all columns and the covariance, every digit kept.",
            Self::Csv => "One line a step, for spreadsheets; what is not known is empty.",
            Self::Parquet => {
                "One row a step, typed columns with their units in the file, for pandas and Polars."
            }
            Self::Animation => {
                "The target in the left image at every step of one run, with marks and state: plays in a browser (APNG)."
            }
            Self::Sheet => "The same pictures side by side in one PNG.",
            Self::Report => {
                "One HTML page that needs nothing else: metrics, worst steps with pictures, notes, settings; printable."
            }
            Self::Bundle => {
                "Settings, seed, versions, hashes and commands with which anybody gets the same rows, bit for bit."
            }
        }
    }

    /// Whether it shows one run only.
    pub const fn is_of_one_run(self) -> bool {
        matches!(self, Self::Animation | Self::Sheet)
    }

    /// How large the file will be, known or estimated.
    pub fn size(self, source: &Source, part: Part) -> Size {
        let exact = |bytes: usize| Size { bytes: bytes as u64, is_exact: true };
        let about = |bytes: u64| Size { bytes, is_exact: false };
        let steps: usize = source.runs(part).iter().map(|run| run.run.steps.len()).sum();
        match self {
            Self::Jsonl => exact(rows::jsonl(source, part).len()),
            Self::Csv => exact(rows::csv(source, part).len()),
            Self::Bundle => exact(bundle::json(source, part).len()),
            // Pages of 26 columns with their own heads, then eight bytes a number.
            Self::Parquet => about(9_000 + 190 * steps as u64),
            Self::Animation => about(sheet::bytes_of_animation(source, part)),
            Self::Sheet => about(sheet::bytes_of_sheet(source, part)),
            Self::Report => about(25_000 + source.runs(part).len() as u64 * 530_000 + 330 * steps as u64),
            Self::Recording => about(recording_bytes(source, part)),
        }
    }
}

/// The images of every stop as PNG, and what the steps saw.
fn recording_bytes(source: &Source, part: Part) -> u64 {
    let runs = source.runs(part);
    let mut stops: Vec<usize> = runs.iter().flat_map(|run| &run.run.steps).map(|trace| trace.step).collect();
    let steps = stops.len() as u64;
    stops.sort_unstable();
    stops.dedup();
    let pixels = |step: usize| {
        let traverse = &source.open.traverse;
        [traverse.left_camera(step), traverse.right_camera(step)]
            .iter()
            .map(|camera| u64::from(camera.size[0]) * u64::from(camera.size[1]))
            .sum::<u64>()
    };
    let images: u64 = stops.iter().map(|step| pixels(*step) * 7 / 10).sum();
    400_000 + images + 45_000 * steps
}

/// Everything that can be exported of a part of a session.
pub fn catalogue(source: &Source, part: Part) -> Vec<ExportEntry> {
    let entry = |kind: Kind| {
        let part = source.narrowed(kind, part);
        let query = part.query();
        let session = &source.session.id;
        ExportEntry {
            name: kind.name().to_owned(),
            title: kind.title().to_owned(),
            sentence: kind.sentence().to_owned(),
            file: source.file_name(kind, part),
            size: kind.size(source, part),
            path: format!("sessions/{session}/exports/{}{query}", kind.name()),
            command: format!("sightline export {} --session {session}{}", kind.name(), part.arguments()),
        }
    };
    Kind::ALL.into_iter().map(entry).collect()
}

impl Part {
    /// The query of a path.
    fn query(self) -> String {
        match (self.target, self.run) {
            (Some(target), Some(run)) => format!("?target={target}&run={run}"),
            (Some(target), None) => format!("?target={target}"),
            _ => String::new(),
        }
    }

    /// Arguments of the command line, behind a space.
    fn arguments(self) -> String {
        match (self.target, self.run) {
            (Some(target), Some(run)) => format!(" --run {target}/{run}"),
            (Some(target), None) => format!(" --run {target}"),
            _ => String::new(),
        }
    }
}
