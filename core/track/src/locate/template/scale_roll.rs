//! Step `scale_roll`: predicts the appearance of the template at the current stop (K§4.3.1, K-Eq 6–10, R48–R59).
//!
//! ```text
//! s     = |p_old − C_old| / |p_new − C_new|                      K-Eq 6
//! H_x   = (H − (A·H) A) / |A × H|        of the old left camera  K-Eq 7–9
//! p_adj = p_0 + k H_x,  k = 0.05 m                               K-Eq 10
//! ρ     = atan2(dy, dx) of p_0 → p_adj in the new left image, clockwise on screen positive (R56)
//! ```
//! The window keeps its size in pixels; the image content is magnified by s and rotated by ρ (R51, R58). Only the
//! prediction is used, never the stereo result that follows (R50). Scale and roll do not compensate out-of-plane
//! change (R60). If stereo measured the slope of the target's surface, the map between the two images is known to
//! first order,
//! ```text
//! F = ∂pixel_new/∂p · R · ∂p/∂pixel_old
//! ```
//! and with `surface_warp` the window is resampled through F instead: foreshortening changes with the line of sight,
//! most on surfaces seen at a grazing angle. If the window covers two surfaces, as at the foot of a rock, the
//! measured slope fits neither; so both windows are matched, and the better match is used (`choose`). With
//! `warp_model = homography` each pixel is mapped through the plane of the surface and both camera models instead
//! (`window_map`). `image_from_template` is F, or s R(ρ) if the slope is unknown or the window without it matches
//! better; it also propagates the uncertainty of the target's position in the image.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | p_old, C_old | `appearance.position_in_rover`, `appearance.camera` | m, rover frame of the template's stop |
//! | p_new, C_new | `now_from_template * p_old`, `left` | m, current rover frame |
//! | s | `scale` | – |
//! | ρ | `roll_rad` | rad |
//! | R | rotation of `now_from_template` | – |
//! | ∂p/∂pixel_old | `appearance.surface_by_pixel` | m/px |

use nalgebra::{Matrix2, Matrix3x2, Rotation2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::failure::TemplateFailure;
use super::memory::Appearance;
use super::settings::{RollReference, TemplateSettings, WarpModel};
use super::window_map::{PlaneMap, WindowMap, WindowSource};
use crate::array_name::ArrayName;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_record::{ArrayKind, Declaration, Record, Unit, Unsent};
use sightline_vision::image::patch::{self, Patch};

/// Length of the helper vector, m (K-Eq 10).
const HELPER_LENGTH_M: f64 = 0.05;

/// Largest accepted stretch of the template by a slope, beyond scale and roll, px per px. The window that is only
/// scaled and rolled is compared as well, so the limit excludes only wrongly measured slopes.
const STRETCH_LIMIT: f64 = 1.0;

/// Largest scale of a template; its inverse is the smallest.
///
/// Magnified more, the default window contains a single pixel of its source; shrunk more, its source is larger than
/// most images. Such ratios of distances come from wrong poses.
const SCALE_MAX: f64 = 20.0;

/// The preparation of an appearance's window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Preparation {
    /// Warped by the slope of the surface if `surface_warp` is on and stereo measured one; otherwise scaled and rolled.
    Surface,
    /// Scaled and rolled by the geometry, without the slope of the surface.
    ScaleRoll,
    /// Scaled and rolled by given amounts, independent of the geometry and of the settings `scale` and `roll` (R224).
    Given {
        /// Scale.
        scale: f64,
        /// Roll, rad, clockwise on screen.
        roll_rad: f64,
    },
}

/// The template, scaled and rolled, or warped by the target's surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ScaleRoll {
    /// Scale by the ratio of distances; applied only where the setting `scale` is on.
    pub scale: f64,
    /// Roll, rad, clockwise on screen; applied only where the setting `roll` is on.
    pub roll_rad: f64,
    /// Scale that was applied.
    pub applied_scale: f64,
    /// Roll that was applied, rad.
    pub applied_roll_rad: f64,
    /// Whether the window was warped by the surface's slope instead: through `image_from_template`.
    pub warped: bool,
    /// Distance from the left camera when the template was taken, m.
    pub old_distance_m: f64,
    /// Predicted distance from the left camera now, m.
    pub new_distance_m: f64,
    /// The stop at which the template was taken.
    pub template_step: usize,
    /// Maps offsets in the old image to the current one on the target's surface, px per px; `s R(ρ)` if its slope is
    /// unknown.
    #[schema(value_type = Vec<f64>)]
    pub image_from_template: Matrix2<f64>,
    /// The window in the image from which it was taken.
    #[serde(skip)]
    #[schema(ignore)]
    pub reference: Unsent<Patch>,
    /// The window after scaling.
    #[serde(skip)]
    #[schema(ignore)]
    pub scaled: Unsent<Patch>,
    /// The window after scaling and rolling, or after warping; this one is matched.
    #[serde(skip)]
    #[schema(ignore)]
    pub rolled: Unsent<Patch>,
}

