//! The server.

pub mod rerun_log;
