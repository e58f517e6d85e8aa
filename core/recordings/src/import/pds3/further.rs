//! Images of other cameras, taken at the rover position of a stop: the stop's further cameras.
//!
//! An image belongs to the stop with its SITE and DRIVE that is nearest in time. Left and right image of one moment
//! are a pair with the name of their camera family (`front_hazcam`); any other image is a single camera with the name
//! of its instrument (`front_hazcam_left`). Of several with the same name, the one nearest in time to the stop is used.

use std::sync::Arc;

use sightline_geometry::camera::CameraName;

use super::pairs::{Frame, Pair, pair_up};

/// A further camera of a stop.
#[derive(Clone)]
pub(super) struct Further {
    pub(super) name: CameraName,
    pub(super) left: Arc<Frame>,
    /// `None` for a single camera.
    pub(super) right: Option<Arc<Frame>>,
}

impl Further {
    pub(super) fn uses(&self, frame: &Frame) -> bool {
        let is_same = |own: &Arc<Frame>| own.product.path == frame.product.path;
        is_same(&self.left) || self.right.as_ref().is_some_and(is_same)
    }
}

/// The further cameras of each stop, from images that no stop uses.
pub(super) fn further(stops: &[Pair], unused: &[Arc<Frame>]) -> Vec<Vec<Further>> {
    let of_stop = |number: usize| {
        let own = unused.iter().filter(|frame| stop_of(stops, frame) == Some(number));
        cameras(&stops[number], own.cloned().collect())
    };
    (0..stops.len()).map(of_stop).collect()
}

/// The stop to which an image of another camera belongs.
fn stop_of(stops: &[Pair], frame: &Frame) -> Option<usize> {
    let here = stops
        .iter()
        .enumerate()
        .filter(|(_, stop)| frame.is_same_place(&stop.left) && frame.family() != stop.left.family());
    here.min_by(|(_, a), (_, b)| apart_s(frame, a).total_cmp(&apart_s(frame, b))).map(|(number, _)| number)
}

/// Time between an image and the left one of a stop, s; infinite without clocks.
fn apart_s(frame: &Frame, stop: &Pair) -> f64 {
    let clocks = frame.product.clock_s().zip(stop.left.product.clock_s());
    clocks.map_or(f64::INFINITY, |(a, b)| (a - b).abs())
}

fn cameras(stop: &Pair, mut frames: Vec<Arc<Frame>>) -> Vec<Further> {
    frames.sort_by(|a, b| apart_s(a, stop).total_cmp(&apart_s(b, stop)));
    let pairs = pair_up(&frames, Pair::is_lateral);
    let is_single = |frame: &&Arc<Frame>| !pairs.iter().any(|pair| pair.uses(frame));
    let singles = frames.iter().filter(is_single);
    let named = |name: &str, left: &Arc<Frame>, right: Option<&Arc<Frame>>| {
        let name = name.to_lowercase().parse().ok()?;
        Some(Further { name, left: Arc::clone(left), right: right.cloned() })
    };
    let of_pairs = pairs.iter().map(|pair| named(&pair.left.family(), &pair.left, Some(&pair.right)));
    let of_singles = singles.map(|frame| named(frame.product.instrument(), frame, None));
    let mut cameras: Vec<Further> = Vec::new();
    for camera in of_pairs.chain(of_singles).flatten() {
        if cameras.iter().all(|other| other.name != camera.name) {
            cameras.push(camera);
        }
    }
    cameras
}