impl ScaleRoll {
    /// The map that prepared the template: `s R(ρ)`, or F if it was warped, px per px.
    pub fn prepared_from_template(&self) -> Matrix2<f64> {
        if self.warped {
            return self.image_from_template;
        }
        Rotation2::new(self.applied_roll_rad).into_inner() * self.applied_scale
    }

    /// The preparation that reproduces the template.
    pub fn preparation(&self) -> Preparation {
        match self.warped {
            true => Preparation::Surface,
            false => Preparation::Given { scale: self.applied_scale, roll_rad: self.applied_roll_rad },
        }
    }

    /// Stretch by the surface that the prepared template lacks: `F (s R)⁻¹ − I`, px per px; 0 if it was warped.
    pub fn misfit(&self) -> Matrix2<f64> {
        let inverse = self.prepared_from_template().try_inverse().unwrap_or_else(Matrix2::identity);
        self.image_from_template * inverse - Matrix2::identity()
    }
}

/// Maps offsets in the old image to the current one on the target's surface: `∂pixel_new/∂p · R · ∂p/∂pixel_old`, px per px.
fn surface_map(appearance: &Appearance, now_from_template: &Pose, left: &Camera) -> Option<Matrix2<f64>> {
    let slope = appearance.surface_by_pixel?;
    let (_, jacobian) =
        left.model.project_with_jacobian(&(now_from_template * appearance.position_in_rover))?;
    Some(jacobian * now_from_template.rotation.to_rotation_matrix().matrix() * slope)
}

/// Derivative of the surface point with respect to the current left pixel, as measured when the template was taken:
/// `R · ∂p/∂pixel_old · F⁻¹`, current rover frame, m per px.
pub(super) fn carried_surface(
    appearance: &Appearance,
    now_from_template: &Pose,
    left: &Camera,
) -> Option<Matrix3x2<f64>> {
    let old_from_new = surface_map(appearance, now_from_template, left)?.try_inverse()?;
    let rotation = now_from_template.rotation.to_rotation_matrix();
    Some(rotation.matrix() * appearance.surface_by_pixel? * old_from_new)
}

/// Whether a surface map stretches the template beyond scale and roll by at most `STRETCH_LIMIT`.
fn is_believed(map: &Matrix2<f64>, similarity: &Matrix2<f64>) -> bool {
    let inverse = similarity.try_inverse();
    inverse.is_some_and(|inverse| (map * inverse - Matrix2::identity()).norm() <= STRETCH_LIMIT)
}

/// The scale and roll of the geometry alone: `(s, ρ in rad, D_old in m, D_new in m)`.
///
/// # Errors
/// If the prediction is behind the camera.
pub fn geometry(
    position_then: &Point3,
    camera_then: &Camera,
    now_from_then: &Pose,
    camera_now: &Camera,
    roll_reference: RollReference,
) -> Result<(f64, f64, f64, f64), TemplateFailure> {
    let position_now = now_from_then * position_then;
    let old_distance_m = (position_then - camera_then.model.centre()).norm();
    let new_distance_m = (position_now - camera_now.model.centre()).norm();
    let helper_then = position_then + camera_then.model.horizontal_axis() * HELPER_LENGTH_M;
    let direction = |camera: &Camera, from: &Point3, to: &Point3| -> Option<f64> {
        let (a, b): (Pixel, Pixel) = (camera.project(from)?, camera.project(to)?);
        Some((b.y - a.y).atan2(b.x - a.x))
    };
    let now = direction(camera_now, &position_now, &(now_from_then * helper_then))
        .ok_or(TemplateFailure::PredictionUnseen)?;
    let then = match roll_reference {
        RollReference::Horizontal => 0.0,
        RollReference::OldImage => direction(camera_then, position_then, &helper_then).unwrap_or(0.0),
    };
    Ok((old_distance_m / new_distance_m, now - then, old_distance_m, new_distance_m))
}

