//! Writes a recording as an `.rrd` file: to a temporary file first, which is then renamed.

use std::collections::BTreeSet;
use std::io::BufWriter;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::log::ChunkBatcherConfig;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::files::{PartialFile, remove_left_overs_of};
use sightline_rover::pipeline::Stops;

use super::drive::DriveLog;
use super::memory::MemoryStream;
use super::recorder::{Recorder, RunLog, builder};

/// Number of steps per batch: rows of one entity then share a chunk.
const STEPS_AT_ONCE: usize = 16;

/// Size at which a chunk of one entity is closed, bytes.
const CHUNK_BYTES: u64 = 4 << 20;

/// Writes `runs` and a drive with their layout to the new file `path`.
///
/// `progress` receives the number of finished steps and their total; if it breaks, no file remains.
///
/// # Errors
/// [`Error::Cancelled`] when `progress` breaks; [`Error::Write`] when the file exists or cannot be written.
pub fn export(
    path: &Path,
    traverse_name: &str,
    stops: &dyn Stops,
    (runs, drive): (&[RunLog<'_>], Option<&DriveLog>),
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<()> {
    if path.exists() {
        return Err(failed(path, "the file exists already; choose another name"));
    }
    remove_left_overs_of(path);
    write(PartialFile::create(path)?, path, traverse_name, stops, (runs, drive), progress)?.complete_new()
}

fn write(
    file: PartialFile,
    path: &Path,
    traverse_name: &str,
    stops: &dyn Stops,
    (runs, drive): (&[RunLog<'_>], Option<&DriveLog>),
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<PartialFile> {
    let wrong = |error: &dyn std::fmt::Display| failed(path, &error.to_string());
    let gather =
        ChunkBatcherConfig { flush_tick: Duration::MAX, flush_num_bytes: CHUNK_BYTES, ..Default::default() };
    let memory = MemoryStream::open(builder(traverse_name)?.batcher_config(gather));
    let memory = memory.map_err(|error| wrong(&error))?;
    let mut recorder = Recorder::new(memory.stream().clone(), false);
    let mut file = RrdFile::begin(file, path)?;
    recorder
        .log_runs(runs, stops)
        .and_then(|()| recorder.log_traverse(traverse_name, stops))
        .and_then(|()| drive.map_or(Ok(()), |drive| recorder.log_drive(drive, stops)))
        .map_err(|e| wrong(&e))?;
    let all: BTreeSet<usize> = runs.iter().flat_map(|run| run.steps).map(|trace| trace.step).collect();
    for (done, step) in all.iter().enumerate() {
        if progress(done, all.len()).is_break() {
            return Err(Error::Cancelled);
        }
        for run in runs {
            for trace in run.steps.iter().filter(|trace| trace.step == *step) {
                recorder.log_step(run, stops, trace).map_err(|error| wrong(&error))?;
            }
        }
        if done % STEPS_AT_ONCE == STEPS_AT_ONCE - 1 {
            file.append(&memory)?;
        }
    }
    file.append(&memory)?;
    let file = file.finish()?;
    // The file is complete, so a break has no effect.
    let _ = progress(all.len(), all.len());
    Ok(file)
}

/// An `.rrd` file being written. Rerun's own file sink reports a full disk only in its log, so it is not used.
struct RrdFile<'a> {
    path: &'a Path,
    encoder: Encoder<BufWriter<PartialFile>>,
}

impl<'a> RrdFile<'a> {
    fn begin(file: PartialFile, path: &'a Path) -> Result<Self> {
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let encoder = Encoder::new_eager(CrateVersion::LOCAL, options, BufWriter::new(file));
        Ok(Self { path, encoder: encoder.map_err(|error| failed(path, &error.to_string()))? })
    }

    fn append(&mut self, memory: &MemoryStream) -> Result<()> {
        for message in memory.take() {
            self.encoder.append(&message).map_err(|error| failed(self.path, &error.to_string()))?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<PartialFile> {
        self.encoder.finish().map_err(|error| failed(self.path, &error.to_string()))?;
        let file = self.encoder.into_inner().map_err(|error| failed(self.path, &error.to_string()))?;
        file.into_inner()
            .map_err(|error| Error::Write { path: self.path.to_owned(), source: error.into_error() })
    }
}

fn failed(path: &Path, problem: &str) -> Error {
    Error::Write { path: path.to_owned(), source: std::io::Error::other(problem.to_owned()) }
}
