//! Why the feature tracker found no target, rendered to a sentence in the record.

/// Why there is no position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FeatureFailure {
    /// Settings contradict each other.
    #[error("{0}")]
    Settings(String),
    /// The result is not wanted any more; it is discarded.
    #[error("the step was cancelled")]
    Cancelled,
    /// The memory is empty.
    #[error("no earlier stop with features is remembered")]
    NoAnchor,
    /// No remembered stop gives a motion.
    #[error("no motion since step {step}: {reason}")]
    NoMotion {
        /// The newest remembered stop.
        step: usize,
        /// Why the fit failed there.
        reason: String,
    },
}
