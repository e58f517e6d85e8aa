//! The tables of the feature locator: every feature with its matches and residual, and the bootstrap cloud.

use super::detect::StopFeatures;
use super::evidence::{CLOUD_COLUMNS, FeatureColumn, Table};
use super::motion::Motion;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose};

/// Returns a table with one row per feature of the left image.
pub(super) fn features(now: &StopFeatures) -> Table {
    let mut values = vec![f32::NAN; now.left.keypoints.len() * FeatureColumn::COUNT];
    for (row, keypoint) in values.chunks_exact_mut(FeatureColumn::COUNT).zip(&now.left.keypoints) {
        row[FeatureColumn::X as usize] = keypoint.x;
        row[FeatureColumn::Y as usize] = keypoint.y;
        row[FeatureColumn::Sigma as usize] = keypoint.sigma_px;
        row[FeatureColumn::Orientation as usize] = keypoint.orientation_rad;
    }
    for point in &now.points {
        let right = &now.right.keypoints[point.stereo.right as usize];
        let row = &mut values[point.stereo.left as usize * FeatureColumn::COUNT..][..FeatureColumn::COUNT];
        row[FeatureColumn::RightX as usize] = right.x;
        row[FeatureColumn::RightY as usize] = right.y;
        row[FeatureColumn::Range as usize] = point.range_m as f32;
    }
    Table { columns: FeatureColumn::COUNT as u32, values }
}

/// Adds the residuals of a motion to the rows of the matched features.
pub(super) fn add_motion(
    table: &mut Table,
    motion: &Motion,
    then: &StopFeatures,
    now: &StopFeatures,
    left: &Camera,
) {
    let pose = motion.fit.motion();
    for (index, matched) in motion.matches.iter().enumerate() {
        let (before, after) = (&then.points[matched.query as usize], &now.points[matched.train as usize]);
        let row = &mut table.values[after.stereo.left as usize * FeatureColumn::COUNT..];
        let earlier = StopFeatures::pixel(then.left_of(before));
        set(row, [FeatureColumn::ThenX, FeatureColumn::ThenY], earlier);
        let Some(pose) = pose else { continue };
        if let Some(moved) = left.project(&(pose * before.position_in_rover)) {
            set(row, [FeatureColumn::MovedX, FeatureColumn::MovedY], moved);
        }
        row[FeatureColumn::Residual as usize] = motion.fit.residuals_m[index] as f32;
        row[FeatureColumn::Inlier as usize] = 0.0;
    }
    for index in &motion.fit.inliers {
        let after = &now.points[motion.matches[*index].train as usize];
        table.values[after.stereo.left as usize * FeatureColumn::COUNT + FeatureColumn::Inlier as usize] =
            1.0;
    }
}

fn set(row: &mut [f32], [x, y]: [FeatureColumn; 2], pixel: Pixel) {
    row[x as usize] = pixel.x as f32;
    row[y as usize] = pixel.y as f32;
}

/// Returns the position of a point after each of some motions, and its pixel in the left image.
pub(super) fn cloud(poses: impl Iterator<Item = Pose>, point: &Point3, left: &Camera) -> Table {
    let mut values = Vec::new();
    for pose in poses {
        let moved = pose * point;
        let pixel = left.project(&moved).unwrap_or(Pixel::new(f64::NAN, f64::NAN));
        values.extend([moved.x, moved.y, moved.z, pixel.x, pixel.y].map(|v| v as f32));
    }
    Table { columns: CLOUD_COLUMNS as u32, values }
}
