//! A live recording: the bytes of an `.rrd` file that grows with its session and is never complete.
//!
//! Each viewer has its own value and gets the whole recording; nothing is stored for future viewers. The memory of a value
//! is one batch of steps.

use std::io::{self, Write};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rerun::external::re_build_info::CrateVersion;
use rerun::external::re_log_encoding::{Encoder, EncodingOptions};
use rerun::log::ChunkBatcherConfig;
use sightline_geometry::error::{Error, Result};
use sightline_rover::pipeline::Stops;
use sightline_session::Session;

use super::drive::DriveLog;
use super::memory::MemoryStream;
use super::recorder::{Recorder, RunLog, builder};
use crate::jobs::lock;

/// Steps of one batch, a bound on its memory and on the delay of the first bytes.
const STEPS_AT_ONCE: usize = 4;

/// A live recording for one viewer.
pub struct LiveRecording {
    memory: MemoryStream,
    recorder: Recorder,
    encoder: Encoder<Buffer>,
    encoded: Buffer,
}

impl LiveRecording {
    /// Starts an empty recording.
    ///
    /// # Errors
    /// [`Error::Request`] when rerun cannot start its threads.
    pub fn start() -> Result<Self> {
        let gather = ChunkBatcherConfig { flush_tick: Duration::MAX, ..Default::default() };
        let memory = MemoryStream::open(builder("live")?.batcher_config(gather));
        let memory = memory.map_err(|error| refused(&error))?;
        let encoded = Buffer::default();
        let options = EncodingOptions::PROTOBUF_COMPRESSED;
        let encoder = Encoder::new_eager(CrateVersion::LOCAL, options, encoded.clone());
        let mut encoder = encoder.map_err(|error| refused(&error))?;
        // The footer lists every chunk, so for an endless recording it would grow without bound.
        encoder.do_not_emit_footer();
        let recorder = Recorder::new(memory.stream().clone(), true);
        Ok(Self { memory, recorder, encoder, encoded })
    }

    /// Logs the decisions of the drive and the next steps of the session that are missing in the recording; returns their
    /// bytes, or none if the recording is up to date.
    ///
    /// # Errors
    /// [`Error::Request`] when rerun cannot take the rows.
    pub fn advance(
        &mut self,
        traverse_name: &str,
        stops: &dyn Stops,
        session: &Session,
        drive: Option<&DriveLog>,
    ) -> Result<Vec<u8>> {
        let live = session.targets.iter().enumerate().filter(|(_, target)| !target.removed);
        let runs: Vec<_> = live
            .flat_map(|(number, target)| {
                let runs = target.runs.iter().enumerate().filter(|(_, record)| !record.removed);
                runs.map(move |(run, record)| RunLog {
                    target: number,
                    run,
                    label: &target.label,
                    // A row is logged once, so a paused step is logged when it is complete.
                    steps: record.whole_steps(),
                })
            })
            .collect();
        let recorder = &mut self.recorder;
        recorder
            .log_traverse(traverse_name, stops)
            .and_then(|()| recorder.log_runs(&runs, stops))
            .and_then(|()| drive.map_or(Ok(()), |drive| recorder.log_drive(drive, stops)))
            .map_err(|error| refused(&error))?;
        let all = runs.iter().flat_map(|run| run.steps.iter().map(move |step| (run, step)));
        let missing: Vec<_> =
            all.filter(|(run, step)| !recorder.has(run, step)).take(STEPS_AT_ONCE).collect();
        for (run, step) in missing {
            recorder.log_step(run, stops, step).map_err(|error| refused(&error))?;
        }
        for message in self.memory.take() {
            self.encoder.append(&message).map_err(|error| refused(&error))?;
        }
        Ok(self.encoded.take())
    }
}

/// The bytes that the encoder has written since the last call of `take`.
#[derive(Clone, Default)]
struct Buffer(Arc<Mutex<Vec<u8>>>);

impl Buffer {
    fn take(&self) -> Vec<u8> {
        std::mem::take(&mut lock(&self.0))
    }
}

impl Write for Buffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        lock(&self.0).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn refused(error: &dyn std::fmt::Display) -> Error {
    Error::Request(format!("the rerun stream could not be used: {error}"))
}
