//! The stages of the shape tracker: the stereo surface, the virtual range sensor with the depth errors, the coarse search,
//! both meshes in space, and the draped image of a hand-off.
//!
//! Arrays keep their values, in metres (disparities in pixels), with colour maps: viridis from the 1 % to the 99 % quantile.
//! Depth errors are blue, white at zero and red; all three error images of a step share the limit given by these quantiles
//! of the initial errors. One pixel of the coarse search is one shift, the first row has the smallest Δy. The earlier mesh
//! is drawn in its registered pose.

use nalgebra::{Matrix3, Vector3};
use rerun::components::Colormap;
use rerun::{ColorModel, DepthImage, Image, Mesh3D};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_track::locate::shape_tracker::rows;
use sightline_track::trace::{ArrayName, ArrayView, StepTrace};

use super::Logged;
use super::convert::{dot, dot_3d, mapped, point_3d};
use super::palette::{LOST, MEASUREMENT, PREDICTION, Rgb, color, of_difference};
use super::step::Step;

/// Minimum limit of the error colours, m.
const LEAST_LIMIT_M: f32 = 0.001;

/// Disparities of the rectified left image, px.
pub(super) fn log_disparities(step: &Step<'_>) -> Logged {
    let image = viridis(step, ArrayName::DISPARITIES);
    step.log("/{target}/locate/surface/disparities", image)
}

/// Distances from the left camera, m.
pub(super) fn log_ranges(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/surface/ranges", viridis(step, ArrayName::RANGES))
}

/// The earlier surface rendered by the virtual range sensor, m.
pub(super) fn log_sensor(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/coarse_register/sensor", viridis(step, ArrayName::SENSOR))
}

/// Mean distance of the surfaces for every shift, m.
pub(super) fn log_coarse_search(step: &Step<'_>) -> Logged {
    let image = viridis(step, ArrayName::COARSE_SEARCH);
    step.log("/{target}/locate/coarse_register/coarse_search", image)
}

/// The shift with the smallest mean distance.
pub(super) fn log_coarse_best(step: &Step<'_>) -> Logged {
    let best = best(step.trace).map(|pixel| dot(pixel, MEASUREMENT, "best"));
    step.log("/{target}/locate/coarse_register/coarse_search/best", best)
}

/// Current minus earlier depth before registration.
pub(super) fn log_error_before(step: &Step<'_>) -> Logged {
    let image = signed(step, ArrayName::ERROR_BEFORE);
    step.log("/{target}/locate/coarse_register/error_before", image)
}

/// Current minus earlier depth after the coarse search.
pub(super) fn log_error_coarse(step: &Step<'_>) -> Logged {
    let image = signed(step, ArrayName::ERROR_COARSE);
    step.log("/{target}/locate/coarse_register/error_coarse", image)
}

/// Current minus earlier depth after the refinement.
pub(super) fn log_error_fine(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/refine_register/error_fine", signed(step, ArrayName::ERROR_FINE))
}

/// The earlier mesh in its registered pose.
pub(super) fn log_mesh_fixed(step: &Step<'_>) -> Logged {
    let found = mesh(step, ArrayName::MESH_FIXED, LOST);
    step.log("/{target}/locate/refine_register/mesh_fixed", found)
}

/// The mesh of the current stop.
pub(super) fn log_mesh_moving(step: &Step<'_>) -> Logged {
    let found = mesh(step, ArrayName::MESH_MOVING, PREDICTION);
    step.log("/{target}/locate/refine_register/mesh_moving", found)
}

/// At a hand-off, the earlier image draped over the surface and rendered for the current camera.
pub(super) fn log_draped(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/hand_off/draped", grey(step, ArrayName::DRAPED))
}

/// The part of the current image that matched it.
pub(super) fn log_draped_match(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/hand_off/draped_match", grey(step, ArrayName::DRAPED_MATCH))
}

/// After a hand-off, the contact point for the arm.
pub(super) fn log_touch(step: &Step<'_>) -> Logged {
    let point = touch(step.trace).map(|at| dot_3d(step.in_site(&at), PREDICTION, "touch"));
    step.log("/{target}/locate/hand_off/touch", point)
}

/// The contact point, rover frame, m.
pub(super) fn touch(trace: &StepTrace) -> Option<Point3> {
    trace.shape()?.placement.as_ref()?.touch_in_rover.map(Point3::from)
}

/// The registered position, accepted or not.
pub(super) fn log_position(step: &Step<'_>) -> Logged {
    let point = registered(step.trace).map(|(at, _)| dot_3d(step.in_site(&at), MEASUREMENT, "registered"));
    step.log("/{target}/locate/refine_register/position", point)
}

