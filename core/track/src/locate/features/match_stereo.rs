//! Stereo part of step `match_features`: the nearest descriptor (R158), among all features or along the epipolar curve.
//!
//! The curve of a left feature is the projection of its ray, sampled at equal steps of inverse range and interpolated
//! linearly. Only right features within the tolerance of the curve are compared, so that the constrained search is
//! also the faster one. Ratio test and mutual test then apply to these candidates.

use super::settings::FeatureSettings;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::Pixel;
use sightline_vision::sift::matching::{self, MatchSettings};
use sightline_vision::sift::{Descriptor, Features, Keypoint};

/// Number of samples of a curve: over an octave of ranges, a curve of a real pair bends by less than 0.1 px between two.
const SAMPLES: usize = 17;

/// Height of a bucket, px.
const BUCKET_PX: f64 = 8.0;

/// A left and a right feature with similar descriptors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StereoMatch {
    /// Index of the left feature.
    pub left: u32,
    /// Index of the right feature.
    pub right: u32,
    /// Distance of the descriptors.
    pub distance: f32,
}

/// The position of a keypoint, px.
pub(super) fn pixel_of(keypoint: &Keypoint) -> Pixel {
    Pixel::new(f64::from(keypoint.x), f64::from(keypoint.y))
}

/// Matches the features of the left and the right image.
pub(super) fn match_stereo(
    left: &Features,
    right: &Features,
    cameras: [&Camera; 2],
    settings: &FeatureSettings,
) -> Vec<StereoMatch> {
    if !settings.stereo_along_curve {
        let matched = matching::matches(&left.descriptors, &right.descriptors, &settings.matching());
        let stereo =
            |m: &matching::Match| StereoMatch { left: m.query, right: m.train, distance: m.distance };
        return matched.iter().map(stereo).collect();
    }
    let buckets = Buckets::new(right);
    let mut nearest = Nearest::new(right.keypoints.len());
    for (index, keypoint) in left.keypoints.iter().enumerate() {
        let Some(curve) = curve(pixel_of(keypoint), cameras, settings) else { continue };
        let candidates = buckets.near(&curve, settings.curve_tolerance_px);
        nearest.add(index as u32, &left.descriptors[index], right, &candidates);
    }
    nearest.matches(&settings.matching())
}

/// The visible samples of the epipolar curve of a left pixel; `None` if fewer than two are visible.
fn curve(pixel: Pixel, [left, right]: [&Camera; 2], settings: &FeatureSettings) -> Option<Vec<Pixel>> {
    let ray = left.ray(pixel)?;
    let (far, near) = (1.0 / settings.feature_range_max_m, 1.0 / settings.feature_range_min_m);
    let at = |i: usize| far + (near - far) * i as f64 / (SAMPLES - 1) as f64;
    let pixels: Vec<Pixel> = (0..SAMPLES).filter_map(|i| right.project(&ray.at(1.0 / at(i)))).collect();
    (pixels.len() >= 2).then_some(pixels)
}

/// The right features, bucketed by row.
struct Buckets<'a> {
    features: &'a Features,
    rows: Vec<Vec<u32>>,
}

impl<'a> Buckets<'a> {
    fn new(features: &'a Features) -> Self {
        let mut rows: Vec<Vec<u32>> = Vec::new();
        for (index, keypoint) in features.keypoints.iter().enumerate() {
            let row = (f64::from(keypoint.y).max(0.0) / BUCKET_PX) as usize;
            if rows.len() <= row {
                rows.resize_with(row + 1, Vec::new);
            }
            rows[row].push(index as u32);
        }
        Self { features, rows }
    }

    /// Returns the features within a distance of a polyline, each once, by ascending index.
    fn near(&self, curve: &[Pixel], tolerance_px: f64) -> Vec<u32> {
        let mut found = Vec::new();
        for ends in curve.windows(2) {
            let (a, b) = (ends[0], ends[1]);
            let (top, bottom) = (a.y.min(b.y) - tolerance_px, a.y.max(b.y) + tolerance_px);
            let (low, high) = (a.x.min(b.x) - tolerance_px, a.x.max(b.x) + tolerance_px);
            if bottom < 0.0 {
                continue;
            }
            let first = (top.max(0.0) / BUCKET_PX) as usize;
            let last = (bottom / BUCKET_PX) as usize;
            for row in self.rows.iter().take(last.saturating_add(1)).skip(first) {
                found.extend(row.iter().copied().filter(|index| {
                    let keypoint = &self.features.keypoints[*index as usize];
                    let pixel = pixel_of(keypoint);
                    (low..=high).contains(&pixel.x) && distance_to_segment(pixel, a, b) <= tolerance_px
                }));
            }
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// Distance of a pixel from the segment between two others, px.
fn distance_to_segment(p: Pixel, a: Pixel, b: Pixel) -> f64 {
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let length2 = dx * dx + dy * dy;
    let along = if length2 > 0.0 { ((p.x - a.x) * dx + (p.y - a.y) * dy) / length2 } else { 0.0 };
    let along = along.clamp(0.0, 1.0);
    p.distance(a.offset(along * dx, along * dy))
}

/// The nearest neighbour of every left feature, and of every right one.
struct Nearest {
    /// Left feature, its nearest right feature, and the squared distances of the nearest and the second nearest.
    of_left: Vec<(u32, u32, u32, Option<u32>)>,
    /// For every right feature: squared distance and index of the nearest left feature.
    of_right: Vec<Option<(u32, u32)>>,
}

impl Nearest {
    fn new(right_count: usize) -> Self {
        Self { of_left: Vec::new(), of_right: vec![None; right_count] }
    }

    fn add(&mut self, left: u32, descriptor: &Descriptor, right: &Features, candidates: &[u32]) {
        let (mut best, mut second): (Option<(u32, u32)>, Option<u32>) = (None, None);
        for &index in candidates {
            let distance2 = matching::distance2(descriptor, &right.descriptors[index as usize]);
            match best {
                Some((least, _)) if distance2 >= least => {
                    second = Some(second.map_or(distance2, |s| s.min(distance2)));
                }
                _ => {
                    second = best.map(|(least, _)| least);
                    best = Some((distance2, index));
                }
            }
            let own = &mut self.of_right[index as usize];
            if own.is_none_or(|(least, _)| distance2 < least) {
                *own = Some((distance2, left));
            }
        }
        if let Some((distance2, index)) = best {
            self.of_left.push((left, index, distance2, second));
        }
    }

    fn matches(&self, settings: &MatchSettings) -> Vec<StereoMatch> {
        let kept = |&(left, right, distance2, second): &(u32, u32, u32, Option<u32>)| {
            let is_clear = match (settings.ratio_max, second) {
                (Some(ratio), Some(second)) => f64::from(distance2) < ratio * ratio * f64::from(second),
                _ => true,
            };
            let is_mutual = self.of_right[right as usize].is_some_and(|(_, nearest)| nearest == left);
            let distance = f64::from(distance2).sqrt() as f32;
            (is_clear && (is_mutual || !settings.mutual)).then_some(StereoMatch { left, right, distance })
        };
        self.of_left.iter().filter_map(kept).collect()
    }
}
