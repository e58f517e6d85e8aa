//! Conversions to rerun: pixels, points, poses, covariances and images as archetypes.
//!
//! In Sightline, (0, 0) is the *centre* of the first pixel; in rerun's 2-D space it is that pixel's top left *corner*. Only
//! [`point`] adds the half pixel.

use std::io::Cursor;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use nalgebra::{Matrix2, Matrix3, Rotation3, SymmetricEigen, UnitQuaternion, Vector2};
use rerun::{
    ChannelDatatype, Color, DepthImage, EncodedImage, ImageFormat, LineStrips2D, Points2D, Points3D, Radius,
    Transform3D,
};
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_vision::image::{GrayImage, PixelRect};

use super::palette::{HALO, Rgb, color};

/// Points on a drawn ellipse.
const ELLIPSE_POINTS: u32 = 64;

/// Converts a position to rerun's 2-D space, px.
pub(super) fn point(pixel: Pixel) -> [f32; 2] {
    [(pixel.x + 0.5) as f32, (pixel.y + 0.5) as f32]
}

/// Converts a difference of two positions, px, without the half pixel.
pub(super) fn vector(along: &Vector2<f64>) -> [f32; 2] {
    [along.x as f32, along.y as f32]
}

/// The frame of a rectangle of whole pixels: its top left corner is the origin.
pub(super) fn corner_frame(rect: &PixelRect) -> Transform3D {
    let [x, y] = point(Pixel::new(f64::from(rect.x) - 0.5, f64::from(rect.y) - 0.5));
    Transform3D::from_translation([x, y, 0.0])
}

/// A dot on an image.
pub(super) fn dot(pixel: Pixel, rgb: Rgb, label: &str) -> Points2D {
    Points2D::new([point(pixel)])
        .with_colors([color(rgb)])
        .with_radii([Radius::new_ui_points(3.0)])
        .with_labels([label])
        .with_show_labels(false)
        .with_draw_order(30.0)
}

/// A dot in space.
pub(super) fn dot_3d(at: Point3, rgb: Rgb, label: &str) -> Points3D {
    Points3D::new([point_3d(&at)])
        .with_colors([color(rgb)])
        .with_radii([Radius::new_ui_points(5.0)])
        .with_labels([label])
        .with_show_labels(false)
}

/// Lines on an image, each with a black halo, so that they are visible on any background.
pub(super) fn haloed(strips: &[Vec<[f32; 2]>], rgb: Rgb) -> LineStrips2D {
    let repeated = |under: Color, over: Color| {
        strips.iter().map(move |_| under).chain(strips.iter().map(move |_| over)).collect::<Vec<_>>()
    };
    let radii = |r: f32| strips.iter().map(move |_| Radius::new_ui_points(r));
    LineStrips2D::new(strips.iter().chain(strips).cloned())
        .with_colors(repeated(color(HALO), color(rgb)))
        .with_radii(radii(2.0).chain(radii(1.0)))
        .with_draw_order(20.0)
}

/// The closed outline through `corners`.
pub(super) fn outline(corners: impl IntoIterator<Item = Pixel>) -> Vec<[f32; 2]> {
    let mut strip: Vec<_> = corners.into_iter().map(point).collect();
    strip.extend(strip.first().copied());
    strip
}

/// A plus sign with arms of `arm` px.
pub(super) fn plus(centre: Pixel, arm: f64) -> [Vec<[f32; 2]>; 2] {
    let stroke = |dx: f64, dy: f64| vec![point(centre.offset(-dx, -dy)), point(centre.offset(dx, dy))];
    [stroke(arm, 0.0), stroke(0.0, arm)]
}

/// The ellipse at `sigmas` standard deviations; `None` if the covariance is not finite.
pub(super) fn ellipse(centre: Pixel, covariance_px2: &Matrix2<f64>, sigmas: f64) -> Option<Vec<[f32; 2]>> {
    if !covariance_px2.iter().all(|v| v.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(*covariance_px2);
    let axes =
        eigen.eigenvectors * Matrix2::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt() * sigmas));
    Some(outline((0..ELLIPSE_POINTS).map(|i| {
        let angle = f64::from(i) / f64::from(ELLIPSE_POINTS) * std::f64::consts::TAU;
        let offset = axes * Vector2::new(angle.cos(), angle.sin());
        centre.offset(offset.x, offset.y)
    })))
}

