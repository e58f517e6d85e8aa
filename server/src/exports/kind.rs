//! The kinds of exported files: name, media type, title and description.

pub(crate) use sightline_api::query::SessionPart;

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ExportFormat {
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
    /// Everything needed to reproduce the rows.
    Bundle,
}

impl ExportFormat {
    /// All of them, in the order of the menu.
    pub(crate) const ALL: [Self; 8] = [
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
    pub(crate) const fn name(self) -> &'static str {
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

    /// The kind of a file name.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The media type.
    pub(crate) const fn media_type(self) -> &'static str {
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

    /// The title in a menu.
    pub(crate) const fn title(self) -> &'static str {
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

    /// Contents and purpose, as one sentence.
    pub(crate) const fn sentence(self) -> &'static str {
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
                "One HTML page that needs nothing else: metrics, why the target was lost, worst steps with pictures, notes, settings; printable."
            }
            Self::Bundle => {
                "Settings, seed, versions, hashes and commands with which anybody gets the same rows, bit for bit."
            }
        }
    }

    /// Whether the file shows exactly one run.
    pub(crate) const fn is_of_one_run(self) -> bool {
        matches!(self, Self::Animation | Self::Sheet)
    }
}
