//! Name, version, limits and state of the server program.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The largest body of a request, bytes: a session with 500 notes of 4,000 characters each, with its runs, fits.
pub const BODY_BYTES: usize = 8 << 20;

/// What this program is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Version {
    /// The program's name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// The version of the folders of traverses.
    pub traverse_format: u32,
    /// The version of saved sessions.
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

/// Whether the server is well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Health {
    /// `ok`.
    pub status: String,
    /// What a person should know about this start of the server, one sentence each.
    pub notices: Vec<String>,
}
