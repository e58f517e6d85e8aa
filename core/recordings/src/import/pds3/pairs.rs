//! Combines images to stops.
//!
//! Two images belong together if camera family, size, projection and processing are the same, and
//!
//! - *lateral*: one is of the left camera, one of the right, their motion counters are equal and their clocks differ
//!   by at most 2 s (domain.md 6.3);
//! - *convergent*: both are of one camera, SITE and DRIVE are equal (the rover did not move, domain.md 1.6), the
//!   pointing differs, and the views overlap. They are paired in the order of their clocks.
//!
//! Lateral pairs are preferred; all stops of a traverse are of the same camera family, the one with the most
//! stops.

use std::sync::Arc;

use super::product::Product;
use sightline_geometry::camera::Camera;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pixel, PoseRecord};
use sightline_geometry::stereo_geometry::StereoGeometry;

/// Largest difference of the clocks of a left and a right image of one moment, s.
const SAME_MOMENT_S: f64 = 2.0;
/// Number of positions along each side of the image at which the overlap of two views is tested.
const OVERLAP_GRID: u32 = 9;
/// Ranges at which it is tested, m.
const OVERLAP_RANGES_M: [f64; 4] = [1.0, 3.0, 10.0, 30.0];

/// A product that can be one view of a stop.
pub(super) struct Frame {
    pub(super) product: Product,
    pub(super) camera: Camera,
    pub(super) pose: PoseRecord,
}

#[derive(Clone, Copy, PartialEq)]
enum Eye {
    Left,
    Right,
}

impl Frame {
    pub(super) fn new(product: Product) -> Result<Self> {
        let (camera, pose) = (product.camera()?, product.site_from_rover()?);
        Ok(Self { product, camera, pose })
    }

    /// The site of the pose; `None` if the label lacks it.
    pub(super) fn site(&self) -> Option<f64> {
        self.product.motion_counter().map(|counter| counter[0])
    }

    fn eye(&self) -> Option<Eye> {
        match self.product.label.text("FRAME_ID") {
            Some("LEFT") => Some(Eye::Left),
            Some("RIGHT") => Some(Eye::Right),
            _ => None,
        }
    }

    /// The camera's name without its side: `NAVCAM` for `NAVCAM_LEFT`, `NAV_B` for `NAV_LEFT_B`.
    pub(super) fn family(&self) -> String {
        let parts = self.product.instrument().split('_');
        parts.filter(|part| !matches!(*part, "LEFT" | "RIGHT")).collect::<Vec<_>>().join("_")
    }

    /// Whether both images could be views of one stop, by camera family and processing.
    fn is_alike(&self, other: &Self) -> bool {
        let text = |frame: &Self, key: &str| frame.product.label.text(key).map(str::to_owned);
        let same = |key: &str| text(self, key) == text(other, key);
        self.family() == other.family()
            && self.camera.size == other.camera.size
            && same("GEOMETRY_PROJECTION_TYPE")
            && same("DATA_SET_ID")
    }

    fn is_same_moment(&self, other: &Self) -> bool {
        let clocks = self.product.clock_s().zip(other.product.clock_s());
        self.product.motion_counter().is_some()
            && self.product.motion_counter() == other.product.motion_counter()
            && clocks.is_some_and(|(a, b)| (a - b).abs() <= SAME_MOMENT_S)
    }

    pub(super) fn is_same_place(&self, other: &Self) -> bool {
        let place = |frame: &Self| frame.product.motion_counter().map(|counter| [counter[0], counter[1]]);
        place(self).is_some() && place(self) == place(other)
    }
}

/// The two views of one stop.
#[derive(Clone)]
pub(super) struct Pair {
    pub(super) left: Arc<Frame>,
    pub(super) right: Arc<Frame>,
}

impl Pair {
    pub(super) fn uses(&self, frame: &Frame) -> bool {
        [&self.left, &self.right].iter().any(|own| own.product.path == frame.product.path)
    }

