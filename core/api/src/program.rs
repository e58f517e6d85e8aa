//! Name, version, limits and state of the server program.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The default of the server's limit `file_bytes`, bytes: the largest exported session that it accepts. A session with
/// 500 notes of 4,000 characters each fits.
pub const FILE_BYTES: usize = 8 << 20;

/// Name, version and limits of the server program.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Version {
    /// The program's name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// The version of the format of traverse folders.
    pub traverse_format: u32,
    /// The version of the format of saved sessions.
    pub session_format: u32,
    /// The limits in force.
    pub limits: Limits,
}

/// The limits in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[schema(as = ProgramLimits)]
pub struct Limits {
    /// The largest body of a request, bytes.
    pub body_bytes: usize,
    /// How many targets a session may have.
    pub targets: usize,
    /// How many runs a target may have.
    pub runs: usize,
}

/// The health and resource usage of the server.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Health {
    /// `ok`.
    pub status: String,
    /// Notices about this start of the server, one sentence each.
    pub notices: Vec<String>,
    /// The resources that the server uses.
    pub usage: Usage,
}

/// The resources that the server uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Usage {
    /// Open connections.
    pub connections: usize,
    /// Images, features, surfaces and motions in memory, bytes (limit `cache_bytes`).
    pub cache_bytes: usize,
    /// Steps of runs in memory, bytes, an upper bound (limit `step_bytes`).
    pub step_bytes: usize,
    /// Answers to requests with an Idempotency-Key in memory, bytes (limit `answer_bytes`).
    pub answer_bytes: usize,
    /// Threads of the process; null if the system does not report them.
    pub threads: Option<u64>,
    /// Resident memory of the process, bytes; null if the system does not report it.
    pub resident_bytes: Option<u64>,
}
