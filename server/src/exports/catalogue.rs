//! The catalogue of exports: every file available for a part of a session, with its size.

use sightline_api::endpoint;
use sightline_api::endpoints::ExportFile;
use sightline_api::location::AtExport;
use sightline_session::exports::{ExportEntry, Size};

use sightline_geometry::camera::{Camera, CameraName};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_rover::pair;

use super::kind::{ExportFormat, SessionPart};
use super::source::Source;
use super::{bundle, rows, sheet};

/// Size of the file, exact or estimated.
///
/// # Errors
/// [`Error::Cancelled`](sightline_geometry::error::Error::Cancelled).
fn size(kind: ExportFormat, source: &Source, part: SessionPart, cancel: Cancel<'_>) -> Result<Size> {
    let exact = |bytes: usize| Size { bytes: bytes as u64, is_exact: true };
    let about = |bytes: u64| Size { bytes, is_exact: false };
    let steps: usize = source.runs(part).iter().map(|run| run.run.steps.len()).sum();
    Ok(match kind {
        ExportFormat::Jsonl => exact(rows::jsonl(source, part, cancel)?.len()),
        ExportFormat::Csv => exact(rows::csv(source, part, cancel)?.len()),
        ExportFormat::Bundle => exact(bundle::json(source, part, cancel)?.len()),
        // About 310 bytes of headers per column and 7 bytes per number.
        ExportFormat::Parquet => about(rows::column_count() * (310 + 7 * steps as u64)),
        ExportFormat::Animation => about(sheet::bytes_of_animation(source, part)),
        ExportFormat::Sheet => about(sheet::bytes_of_sheet(source, part)),
        ExportFormat::Report => about(25_000 + source.runs(part).len() as u64 * 530_000 + 330 * steps as u64),
        ExportFormat::Recording => about(recording_bytes(source, part)),
    })
}

/// Size of the images of every stop as PNG, and of the logged data of the steps.
fn recording_bytes(source: &Source, part: SessionPart) -> u64 {
    let runs = source.runs(part);
    let traces = runs.iter().flat_map(|run| &run.run.steps);
    let mut stops: Vec<_> =
        traces.map(|trace| (trace.step, trace.update.target.designation.camera)).collect();
    let steps = stops.len() as u64;
    stops.sort_unstable();
    stops.dedup();
    let pixels = |(step, camera): (usize, Option<CameraName>)| {
        let pair = pair::of_stop(&source.open.traverse, step, camera);
        let size = |camera: &Camera| u64::from(camera.size[0]) * u64::from(camera.size[1]);
        pair.map_or(0, |pair| size(pair.left) + size(pair.right))
    };
    let images: u64 = stops.iter().map(|stop| pixels(*stop) * 7 / 10).sum();
    400_000 + images + 45_000 * steps
}

/// The exports available for a part of a session.
///
/// # Errors
/// [`Error::Cancelled`](sightline_geometry::error::Error::Cancelled).
pub(crate) fn catalogue(source: &Source, part: SessionPart, cancel: Cancel<'_>) -> Result<Vec<ExportEntry>> {
    let entry = |kind: ExportFormat| {
        let part = source.resolve_part(kind, part);
        let session = &source.session.id;
        let at = AtExport { session: session.clone(), file: kind.name().to_owned() };
        Ok(ExportEntry {
            name: kind.name().to_owned(),
            title: kind.title().to_owned(),
            sentence: kind.sentence().to_owned(),
            file: source.file_name(kind, part),
            size: size(kind, source, part, cancel)?,
            path: endpoint::path::<ExportFile>(&at, &part),
            command: format!("sightline export {} --session {session}{}", kind.name(), arguments(part)),
        })
    };
    ExportFormat::ALL.into_iter().map(entry).collect()
}

/// Command-line arguments that select this part, with a leading space.
fn arguments(part: SessionPart) -> String {
    match (part.target, part.run) {
        (Some(target), Some(run)) => format!(" --run {target}/{run}"),
        (Some(target), None) => format!(" --run {target}"),
        _ => String::new(),
    }
}
