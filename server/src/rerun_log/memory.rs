//! A recording in memory: for the export, which writes it to a file, and for the rows of a layout.
//!
//! Rerun's memory sink and its stream own each other (`MemorySinkStorage::rec` in re_sdk 0.36), so neither would be freed,
//! nor their eight threads. The stream is therefore disconnected from its sink when dropped.

use rerun::log::LogMsg;
use rerun::sink::MemorySinkStorage;
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

/// A stream with its logged messages.
pub(super) struct MemoryStream {
    stream: RecordingStream,
    gathered: MemorySinkStorage,
}

impl MemoryStream {
    /// Opens the stream described by `builder`.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub(super) fn open(builder: RecordingStreamBuilder) -> RecordingStreamResult<Self> {
        let (stream, gathered) = builder.memory()?;
        Ok(Self { stream, gathered })
    }

    /// The stream to log to. A clone must not outlive this value: its messages would be lost.
    pub(super) const fn stream(&self) -> &RecordingStream {
        &self.stream
    }

    /// The messages since the last call.
    pub(super) fn take(&self) -> Vec<LogMsg> {
        self.gathered.take()
    }
}

impl Drop for MemoryStream {
    fn drop(&mut self) {
        // Discards the messages of a failed export, which the new sink would receive.
        drop(self.gathered.take());
        self.stream.disconnect();
    }
}
