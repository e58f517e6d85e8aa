//! Photometry of the target at each stop: its brightness, and the angles of illumination and view ([Kim09 §7.1], R136; the
//! export is ours).
//!
//! ```text
//! n = ± (∂p/∂x × ∂p/∂y) / │…│      towards the camera: normal of the surface around the target, by stereo
//! i = ∠(n, s),   e = ∠(n, v),   g = ∠(s, v)
//! rate = mean level of the window / exposure time
//! ```
//! Levels are recorded grey values as fractions of full scale. Without a radiometric calibration the rate is the radiance up
//! to a factor, which is the same for all stops of a camera if its offset was subtracted. The surface is the plane fitted by
//! stereo over the window: relief is averaged, and the normal is accurate to some degrees. Angles to the sun are null if the
//! recording lacks the sun's direction; angles to the surface are null if stereo found no slope.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | p | the target's surface; `Located::surface_by_pixel` | m per px, rover |
//! | s | direction to the sun | rover |
//! | v | direction to the left camera | rover |
//! | i, e, g | `incidence_deg`, `emission_deg`, `phase_deg` | deg |

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Pose, Vector3};
use sightline_track::locate::template::TemplateSettings;
use sightline_track::trace::StepTrace;
use sightline_vision::image::patch::{self, Patch};
use sightline_world::traverse::StopLight;

/// The photometry of the target at one stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Photometry {
    /// The stop, from 0.
    pub step: usize,
    /// Mean level of the window at the target, fraction of full scale.
    pub mean_level: f64,
    /// Standard deviation of the level over the window, fraction of full scale.
    pub std_level: f64,
    /// Exposure time, s; null if unknown.
    pub exposure_s: Option<f64>,
    /// Mean level over exposure time, fraction of full scale per s; null without an exposure time.
    pub rate_per_s: Option<f64>,
    /// Angle between the surface normal and the direction to the sun, deg.
    pub incidence_deg: Option<f64>,
    /// Angle between the surface normal and the direction to the camera, deg.
    pub emission_deg: Option<f64>,
    /// Angle between the directions to the sun and the camera, deg.
    pub phase_deg: Option<f64>,
    /// Distance of the target from the left camera, m.
    pub range_m: f64,
}

/// The photometry of an accepted update or a designation; `None` for any other step.
pub fn photometry(
    trace: &StepTrace,
    site_from_rover: &Pose,
    light: Option<&StopLight>,
    settings: &TemplateSettings,
) -> Option<Photometry> {
    if trace.verdict().is_some_and(|verdict| !verdict.accepted) {
        return None;
    }
    let located = trace.located()?;
    let window = window(trace, settings)?;
    let position = located.position_in_rover?;
    let to_camera = trace.point_mast.left.model.centre() - position;
    let normal = located.surface_by_pixel.and_then(|surface| {
        let normal: Vector3 = surface.column(0).cross(&surface.column(1)).try_normalize(0.0)?;
        Some(if normal.dot(&to_camera) < 0.0 { -normal } else { normal })
    });
    let to_sun = light.map(|light| site_from_rover.rotation.inverse() * light.to_sun_in_site());
    let angle_deg = |a: Option<Vector3>, b: Option<Vector3>| Some(a?.angle(&b?).to_degrees());
    let exposure_s = light.and_then(|light| light.exposure_s);
    let mean_level = window.mean()?;
    Some(Photometry {
        step: trace.step,
        mean_level,
        std_level: window.std()?,
        exposure_s,
        rate_per_s: exposure_s.filter(|time_s| *time_s > 0.0).map(|time_s| mean_level / time_s),
        incidence_deg: angle_deg(normal, to_sun),
        emission_deg: angle_deg(normal, Some(to_camera)),
        phase_deg: angle_deg(to_sun, Some(to_camera)),
        range_m: to_camera.norm(),
    })
}

/// The image window at the target, with the size of the template.
fn window(trace: &StepTrace, settings: &TemplateSettings) -> Option<Patch> {
    if let Some(matched) = trace.template().and_then(|evidence| evidence.match_template.as_ref()) {
        return matched.matched.get().cloned();
    }
    let (designation, capture) = (trace.update.target.designation, trace.capture()?);
    let half = settings.template_size_px / 2;
    (trace.verdict().is_none() && designation.step == trace.step)
        .then(|| patch::extract(&capture.pair.left, designation.pixel, half, settings.kernel))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track;
    use sightline_geometry::frames::Pixel;
    use sightline_rover::pipeline::Stops;
    use sightline_testing::PlaneWorld;
    use sightline_track::settings::Settings;
    use sightline_track::target::Designation;

    #[test]
    fn the_angles_of_a_turned_plane_are_those_of_its_normal_and_the_level_is_the_images() {
        let mut world = PlaneWorld::new(vec![Pose::identity(), Pose::translation(0.7, 0.0, 0.0)]);
        let turn_rad = 40_f64.to_radians();
        world.normal = Vector3::new(turn_rad.cos(), -turn_rad.sin(), 0.0);
        let light = StopLight { sun_azimuth_deg: 200.0, sun_elevation_deg: 30.0, exposure_s: Some(0.25) };
        let (settings, centre) = (Settings::default(), Pixel::new(127.5, 127.5));
        let steps = track::run(&world, Designation::new(0, centre), &settings).unwrap();
        let to_sun = light.to_sun_in_site();
        for step in &steps {
            let pose = world.site_from_rover(step.step);
            let found = photometry(step, &pose, Some(&light), &settings.template).unwrap();
            let target = world.plane_point(0, &world.left, centre).unwrap();
            let to_camera = pose * world.left.model.centre() - target;
            let truth = [
                (found.incidence_deg, (-world.normal).angle(&to_sun)),
                (found.emission_deg, (-world.normal).angle(&to_camera)),
                (found.phase_deg, to_camera.angle(&to_sun)),
            ];
            for (found_deg, true_rad) in truth {
                assert!((found_deg.unwrap() - true_rad.to_degrees()).abs() < 1.0, "{found:?}");
            }
            assert!((found.range_m - to_camera.norm()).abs() < 0.05);
            // The texture's level is 0.5 and varies by 0.03 in each of sixteen waves.
            assert!((0.3..0.7).contains(&found.mean_level) && found.std_level > 0.01);
            assert_eq!(found.rate_per_s, Some(found.mean_level / 0.25));
        }
    }

    #[test]
    fn without_light_the_sun_has_no_angles() {
        let world = PlaneWorld::new(vec![Pose::identity()]);
        let (settings, pixel) = (Settings::default(), Pixel::new(127.5, 127.5));
        let steps = track::run(&world, Designation::new(0, pixel), &settings).unwrap();
        let found = photometry(&steps[0], &Pose::identity(), None, &settings.template).unwrap();
        assert!(found.incidence_deg.is_none() && found.phase_deg.is_none() && found.rate_per_s.is_none());
        assert!(found.emission_deg.unwrap() < 1.0, "{found:?}");
    }
}
