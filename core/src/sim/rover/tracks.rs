//! The wheel tracks that a drive leaves on the ground.
//!
//! Each wheel draws one line: the points where it touched the ground, piece after piece of every leg
//! (`course.rs`). Where slip was staged the wheels turned on the spot, and the line stands still there.
//! The six lines lie on the ground as it was before the wheels sank in; how wide and how deep they are is with
//! them, drawing them is the ground's part.
//!
//! Frame: site, m. Sources: papers.md R142; domain.md 5.4 (wheels).

use crate::frames::Point3;

use crate::sim::rover::scene::TrueDrive;
use crate::sim::scenario::RoverSettings;

/// The track of one wheel.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
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
pub struct Tracks {
    lines: Vec<Polyline>,
    /// How many points of each line are laid when the rover stands at each stop.
    laid: Vec<usize>,
}

impl Tracks {
    /// The tracks of a drive; none where the settings leave no tracks.
    pub fn new(drive: &TrueDrive, settings: &RoverSettings) -> Self {
        let mut tracks = Self { lines: Vec::new(), laid: vec![0; drive.stops.len()] };
        if !settings.tracks {
            return tracks;
        }
        let stands = || drive.legs.iter().flat_map(|leg| &leg.stands);
        tracks.lines = (0..6)
            .map(|wheel| Polyline {
                wheel,
                points_in_site: stands().map(|stand| stand.contacts_in_site[wheel]).collect(),
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

    /// The tracks that lie on the ground when the rover stands at a stop; none at the first.
    pub fn tracks_until(&self, stop: usize) -> Vec<Polyline> {
        let points = self.laid.get(stop).or(self.laid.last()).copied().unwrap_or(0);
        if points == 0 {
            return Vec::new();
        }
        let until = |line: &Polyline| Polyline {
            points_in_site: line.points_in_site[..points].to_vec(),
            ..line.clone()
        };
        self.lines.iter().map(until).collect()
    }
}