/// Coordinates of a point, m.
pub(super) fn point_3d(at: &Point3) -> [f32; 3] {
    [at.x as f32, at.y as f32, at.z as f32]
}

/// A rigid transform as the transform of the child entity.
pub(super) fn transform(parent_from_child: &Pose) -> Transform3D {
    let t = parent_from_child.translation.vector;
    Transform3D::from_translation_rotation(
        [t.x as f32, t.y as f32, t.z as f32],
        quaternion(&parent_from_child.rotation),
    )
}

fn quaternion(rotation: &UnitQuaternion<f64>) -> rerun::Quaternion {
    rerun::Quaternion::from_xyzw([rotation.i as f32, rotation.j as f32, rotation.k as f32, rotation.w as f32])
}

/// The ellipsoids at 1σ and 3σ about `centre`; `None` if the covariance is not finite.
pub(super) fn ellipsoids(
    centre: &Point3,
    covariance_m2: &Matrix3<f64>,
    colors: [Color; 2],
) -> Option<rerun::Ellipsoids3D> {
    if !covariance_m2.iter().chain(centre.iter()).all(|v| v.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(*covariance_m2);
    let mut axes = eigen.eigenvectors;
    if axes.determinant() < 0.0 {
        axes.column_mut(0).neg_mut();
    }
    let rotation = quaternion(&UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)));
    let half_sizes = [1.0, 3.0].map(|sigmas| {
        let half = eigen.eigenvalues.map(|v| v.max(0.0).sqrt() * sigmas);
        [half.x as f32, half.y as f32, half.z as f32]
    });
    Some(
        rerun::Ellipsoids3D::from_centers_and_half_sizes([point_3d(centre); 2], half_sizes)
            .with_quaternions([rotation; 2])
            .with_colors(colors)
            .with_line_radii([Radius::new_ui_points(0.75); 2]),
    )
}

/// Encodes an image as an 8-bit PNG; full scale is white and invalid pixels are black. The patches and the score map contain
/// the exact values.
pub(super) fn png(image: &GrayImage) -> Option<EncodedImage> {
    let levels: Vec<u8> = image.as_raw().iter().map(|v| (v * 255.0).round() as u8).collect();
    let mut bytes = Cursor::new(Vec::new());
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(&levels, image.width(), image.height(), ExtendedColorType::L8)
        .ok()?;
    Some(EncodedImage::from_file_contents(bytes.into_inner()).with_media_type("image/png"))
}

/// An image of `f32` values with a colour map and fixed limits; rerun's depth image preserves the values.
pub(super) fn mapped(
    [width, height]: [u32; 2],
    values: &[f32],
    limits: [f64; 2],
    map: rerun::components::Colormap,
) -> Option<DepthImage> {
    let whole = width > 0 && height > 0 && values.len() == width as usize * height as usize;
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let format =
        ImageFormat::from(rerun::datatypes::ImageFormat::depth([width, height], ChannelDatatype::F32));
    whole.then(|| {
        DepthImage::new(bytes, format)
            .with_meter(1.0)
            .with_colormap(map)
            .with_depth_range(rerun::components::ValueRange::new(limits[0], limits[1]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_pixel_centre_is_half_a_pixel_from_the_corner() {
        assert_eq!(point(Pixel::new(0.0, 0.0)), [0.5, 0.5]);
        assert_eq!(point(Pixel::new(-0.5, 479.5)), [0.0, 480.0]);
    }

    #[test]
    fn an_ellipse_reaches_three_sigma_along_its_long_axis() {
        let strip = ellipse(Pixel::new(0.0, 0.0), &Matrix2::new(4.0, 0.0, 0.0, 1.0), 3.0).unwrap();
        let farthest = strip.iter().map(|p| p[0]).fold(f32::MIN, f32::max);
        let highest = strip.iter().map(|p| p[1]).fold(f32::MIN, f32::max);
        assert!((farthest - 6.5).abs() < 1e-5 && (highest - 3.5).abs() < 1e-5, "{farthest} {highest}");
        assert!(ellipse(Pixel::new(0.0, 0.0), &Matrix2::repeat(f64::NAN), 3.0).is_none());
    }
}
