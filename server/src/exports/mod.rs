//! Exports a session as files, for papers, scripts and other programs.
//!
//! [`make`] creates every file, for REST and the command line; `kind` lists the formats. Exports run in their own lane and
//! are cancelled when the request is dropped.

pub(crate) mod kind;
pub(crate) mod catalogue;
pub(crate) mod source;
pub(crate) mod rows;
pub(crate) mod step_image;
pub(crate) mod sheet;
pub(crate) mod report;
mod report_steps;
pub(crate) mod bundle;
mod canvas;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use tempfile::TempDir;

use crate::problem::{ApiError, ApiResult};
use crate::rerun_log::{self, RunLog};

pub(crate) use kind::{ExportFormat, SessionPart};
pub(crate) use report::note_html;
pub(crate) use sheet::run_letter;
pub(crate) use source::Source;

/// A finished export.
pub(crate) enum ExportedFile {
    /// In memory.
    Bytes(Vec<u8>),
    /// A file in a temporary folder, which is removed with this value.
    File(std::fs::File, TempDir),
}

/// Creates a file; `progress` receives the number of finished parts and their total, if known.
///
/// # Errors
/// A problem if there is nothing to export, an image cannot be read, or `cancel` was set.
pub(crate) fn make(
    source: &Source,
    kind: ExportFormat,
    part: SessionPart,
    cancel: &AtomicBool,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> ApiResult<ExportedFile> {
    let part = source.resolve_part(kind, part);
    Ok(match kind {
        ExportFormat::Jsonl => ExportedFile::Bytes(rows::jsonl(source, part, cancel.into())?.into_bytes()),
        ExportFormat::Csv => ExportedFile::Bytes(rows::csv(source, part, cancel.into())?.into_bytes()),
        ExportFormat::Parquet => ExportedFile::Bytes(rows::parquet(source, part, cancel.into())?),
        ExportFormat::Animation => ExportedFile::Bytes(sheet::animation(source, part, cancel)?),
        ExportFormat::Sheet => ExportedFile::Bytes(sheet::sheet(source, part, cancel)?),
        ExportFormat::Report => ExportedFile::Bytes(report::html(source, part, cancel)?.into_bytes()),
        ExportFormat::Bundle => ExportedFile::Bytes(bundle::json(source, part, cancel.into())?.into_bytes()),
        ExportFormat::Recording => recording(source, part, cancel, progress)?,
    })
}

/// A Rerun recording in a temporary folder.
fn recording(
    source: &Source,
    part: SessionPart,
    cancel: &AtomicBool,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> ApiResult<ExportedFile> {
    let internal = |error: std::io::Error| ApiError::internal(format!("cannot write a recording: {error}"));
    let folder = tempfile::tempdir().map_err(internal)?;
    let path = folder.path().join("session.rrd");
    let runs = source.runs(part);
    let runs: Vec<RunLog<'_>> = runs
        .iter()
        .map(|run| RunLog {
            target: run.target,
            run: run.number,
            label: &run.record.label,
            steps: &run.run.steps,
        })
        .collect();
    let mut tell = |k, n| {
        let is_cancelled = cancel.load(Ordering::Relaxed);
        if is_cancelled { ControlFlow::Break(()) } else { progress(k, n) }
    };
    let traverse = &source.open.traverse;
    let drive = source.drive.as_ref();
    rerun_log::export(&path, &traverse.index().name, traverse, (&runs, drive), &mut tell)?;
    Ok(ExportedFile::File(std::fs::File::open(&path).map_err(internal)?, folder))
}
