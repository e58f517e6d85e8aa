//! A session as files, for papers, scripts and other programs.
//!
//! Every file is made by [`make`], for REST and the command line alike; `kind` lists them. What is made takes its time in a
//! lane of its own, and ends when the request goes away.

pub(crate) mod kind;
pub(crate) mod catalogue;
pub(crate) mod source;
pub(crate) mod rows;
pub(crate) mod picture;
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

pub(crate) use kind::{Kind, Part};
pub(crate) use report::note_html;
pub(crate) use sheet::run_letter;
pub(crate) use source::Source;

/// What was made.
pub(crate) enum Made {
    /// In memory.
    Bytes(Vec<u8>),
    /// A file in a folder of its own, which is removed with this value.
    File(std::fs::File, TempDir),
}

/// Makes a file; `progress` is told what is done of how much, where that is known.
///
/// # Errors
/// A problem when there is nothing to export, an image cannot be read, or `cancel` was set.
pub(crate) fn make(
    source: &Source,
    kind: Kind,
    part: Part,
    cancel: &AtomicBool,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> ApiResult<Made> {
    let part = source.narrowed(kind, part);
    Ok(match kind {
        Kind::Jsonl => Made::Bytes(rows::jsonl(source, part, cancel.into())?.into_bytes()),
        Kind::Csv => Made::Bytes(rows::csv(source, part, cancel.into())?.into_bytes()),
        Kind::Parquet => Made::Bytes(rows::parquet(source, part, cancel.into())?),
        Kind::Animation => Made::Bytes(sheet::animation(source, part, cancel)?),
        Kind::Sheet => Made::Bytes(sheet::sheet(source, part, cancel)?),
        Kind::Report => Made::Bytes(report::html(source, part, cancel)?.into_bytes()),
        Kind::Bundle => Made::Bytes(bundle::json(source, part, cancel.into())?.into_bytes()),
        Kind::Recording => recording(source, part, cancel, progress)?,
    })
}

/// A Rerun recording in a temporary folder.
fn recording(
    source: &Source,
    part: Part,
    cancel: &AtomicBool,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> ApiResult<Made> {
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
    Ok(Made::File(std::fs::File::open(&path).map_err(internal)?, folder))
}
