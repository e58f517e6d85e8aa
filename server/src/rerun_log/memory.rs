//! A recording that is gathered in memory: for the export, which writes it to a file, and for the rows of a layout.
//!
//! Rerun's memory sink owns the stream that owns it (`MemorySinkStorage::rec` in re_sdk 0.36), so that neither would
//! be freed, nor their eight threads. The stream is therefore disconnected from its sink when it is dropped.

use rerun::log::LogMsg;
use rerun::sink::MemorySinkStorage;
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

/// A stream with the messages that were logged to it.
pub(super) struct MemoryStream {
    stream: RecordingStream,
    gathered: MemorySinkStorage,
}

impl MemoryStream {
    /// Opens the stream that `builder` describes.
    ///
    /// # Errors
    /// A system that starts no thread.
    pub(super) fn open(builder: RecordingStreamBuilder) -> RecordingStreamResult<Self> {
        let (stream, gathered) = builder.memory()?;
        Ok(Self { stream, gathered })
    }

    /// The stream to log to. A clone must not outlive this value: its messages would go nowhere.
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
        // Messages of an export that failed; the new sink would take them over.
        drop(self.gathered.take());
        self.stream.disconnect();
    }
}