/// Scales and rolls the template of `appearance` for the current left camera, or warps it by its surface.
///
/// # Errors
/// Why there is no template.
pub fn scale_roll<'a>(
    appearance: &'a Appearance,
    now_from_template: &Pose,
    left: &'a Camera,
    settings: &TemplateSettings,
    preparation: Preparation,
) -> Result<Prepared<'a>, TemplateFailure> {
    let (scale, roll_rad, old_distance_m, new_distance_m) = geometry(
        &appearance.position_in_rover,
        &appearance.camera,
        now_from_template,
        left,
        settings.roll_reference,
    )?;
    let (applied_scale, applied_roll_rad) = match preparation {
        Preparation::Given { scale, roll_rad } => (scale, roll_rad),
        _ => (if settings.scale { scale } else { 1.0 }, if settings.roll { roll_rad } else { 0.0 }),
    };
    if !(1.0 / SCALE_MAX..=SCALE_MAX).contains(&applied_scale) {
        let (then_m, now_m) = (old_distance_m, new_distance_m);
        return Err(TemplateFailure::ScaleOutside { then_m, now_m, limit: SCALE_MAX });
    }
    let (image, pixel) = (appearance.image.as_ref(), appearance.pixel);
    let (size, kernel) = (settings.template_size_px, settings.kernel);
    let similarity = Rotation2::new(roll_rad).into_inner() * scale;
    // If the window that is only scaled and rolled matches better, its map is the better one too.
    let surface = surface_map(appearance, now_from_template, left)
        .filter(|map| preparation != Preparation::ScaleRoll && is_believed(map, &similarity));
    let is_wanted =
        settings.surface_warp && settings.scale && settings.roll && preparation == Preparation::Surface;
    let warp = surface.filter(|_| is_wanted);
    let plane = warp
        .filter(|_| settings.warp_model == WarpModel::Homography)
        .and_then(|map| PlaneMap::new(appearance, now_from_template, left, &map));
    let map = match (plane, &warp) {
        (Some(plane), _) => WindowMap::Plane(Box::new(plane)),
        (None, Some(map)) => WindowMap::Linear(*map),
        (None, None) => WindowMap::Linear(Rotation2::new(applied_roll_rad).into_inner() * applied_scale),
    };
    let source = WindowSource { appearance, map, kernel };
    let rolled = source.window(size);
    Ok(Prepared {
        record: ScaleRoll {
            image_from_template: surface.unwrap_or(similarity),
            warped: warp.is_some(),
            scale,
            roll_rad,
            applied_scale,
            applied_roll_rad,
            old_distance_m,
            new_distance_m,
            template_step: appearance.step,
            reference: patch::extract(image, pixel, size / 2, kernel).into(),
            scaled: patch::scale_roll(image, pixel, applied_scale, 0.0, size, kernel).into(),
            rolled: rolled.clone().into(),
        },
        rolled,
        source,
    })
}

/// The prepared template and its source, from which its surroundings can be prepared in the same way.
#[derive(Clone, Debug)]
pub struct Prepared<'a> {
    /// The record of the step.
    pub record: ScaleRoll,
    /// The prepared window: the template to be matched.
    pub rolled: Patch,
    source: WindowSource<'a>,
}

impl Prepared<'_> {
    /// The appearance from which it was prepared.
    pub(super) fn appearance(&self) -> &Appearance {
        self.source.appearance
    }

    /// The template with its surroundings: a window of `size` × `size` px with the same middle.
    pub fn window(&self, size: u32) -> Patch {
        if size == self.rolled.width() { self.rolled.clone() } else { self.source.window(size) }
    }
}

