//! The wheel tracks that a drive leaves on the ground.
//!
//! Each wheel leaves one line: the points under its axle, piece after piece of every leg (`course.rs`). (Contact points
//! jump from stone to stone; axles do not.) Under forced slip the wheels turn on the spot, and the line does not advance.
//! The lines have a width and a depth; `imprint.rs` renders them.
//!
//! Frame: site, m. Sources: papers.md R142; domain.md 5.4 (wheels).

use crate::rover::scene::{Leg, TrueDrive};
use crate::rover::suspension::{Stand, axles_in_rover};
use crate::scenario::RoverSettings;
use crate::traverse::WheelPlaces;

/// The track of one wheel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Polyline {
    /// The wheel, in the order of `suspension::WHEELS_M`.
    pub wheel: usize,
    /// x and y of the points of its centre line, in driving order, site frame, m.
    pub points_in_site: Vec<[f64; 2]>,
    /// Width, m.
    pub width_m: f64,
    /// Sinkage of the wheel, m.
    pub depth_m: f64,
}

/// The tracks of a drive.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tracks {
    lines: Vec<Polyline>,
    laid: Vec<usize>,
}

impl Tracks {
    /// The tracks of a drive; empty if the settings leave no tracks.
    pub(crate) fn new(drive: &TrueDrive, settings: &RoverSettings) -> Self {
        if !settings.tracks {
            return Self { lines: Vec::new(), laid: vec![0; drive.stops.len()] };
        }
        let legs = drive.legs.iter().map(places_m);
        let ways: Vec<Vec<WheelPlaces>> = std::iter::once(Vec::new()).chain(legs).collect();
        Self::through(&ways, settings)
    }

    /// The tracks through the wheel positions on the way to each stop, m.
    pub(crate) fn through(places_m: &[Vec<WheelPlaces>], settings: &RoverSettings) -> Self {
        let line = |wheel: usize| Polyline {
            wheel,
            points_in_site: places_m.iter().flatten().map(|place| place[wheel]).collect(),
            width_m: settings.track_width_m,
            depth_m: settings.track_depth_m,
        };
        let laid = places_m.iter().scan(0, |laid, places| {
            *laid += places.len();
            Some(*laid)
        });
        Self { lines: (0..6).map(line).collect(), laid: laid.collect() }
    }

    /// The lines of the whole drive.
    pub(crate) fn lines(&self) -> &[Polyline] {
        &self.lines
    }

    /// Number of points of each line that exist at each stop; 0 at the first.
    pub(crate) fn laid(&self) -> &[usize] {
        &self.laid
    }
}

/// The wheel positions of a leg, m.
pub(crate) fn places_m(leg: &Leg) -> Vec<WheelPlaces> {
    leg.stands.iter().map(below_axles).collect()
}

/// The points below a rover's axles.
fn below_axles(stand: &Stand) -> WheelPlaces {
    axles_in_rover(&stand.angles).map(|axle| {
        let place = stand.site_from_rover * axle;
        [place.x, place.y]
    })
}
