//! The visual target tracker.