impl Record for ScaleRoll {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("scale", Unit::One, |s| s.scale)
            .describe("Scale by the ratio of distances; applied only where the setting `scale` is on.")
            .formula("D_old / D_new [Kim09 Eq. 6]", &["old_distance_m", "new_distance_m"]);
        r.quantity("roll_rad", Unit::Radian, |s| s.roll_rad)
            .describe("Roll, clockwise on screen; applied only where the setting `roll` is on.")
            .formula(
                "angle in the new left image of a 5 cm segment that was level in the old one [Kim09 Eq. 7–10]",
                &["setting.roll_reference", "point_mast.predicted_left"],
            );
        r.quantity("applied_scale", Unit::One, |s| s.applied_scale).describe("Scale that was applied.");
        r.quantity("applied_roll_rad", Unit::Radian, |s| s.applied_roll_rad)
            .describe("Roll that was applied.");
        r.quantity("warped", Unit::One, |s| s.warped)
            .describe("Whether the window was warped by the slope of the surface instead.");
        r.quantity("old_distance_m", Unit::Metre, |s| s.old_distance_m)
            .describe("Distance from the left camera when the template was taken.");
        r.quantity("new_distance_m", Unit::Metre, |s| s.new_distance_m)
            .describe("Predicted distance from the left camera now.");
        r.quantity("template_step", Unit::One, |s| s.template_step)
            .describe("The stop at which the template was taken.");
        r.array("reference", ArrayKind::Patch, "The template as it was taken", |s| s.reference.view());
        r.array("scaled", ArrayKind::Patch, "The template, scaled to the present distance", |s| {
            s.scaled.view()
        });
        r.array("rolled", ArrayKind::Patch, "The template, scaled and rolled: what was matched", |s| {
            s.rolled.view()
        });
    }
}

/// Names of the arrays of this stage that a panel draws individually.
impl ArrayName {
    /// The template as it was taken.
    pub const REFERENCE: Self = Self::new("reference");
    /// The template, scaled.
    pub const SCALED: Self = Self::new("scaled");
    /// The template, scaled and rolled, as it was matched.
    pub const ROLLED: Self = Self::new("rolled");
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::camera::{Cahv, Cahvor, CameraModel};
    use sightline_geometry::frames::{PoseRecord, Vector3};

    /// Opportunity's left navcam, vectors as printed (domain.md, TV1).
    fn navcam() -> Camera {
        let linear = Cahv::as_printed(
            Point3::new(0.442604, -0.0611635, -1.25106),
            Vector3::new(0.93995, -0.338133, 0.0464979),
            Vector3::new(884.72, 981.763, 24.1472),
            Vector3::new(418.579, -152.039, 1245.75),
        );
        let optical_axis = Vector3::new(0.946551, -0.315595, 0.0666419);
        let model = Cahvor::as_printed(linear, optical_axis, [0.00096, -0.002183, 0.018547]);
        Camera::new(CameraModel::Cahvor(model), 1024, 1024)
    }

    #[test]
    fn scale_and_roll_of_test_vector_five_agree_to_its_last_digit() {
        let new_pose = PoseRecord {
            position_m: [0.9, 0.05, -0.02],
            quaternion_sxyz: [0.9985338374, 0.0440542148, -0.0162881723, 0.026909053],
        };
        let now_from_then = new_pose.to_pose().inverse();
        let target = Point3::new(8.0, -2.6, 0.1);
        let (scale, roll, old_m, new_m) =
            geometry(&target, &navcam(), &now_from_then, &navcam(), RollReference::Horizontal).unwrap();
        assert!((scale - 1.1102799965).abs() < 1e-9, "{scale}");
        assert!((roll.to_degrees() + 5.9429401632).abs() < 1e-6, "{}", roll.to_degrees());
        assert!((old_m - 8.0861170037).abs() < 1e-9 && (new_m - 7.2829529754).abs() < 1e-8);
        let (_, against_old, ..) =
            geometry(&target, &navcam(), &now_from_then, &navcam(), RollReference::OldImage).unwrap();
        assert!(((roll - against_old).to_degrees() + 0.0237861221).abs() < 1e-6);
    }

    /// A face that turns away while the rover approaches: at half a pixel per pixel its template is still usable.
    #[test]
    fn a_template_is_warped_by_slopes_of_up_to_one_pixel_per_pixel() {
        let similarity = Rotation2::new(0.3).into_inner() * 1.38;
        for (slope, is_warped) in [(0.0, true), (0.7, true), (0.99, true), (1.01, false)] {
            let stretched = Matrix2::new(1.0, slope, 0.0, 1.0) * similarity;
            assert_eq!(is_believed(&stretched, &similarity), is_warped, "slope {slope}");
        }
    }
}