    pub(super) fn is_lateral(&self) -> bool {
        self.left.eye() == Some(Eye::Left)
            && self.right.eye() == Some(Eye::Right)
            && self.left.is_alike(&self.right)
            && self.left.is_same_moment(&self.right)
    }

    fn is_convergent(&self) -> bool {
        self.left.product.instrument() == self.right.product.instrument()
            && self.left.is_alike(&self.right)
            && self.left.is_same_place(&self.right)
            && self.left.camera.model != self.right.camera.model
            && self.overlaps()
    }

    /// The second camera in the first's rover frame.
    pub(super) fn right_camera_in_left_rover(&self) -> Camera {
        self.camera_in_left_rover(&self.right)
    }

    /// The camera of an image in the rover frame of the first one; the rover may have settled between.
    pub(super) fn camera_in_left_rover(&self, frame: &Frame) -> Camera {
        if self.left.pose == frame.pose {
            return frame.camera.clone();
        }
        let left_rover_from_site = self.left.pose.to_pose().inverse();
        frame.camera.moved(&(left_rover_from_site * frame.pose.to_pose()))
    }

    /// Whether any point of the first view, at a typical range, is visible in the second.
    fn overlaps(&self) -> bool {
        let (left, right) = (&self.left.camera, self.right_camera_in_left_rover());
        let place =
            |index: u32, side: u32| f64::from(index) / f64::from(OVERLAP_GRID - 1) * f64::from(side - 1);
        (0..OVERLAP_GRID * OVERLAP_GRID).any(|index| {
            let (column, row) = (index % OVERLAP_GRID, index / OVERLAP_GRID);
            let pixel = Pixel::new(place(column, left.width()), place(row, left.height()));
            let ray = left.ray(pixel);
            ray.is_some_and(|ray| OVERLAP_RANGES_M.iter().any(|&range| right.sees(&ray.at(range))))
        })
    }
}

/// The stops formed by the images, in the order of their clocks.
pub(super) fn assemble(frames: &[Arc<Frame>]) -> (Vec<Pair>, StereoGeometry) {
    let mut frames = frames.to_vec();
    let clock = |frame: &Frame| frame.product.clock_s().unwrap_or(f64::INFINITY);
    // The sort is stable: images without a clock stay in the order of their names.
    frames.sort_by(|a, b| clock(a).total_cmp(&clock(b)));
    let lateral = largest_family(pair_up(&frames, Pair::is_lateral));
    if lateral.is_empty() {
        return (largest_family(pair_up(&frames, Pair::is_convergent)), StereoGeometry::Convergent);
    }
    (lateral, StereoGeometry::Lateral)
}

/// Pairs each image with the nearest later or earlier one that fits; no image is used twice.
pub(super) fn pair_up(frames: &[Arc<Frame>], fits: impl Fn(&Pair) -> bool) -> Vec<Pair> {
    let mut used = vec![false; frames.len()];
    let mut pairs = Vec::new();
    for first in 0..frames.len() {
        for second in first + 1..frames.len() {
            if used[first] || used[second] {
                continue;
            }
            let pair = |left: usize, right: usize| Pair {
                left: Arc::clone(&frames[left]),
                right: Arc::clone(&frames[right]),
            };
            let pair = [pair(first, second), pair(second, first)].into_iter().find(&fits);
            if let Some(pair) = pair {
                (used[first], used[second]) = (true, true);
                pairs.push(pair);
            }
        }
    }
    pairs
}

/// The pairs of the camera family that has the most; the first such family if several have as many.
fn largest_family(pairs: Vec<Pair>) -> Vec<Pair> {
    let count = |family: &str| pairs.iter().filter(|pair| pair.left.family() == family).count();
    let mut best: Option<(String, usize)> = None;
    for family in pairs.iter().map(|pair| pair.left.family()) {
        let own = count(&family);
        if best.as_ref().is_none_or(|(_, most)| own > *most) {
            best = Some((family, own));
        }
    }
    pairs
        .into_iter()
        .filter(|pair| best.as_ref().is_some_and(|(family, _)| pair.left.family() == *family))
        .collect()
}