/// The covariance of the registered position.
pub(super) fn log_covariance(step: &Step<'_>) -> Logged {
    let found =
        registered(step.trace).and_then(|(at, covariance)| step.spread(&at, &covariance, MEASUREMENT));
    step.log("/{target}/locate/refine_register/covariance", found)
}

/// Position (m) and covariance (m²) of a registered target, rover frame.
pub(super) fn registered(trace: &StepTrace) -> Option<(Point3, Matrix3<f64>)> {
    trace.shape()?.registration.as_ref().filter(|found| found.failure.is_none())?;
    let located = trace.located()?;
    located.position_in_rover.zip(located.covariance_in_rover)
}

/// The best shift of the coarse search as a pixel of its image.
pub(super) fn best(trace: &StepTrace) -> Option<Pixel> {
    let found = trace.shape()?.registration.as_ref()?;
    let [columns, rows] = values(trace, ArrayName::COARSE_SEARCH)?.size();
    let [x_m, y_m, _] = found.coarse_shift_m?;
    let step_m = rows::sensor_pixel_m(found, values(trace, ArrayName::SENSOR)?.size()[0])?;
    let to_pixel = |side: u32, shift_m: f64| (f64::from(side) - 1.0) / 2.0 + shift_m / step_m;
    Some(Pixel::new(to_pixel(columns, x_m), to_pixel(rows, y_m)))
}

/// Whether a step has a non-empty array of this name.
pub(super) fn has(trace: &StepTrace, name: ArrayName) -> bool {
    values(trace, name).is_some()
}

/// A non-empty array of a step.
fn values(trace: &StepTrace, name: ArrayName) -> Option<ArrayView<'_>> {
    trace.array(name).filter(|array| array.size().iter().all(|side| *side > 0))
}

fn viridis(step: &Step<'_>, name: ArrayName) -> Option<DepthImage> {
    let array = values(step.trace, name)?;
    mapped(array.size(), array.values(), ends(array.values()).map(f64::from), Colormap::Viridis)
}

fn grey(step: &Step<'_>, name: ArrayName) -> Option<DepthImage> {
    let array = values(step.trace, name)?;
    mapped(array.size(), array.values(), ends(array.values()).map(f64::from), Colormap::Grayscale)
}

/// Blue below zero, white at zero, red above; missing values are transparent.
fn signed(step: &Step<'_>, name: ArrayName) -> Option<Image> {
    let array = values(step.trace, name)?;
    let [low, high] = values(step.trace, ArrayName::ERROR_BEFORE).map_or([0.0; 2], |all| ends(all.values()));
    let limit_m = low.abs().max(high.abs()).max(LEAST_LIMIT_M);
    let rgba = array.values().iter().flat_map(|value| {
        let [r, g, b] = of_difference(value / limit_m);
        if value.is_finite() { [r, g, b, 255] } else { [0; 4] }
    });
    Some(Image::from_elements(&rgba.collect::<Vec<u8>>(), array.size(), ColorModel::RGBA))
}

/// The triangles of a mesh in the site frame, with face normals.
fn mesh(step: &Step<'_>, name: ArrayName, rgb: Rgb) -> Option<Mesh3D> {
    let array = values(step.trace, name)?;
    let facets = rows::facets(array.values())
        .map(|facet| facet.map(|corner| step.in_site(&Point3::from(Vector3::from(corner).map(f64::from)))));
    let (mut corners, mut normals) = (Vec::new(), Vec::new());
    for [a, b, c] in facets {
        let normal = (b - a).cross(&(c - a)).try_normalize(1e-15).unwrap_or_else(Vector3::z);
        corners.extend([a, b, c].map(|corner| point_3d(&corner)));
        normals.extend([point_3d(&Point3::from(normal)); 3]);
    }
    Some(Mesh3D::new(corners).with_vertex_normals(normals).with_albedo_factor(*color(rgb)))
}

/// The 1 % and 99 % quantiles; never equal, so that a constant array has a valid colour range.
fn ends(values: &[f32]) -> [f32; 2] {
    let mut finite: Vec<f32> = values.iter().copied().filter(|value| value.is_finite()).collect();
    finite.sort_by(f32::total_cmp);
    let skip = finite.len() / 100;
    match (finite.get(skip), finite.len().checked_sub(1 + skip).and_then(|last| finite.get(last))) {
        (Some(&low), Some(&high)) if low < high => [low, high],
        _ => [0.0, 1.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_limits_exclude_one_percent_of_the_values() {
        let mut values: Vec<f32> = (0..200).map(|value| value as f32).collect();
        values.push(f32::NAN);
        assert_eq!(ends(&values), [2.0, 197.0]);
        assert_eq!(ends(&[3.0, 3.0]), [0.0, 1.0]);
        assert_eq!(ends(&[]), [0.0, 1.0]);
    }
}
