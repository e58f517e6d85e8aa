//! Light: a sun with hard shadows, a bright sky, and the lunar–Lambert law of reflection.
//!
//! Light is scaled so that level ground gets 1 in all: the sky's part f (`diffuse_fraction`) and the sun's
//! 1 − f, so the sun gives (1 − f)/sin(elevation) on a plane that faces it. Radiance is in the unit in which
//! a white Lambert surface under irradiance 1 has radiance 1 (π is left out; exposure scales everything).
//!
//! ```text
//! lit by the sun:  r = A E_sun [ 2L μ0/(μ0 + μ) + (1 − L) μ0 ]          lunar–Lambert, domain.md 11.2
//! lit by the sky:  r = A E_sky [ (1 + n_up)/2 · open + (1 − n_up)/2 · A_ground ]
//! ```
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | μ0, μ | cosines of incidence and emission | – |
//! | A | `albedo` | – |
//! | n_up | part of the normal that points up | – |
//! | open | `sky_open`: part of the sky that nearby rocks leave | – |
//!
//! The second line is the light of a uniform sky on a tilted plane and what the ground sends back up.
//! The sky itself has radiance E_sky, brighter towards the horizon and around the sun (domain.md 11.1).
//! Frames: site; directions are unit. Sources: domain.md 11.1, 11.2.

use crate::frames::Vector3;

use crate::sim::scenario::SunSettings;

/// The light of a scenario.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// Unit direction towards the sun, site frame.
    pub to_sun: Vector3,
    to_sun_f32: [f32; 3],
    sun: f32,
    sky: f32,
    lunar: f32,
    ground_albedo: f32,
}

/// What a point of a surface looks like.
#[derive(Clone, Copy, Debug)]
pub struct Appearance {
    /// Albedo, without unit.
    pub albedo: f32,
    /// Unit normal for shading, site frame.
    pub normal: [f32; 3],
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Light {
    /// The light of the scenario over ground of the given mean albedo.
    pub fn new(settings: &SunSettings, ground_albedo: f64) -> Self {
        let (azimuth_rad, elevation_rad) =
            (settings.azimuth_deg.to_radians(), settings.elevation_deg.to_radians());
        let (level, up) = (elevation_rad.cos(), elevation_rad.sin());
        let to_sun = Vector3::new(level * azimuth_rad.cos(), level * azimuth_rad.sin(), -up);
        Self {
            to_sun,
            to_sun_f32: [to_sun.x as f32, to_sun.y as f32, to_sun.z as f32],
            sun: ((1.0 - settings.diffuse_fraction) / up) as f32,
            sky: settings.diffuse_fraction as f32,
            lunar: settings.lunar_lambert as f32,
            ground_albedo: ground_albedo as f32,
        }
    }

    /// The same light with a part of the direct light alone, 0 to 1: under a cloud.
    pub fn with_direct(self, part: f64) -> Self {
        Self { sun: self.sun * part as f32, ..self }
    }

    /// The radiance of a surface towards `to_camera` (unit).
    #[inline(always)]
    pub fn reflected(&self, look: &Appearance, to_camera: [f32; 3], in_sun: bool, sky_open: f32) -> f32 {
        let up = -look.normal[2];
        let sky = 0.5 * (1.0 + up) * sky_open + 0.5 * (1.0 - up) * self.ground_albedo;
        let mut irradiance = self.sky * sky;
        if in_sun {
            let incidence = dot(look.normal, self.to_sun_f32).max(0.0);
            let emission = dot(look.normal, to_camera).max(0.05);
            let lunar = 2.0 * self.lunar * incidence / (incidence + emission);
            irradiance += self.sun * (lunar + (1.0 - self.lunar) * incidence);
        }
        look.albedo * irradiance
    }

    /// The radiance of the sky in a direction (unit, away from the camera).
    pub fn sky(&self, direction: [f32; 3]) -> f32 {
        let height = (-direction[2]).max(0.0);
        let angle_rad = dot(direction, self.to_sun_f32).clamp(-1.0, 1.0).acos();
        let glow = 1.0 + 0.5 * (-angle_rad / 0.26).exp();
        self.sky * (0.9 + 0.3 * (-height / 0.15).exp()) * glow
    }
}
