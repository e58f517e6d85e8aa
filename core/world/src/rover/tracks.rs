//! The wheel tracks that a drive leaves on the ground.
//!
//! Each wheel draws one line: the places over which its axle passed, piece after piece of every leg (`course.rs`). (Where it
//! touches hops from stone to stone; where it goes does not.) Where slip was staged the wheels turned on the spot, and the
//! line stands still there. How wide and how deep the six lines are is with them, drawing them is the ground's part
//! (`imprint.rs`).
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
    /// x and y of the points of its middle line, in the order in which they were passed, site frame, m.
    pub points_in_site: Vec<[f64; 2]>,
    /// Its width, m.
    pub width_m: f64,
    /// How deep the wheel sank in, m.
    pub depth_m: f64,
}

/// The tracks of a drive.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tracks {
    lines: Vec<Polyline>,
    laid: Vec<usize>,
}

impl Tracks {
    /// The tracks of a drive; none where the settings leave no tracks.
    pub(crate) fn new(drive: &TrueDrive, settings: &RoverSettings) -> Self {
        if !settings.tracks {
            return Self { lines: Vec::new(), laid: vec![0; drive.stops.len()] };
        }
        let legs = drive.legs.iter().map(places_m);
        let ways: Vec<Vec<WheelPlaces>> = std::iter::once(Vec::new()).chain(legs).collect();
        Self::through(&ways, settings)
    }

    /// The tracks through the places that the wheels passed on the way to each stop, m.
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

    /// How many points of each line are laid when the rover stands at each stop; none at the first.
    pub(crate) fn laid(&self) -> &[usize] {
        &self.laid
    }
}

/// The places that the wheels pass in a leg, m.
pub(crate) fn places_m(leg: &Leg) -> Vec<WheelPlaces> {
    leg.stands.iter().map(below_axles).collect()
}

/// The places below a rover's axles.
fn below_axles(stand: &Stand) -> WheelPlaces {
    axles_in_rover(&stand.angles).map(|axle| {
        let place = stand.site_from_rover * axle;
        [place.x, place.y]
    })
}
