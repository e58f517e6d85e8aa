//! The wheel tracks that a drive leaves on the ground.
//!
//! Each wheel draws one line: the places over which its axle passed, piece after piece of every leg
//! (`course.rs`), as high as the ground that it touched. (Where it touches hops from stone to stone; where it
//! goes does not.) Where slip was staged the wheels turned on the spot, and the line stands still there.
//! The six lines lie on the ground as it was before the wheels sank in; how wide and how deep they are is with
//! them, drawing them is the ground's part (`imprint.rs`).
//!
//! Frame: site, m. Sources: papers.md R142; domain.md 5.4 (wheels).

use sightline_geometry::frames::Point3;

use crate::rover::scene::TrueDrive;
use crate::rover::suspension::{Stand, axles_in_rover};
use crate::scenario::RoverSettings;

/// The track of one wheel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Polyline {
    /// The wheel, in the order of `suspension::WHEELS_M`.
    pub wheel: usize,
    /// Points of its middle line on the ground, in the order in which they were passed, site frame, m.
    pub points_in_site: Vec<Point3>,
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
        let mut tracks = Self { lines: Vec::new(), laid: vec![0; drive.stops.len()] };
        if !settings.tracks {
            return tracks;
        }
        let stands = drive.legs.iter().flat_map(|leg| &leg.stands);
        let places: Vec<[Point3; 6]> = stands.map(below_axles).collect();
        tracks.lines = (0..6)
            .map(|wheel| Polyline {
                wheel,
                points_in_site: places.iter().map(|place| place[wheel]).collect(),
                width_m: settings.track_width_m,
                depth_m: settings.track_depth_m,
            })
            .collect();
        let mut points = 0;
        for (laid, leg) in tracks.laid.iter_mut().skip(1).zip(&drive.legs) {
            points += leg.stands.len();
            *laid = points;
        }
        tracks
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

/// The places below a rover's axles, as high as what each wheel touches.
fn below_axles(stand: &Stand) -> [Point3; 6] {
    let axles = axles_in_rover(&stand.angles).map(|axle| stand.site_from_rover * axle);
    std::array::from_fn(|wheel| Point3::new(axles[wheel].x, axles[wheel].y, stand.contacts_in_site[wheel].z))
}
