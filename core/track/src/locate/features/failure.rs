//! Why the feature tracker found no target, rendered to a sentence in the record.

/// Why there is no position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FeatureFailure {
    /// Settings contradict each other.
    #[error("{0}")]
    Settings(String),
    /// The step was cancelled; its result is discarded.
    #[error("the step was cancelled")]
    Cancelled,
    /// No stop is remembered.
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
