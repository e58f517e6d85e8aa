//! Small things that are known: how the server is reached, how far a run is, where a target could not be picked.

use sightline_core::frames::Pixel;

/// How the server's events come in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Connection {
    /// The first attempt is under way.
    #[default]
    Connecting,
    /// Events come in.
    Live,
    /// The server does not answer.
    Gone {
        /// Attempts so far.
        attempts: u32,
    },
}

/// How far a run is.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Steps done.
    pub k: usize,
    /// Steps in all.
    pub n: usize,
    /// What is being done.
    pub doing: String,
}

/// A place in the left image of a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The stop.
    pub step: usize,
    /// The position, px.
    pub pixel: Pixel,
}

/// Why a target was not designated.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Where.
    pub place: Place,
    /// What the server said, or what the map of trackability says of the place.
    pub sentence: String,
    /// The nearest pixel that would do.
    pub nearest: Option<Pixel>,
    /// Whether the place was not tried: a person may insist on it.
    pub is_advice: bool,
}
