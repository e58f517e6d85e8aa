//! Light: a sun with hard shadows, a sky dome, and the radiance that surfaces reflect to the camera.
//!
//! Light is scaled so that level ground gets 1 in total under the sun of the settings: the sky's fraction f
//! (`diffuse_fraction`, or from `optical_depth`: `sky.rs`) and the sun's 1 − f. Under another sun ([`Light::under`]) the
//! scale stays: without an optical depth the sun keeps its strength and the sky its light; with one, both follow from the
//! dust. Radiance is in the unit in which a white Lambert surface under light 1 has radiance 1 (π is left out; exposure
//! scales everything).
//!
//! ```text
//! lit by the sun:  r = E_sun · law(A; μ0, μ, g)                                          law.rs
//! lit by the sky:  r = A [ E_even (1 + n_up)/2 · open + E_glow c⁺(n·s)/c⁺(s_up) · open ]
//! lit by ground:   r = A · A_ground E_level (1 − n_up)/2
//! ```
//!
//! The glow around the sun is treated as light from the sun's direction with a softened cosine,
//! `c⁺ = (c + sqrt(c² + 0.04))/2`, which no single rock hides. E_level is all light on level ground.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | μ0, μ, g | cosines of incidence and emission, phase angle | –, –, rad |
//! | A | `albedo` | – |
//! | n, s | normal; direction to the sun | – |
//! | n_up | upward component of the normal | – |
//! | open | `sky_open`: fraction of the sky that nearby rocks leave visible | – |
//!
//! Frames: site; directions are unit. Sources: domain.md 11.1, 11.2; the softened glow is ours.

use sightline_geometry::frames::Vector3;

use crate::light::law::Law;
use crate::light::sky::{Dome, split};
use crate::scenario::SunSettings;

/// The light of a scenario, or of one of its stops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light {
    /// Unit direction towards the sun, site frame.
    pub to_sun: Vector3,
    to_sun_f32: [f32; 3],
    /// Irradiance of a plane that faces the sun.
    sun: f32,
    dome: Dome,
    /// Irradiance from the glow per softened cosine.
    glow: f32,
    /// Radiance that level ground reflects upwards.
    bounce: f32,
    law: Law,
}

/// Appearance of a surface point; black and level by default.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Appearance {
    /// Albedo, without unit.
    pub albedo: f32,
    /// Unit normal for shading, site frame.
    pub normal: [f32; 3],
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A cosine with a soft transition to 0.
#[inline(always)]
fn softened(cosine: f32) -> f32 {
    0.5 * (cosine + (cosine * cosine + 0.04).sqrt())
}

/// Direct and diffuse light on level ground under a sun at `elevation_rad`, on the settings' scale.
fn on_level_ground(settings: &SunSettings, elevation_rad: f64) -> [f64; 2] {
    let scale_rad = settings.elevation_deg.to_radians();
    let Some(optical_depth) = settings.optical_depth else {
        let direct = (1.0 - settings.diffuse_fraction) * elevation_rad.sin() / scale_rad.sin();
        return [direct, settings.diffuse_fraction];
    };
    let all: f64 = split(optical_depth, scale_rad).iter().sum();
    let factor = elevation_rad.sin() / scale_rad.sin() / all;
    split(optical_depth, elevation_rad).map(|part| part * factor)
}

/// Unit direction towards a sun of this azimuth and elevation, site frame (domain.md 1.5).
pub(crate) fn to_sun(azimuth_deg: f64, elevation_deg: f64) -> Vector3 {
    let (azimuth_rad, elevation_rad) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    let (level, up) = (elevation_rad.cos(), elevation_rad.sin());
    Vector3::new(level * azimuth_rad.cos(), level * azimuth_rad.sin(), -up)
}

impl Light {
    /// The light of the scenario over ground of the given mean albedo.
    pub(crate) fn new(settings: &SunSettings, ground_albedo: f64) -> Self {
        let to_sun = to_sun(settings.azimuth_deg, settings.elevation_deg);
        Self::under(settings, ground_albedo, to_sun, 1.0)
    }

    /// The light under another sun (unit direction, site frame), with its direct light multiplied by `direct_factor`.
    ///
    /// The sky keeps its light when a cloud dims the sun. A sun below the horizon gives none; the sky is then that of a
    /// sun on the horizon.
    pub(crate) fn under(
        settings: &SunSettings,
        ground_albedo: f64,
        to_sun: Vector3,
        direct_factor: f64,
    ) -> Self {
        let up = -to_sun.z;
        // A minimum of half a degree keeps the light of a sun on the horizon finite.
        let elevation_rad = up.clamp(-1.0, 1.0).asin().max(0.5f64.to_radians());
        let [direct, diffuse] = on_level_ground(settings, elevation_rad);
        let direct = if up > 0.0 { direct_factor * direct } else { 0.0 };
        let dome = Dome::new(diffuse, settings.aureole, elevation_rad);
        Self {
            to_sun,
            to_sun_f32: [to_sun.x as f32, to_sun.y as f32, to_sun.z as f32],
            sun: (direct / elevation_rad.sin()) as f32,
            dome,
            glow: dome.glow_on_level / softened(up as f32),
            bounce: (ground_albedo * (direct + diffuse)) as f32,
            law: Law::new(settings),
        }
    }

