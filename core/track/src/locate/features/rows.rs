//! The tables of the feature locator, read row by row for the page and the recording (R170).
//!
//! They are read from the trace or, as arrays, from the network, with the same numbers; NaN for a missing one.

use nalgebra::{Matrix2, Vector2};

use super::evidence::{CLOUD_COLUMNS, FeatureColumn};
use crate::locate::Located;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3};

/// A feature of the left image.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Its position in the left image, px.
    pub pixel: Pixel,
    /// Its scale, px.
    pub sigma_px: f64,
    /// Its orientation, rad, clockwise on screen from +x.
    pub orientation_rad: f64,
    /// Position of its match in the right image, px; `None` without a triangulated point.
    pub right: Option<Pixel>,
    /// Distance from the left camera, m; `None` without a triangulated point.
    pub range_m: Option<f64>,
    /// Its match with the earlier stop; `None` without one.
    pub matched: Option<Matched>,
}

/// The match of a feature with one of an earlier stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Matched {
    /// Position of the feature in the earlier left image, px.
    pub then: Pixel,
    /// The earlier point, moved by the motion, in the current left image, px; `None` if not visible.
    pub moved: Option<Pixel>,
    /// Distance between the two points after the motion, m.
    pub residual_m: Option<f64>,
    /// Whether the match is an inlier of the motion.
    pub is_inlier: bool,
}

impl Matched {
    /// The vector from the pixel predicted by the motion to `found`, px.
    pub fn residual_px(&self, found: Pixel) -> Option<Vector2<f64>> {
        self.moved.map(|moved| Vector2::new(found.x - moved.x, found.y - moved.y))
    }
}

/// The target's position by one bootstrap set.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudPoint {
    /// The position in the rover frame, m.
    pub position_in_rover: Point3,
    /// Its pixel in the left image, px; `None` if not visible.
    pub left_pixel: Option<Pixel>,
}

/// The covariance of a moved target in the left image, px² (R180): `J Σ Jᵀ` with the camera's Jacobian at the target.
/// `None` if another tracker located it, because a match has its own error.
pub fn moved_covariance_px2(located: &Located, left: &Camera) -> Option<Matrix2<f64>> {
    located.evidence.features()?;
    let (_, jacobian) = left.model.project_with_jacobian(located.position_in_rover.as_ref()?)?;
    Some(jacobian * located.covariance_in_rover? * jacobian.transpose())
}

/// Reads the features from a table's values.
pub fn features(values: &[f32]) -> impl Iterator<Item = Feature> {
    values.chunks_exact(FeatureColumn::COUNT).filter_map(feature)
}

/// Reads the points from a cloud's values.
pub fn cloud(values: &[f32]) -> impl Iterator<Item = CloudPoint> {
    values.chunks_exact(CLOUD_COLUMNS).map(|row| {
        let [x, y, z] = [row[0], row[1], row[2]].map(f64::from);
        CloudPoint { position_in_rover: Point3::new(x, y, z), left_pixel: pixel(row[3], row[4]) }
    })
}

/// Reads the feature of a row; `None` without a pixel.
fn feature(row: &[f32]) -> Option<Feature> {
    use FeatureColumn::{Orientation, Range, RightX, RightY, Sigma, X, Y};
    let at = |column: FeatureColumn| row[column as usize];
    Some(Feature {
        pixel: pixel(at(X), at(Y))?,
        sigma_px: f64::from(at(Sigma)),
        orientation_rad: f64::from(at(Orientation)),
        right: pixel(at(RightX), at(RightY)),
        range_m: number(at(Range)),
        matched: matched(row),
    })
}

fn matched(row: &[f32]) -> Option<Matched> {
    use FeatureColumn::{Inlier, MovedX, MovedY, Residual, ThenX, ThenY};
    let at = |column: FeatureColumn| row[column as usize];
    Some(Matched {
        then: pixel(at(ThenX), at(ThenY))?,
        moved: pixel(at(MovedX), at(MovedY)),
        residual_m: number(at(Residual)),
        is_inlier: at(Inlier) == 1.0,
    })
}

fn pixel(x: f32, y: f32) -> Option<Pixel> {
    Some(Pixel::new(number(x)?, number(y)?))
}

fn number(value: f32) -> Option<f64> {
    value.is_finite().then_some(f64::from(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_gives_its_columns_back_and_what_is_nan_is_none() {
        let mut alone = [f32::NAN; FeatureColumn::COUNT];
        alone[..4].copy_from_slice(&[10.0, 20.0, 1.6, 0.5]);
        let whole: [f32; FeatureColumn::COUNT] =
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 0.5, 1.0];
        let values = [alone, whole].concat();
        let read: Vec<Feature> = features(&values).collect();
        assert_eq!(read[0].pixel, Pixel::new(10.0, 20.0));
        assert!(read[0].right.is_none() && read[0].range_m.is_none() && read[0].matched.is_none());
        assert_eq!((read[1].right, read[1].range_m), (Some(Pixel::new(5.0, 6.0)), Some(7.0)));
        let matched = read[1].matched.as_ref().unwrap();
        assert_eq!((matched.then, matched.moved), (Pixel::new(8.0, 9.0), Some(Pixel::new(10.0, 11.0))));
        assert_eq!((matched.residual_m, matched.is_inlier), (Some(0.5), true));
        assert_eq!(matched.residual_px(read[1].pixel), Some(Vector2::new(-9.0, -9.0)));
    }

    #[test]
    fn a_point_of_the_cloud_behind_the_camera_has_no_pixel() {
        let values = [1.0, 2.0, 3.0, f32::NAN, f32::NAN, 4.0, 5.0, 6.0, 7.0, 8.0];
        let read: Vec<CloudPoint> = cloud(&values).collect();
        assert_eq!((read[0].position_in_rover, read[0].left_pixel), (Point3::new(1.0, 2.0, 3.0), None));
        assert_eq!(read[1].left_pixel, Some(Pixel::new(7.0, 8.0)));
    }
}