    /// The radiance of a surface towards `to_camera` (unit).
    #[inline(always)]
    pub(crate) fn reflected(
        &self,
        look: &Appearance,
        to_camera: [f32; 3],
        in_sun: bool,
        sky_open: f32,
    ) -> f32 {
        let up = -look.normal[2];
        let towards_sun = dot(look.normal, self.to_sun_f32);
        let sky = 0.5 * (1.0 + up) * self.dome.even + softened(towards_sun) * self.glow;
        let ambient = look.albedo * (sky * sky_open + 0.5 * (1.0 - up) * self.bounce);
        if !in_sun || towards_sun <= 0.0 {
            return ambient;
        }
        let emission = dot(look.normal, to_camera).clamp(0.0, 1.0);
        let cos_phase = dot(to_camera, self.to_sun_f32);
        ambient + self.sun * self.law.radiance(look.albedo, towards_sun.min(1.0), emission, cos_phase)
    }

    /// The radiance of the sky in a direction (unit, away from the camera).
    pub(crate) fn sky(&self, direction: [f32; 3]) -> f32 {
        self.dome.radiance(dot(direction, self.to_sun_f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White Lambert ground without roughness reflects exactly the light that it gets.
    fn level_light(light: &Light, in_sun: bool) -> f32 {
        let white = Appearance { albedo: 1.0, normal: [0.0, 0.0, -1.0] };
        light.reflected(&white, [0.0, 0.0, -1.0], in_sun, 1.0)
    }

    fn lambert() -> SunSettings {
        SunSettings { lunar_lambert: 0.0, diffuse_fraction: 0.35, ..SunSettings::default() }
    }

    #[test]
    fn level_ground_gets_one_and_its_shadow_the_part_of_the_sky() {
        for optical_depth in [None, Some(0.5)] {
            let settings = SunSettings { optical_depth, elevation_deg: 30.0, ..lambert() };
            let light = Light::new(&settings, 0.26);
            let part = if optical_depth.is_none() { 0.35 } else { 0.528 };
            assert!((level_light(&light, true) - 1.0).abs() < 1e-5);
            assert!((level_light(&light, false) - part).abs() < 1e-3, "{}", level_light(&light, false));
        }
    }

    #[test]
    fn a_dimmed_sun_leaves_the_sky_and_a_moved_sun_keeps_its_strength() {
        let settings = lambert();
        let here = Light::new(&settings, 0.26);
        let dimmed = Light::under(&settings, 0.26, here.to_sun, 0.05);
        assert_eq!(level_light(&dimmed, false), level_light(&here, false));
        let sun = level_light(&dimmed, true) - level_light(&dimmed, false);
        assert!((sun - 0.05 * 0.65).abs() < 1e-5, "{sun}");
        let overhead = Light::under(&settings, 0.26, -Vector3::z(), 1.0);
        let expected = 0.65 / 42f32.to_radians().sin() + 0.35;
        assert!((level_light(&overhead, true) - expected).abs() < 1e-5);
        let set = Light::under(&settings, 0.26, Vector3::new(1.0, 0.0, 0.1).normalize(), 1.0);
        assert_eq!(level_light(&set, true), level_light(&set, false));
    }

    #[test]
    fn undercut_faces_get_the_light_of_the_ground() {
        let light = Light::new(&lambert(), 0.26);
        let ambient = |normal: [f32; 3]| {
            light.reflected(&Appearance { albedo: 1.0, normal }, [0.0, 0.0, -1.0], false, 1.0)
        };
        let below = ambient([0.0, 0.0, 1.0]);
        // All of the ground's 0.26 and little of the glow, whose softened cosine nearly vanishes.
        assert!((below - 0.26).abs() < 2e-3, "{below}");
    }

    #[test]
    fn upright_faces_get_the_light_of_the_half_dome_that_they_see() {
        let light = Light::new(&lambert(), 0.0);
        let level = light.to_sun.xy().normalize();
        for (turn, side) in [(1.0, "towards the sun"), (-1.0, "away from it")] {
            let normal = [turn * level.x as f32, turn * level.y as f32, 0.0];
            // Uniformly spread directions of the upper half, each with the same solid angle.
            let count = 40_000u32;
            let seen: f64 = (0..count)
                .map(|k| {
                    let up = (f64::from(k) + 0.5) / f64::from(count);
                    let (sin, cos) = (2.399_963_229_728_653 * f64::from(k)).sin_cos();
                    let flat = (1.0 - up * up).sqrt();
                    let direction = [(flat * cos) as f32, (flat * sin) as f32, -up as f32];
                    f64::from(dot(direction, normal).max(0.0) * light.sky(direction)) * 2.0 / f64::from(count)
                })
                .sum();
            let white = Appearance { albedo: 1.0, normal };
            let drawn = f64::from(light.reflected(&white, [0.0, 0.0, -1.0], false, 1.0));
            assert!((drawn / seen - 1.0).abs() < 0.05, "{side}: {drawn} {seen}");
        }
    }

    #[test]
    fn opposite_a_low_sun_neither_sky_nor_plain_outshines_the_ground_at_one_s_feet_by_far() {
        for elevation_deg in [5.0, 8.0, 12.0] {
            let settings = SunSettings { elevation_deg, azimuth_deg: 180.0, ..SunSettings::default() };
            let light = Light::new(&settings, 0.26);
            let soil = Appearance { albedo: 0.26, normal: [0.0, 0.0, -1.0] };
            let feet = light.reflected(&soil, [0.0, 0.0, -1.0], true, 1.0);
            let horizon = light.reflected(&soil, [-0.999_8, 0.0, -0.02], true, 1.0);
            let sky = light.sky([1.0, 0.0, 0.0]);
            assert!(horizon < 2.0 * feet && sky < 2.0 * feet, "{elevation_deg}: {feet} {horizon} {sky}");
            // The horizon below the sun is bright because of the glow at the sun's elevation.
            let glow = 1.0 + 2.0 * (-elevation_deg as f32 / 15.0).exp();
            assert!((light.sky([-1.0, 0.0, 0.0]) / sky / glow - 1.0).abs() < 1e-4);
        }
    }
}
