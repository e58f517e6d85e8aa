//! The sky: the direct light that the dust transmits, and the radiance of the dome.
//!
//! **Split.** With optical depth τ and zenith angle z of the sun, level ground gets, per unit of the light at the top of
//! the atmosphere on a level plane, `e^{−τ/cos z}` from the sun and `d(τ, z)` from the sky. d is the table of domain.md
//! 11.1 (from Appelbaum & Flood's net flux), interpolated linearly in τ and in z; beyond 75° it is extrapolated with the
//! last slope, and without dust there is no light from the sky.
//!
//! **Dome.** `L(γ) = N (1 + a e^{−γ/15°})`, γ from the sun; N scales the light on level ground to its required value:
//! `∫ L cos θ dω / π = E_sky`, by quadrature over the dome. The horizon itself is not brighter; with a low sun it is so on
//! the sun's side, through γ.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | τ | `optical_depth` | – |
//! | z, θ | zenith angles of the sun and of a direction | rad |
//! | a | `aureole` | – |
//! | N | `even`: radiance far from the sun | of a white Lambert surface under light 1 |
//!
//! Frame: site. Sources: domain.md 11.1; Appelbaum & Flood 1990.

use std::f64::consts::{FRAC_PI_2, TAU};

/// Width of the glow around the sun, rad.
const GLOW_RAD: f64 = 15.0 / 180.0 * std::f64::consts::PI;
/// Optical depths of the table's rows.
const DEPTHS: [f64; 7] = [0.0, 0.3, 0.5, 0.7, 1.0, 2.0, 4.0];
/// Zenith angles of the table's columns, deg.
const ZENITHS_DEG: [f64; 5] = [0.0, 30.0, 45.0, 60.0, 75.0];
/// Light of the sky on level ground per unit of the light on a level plane above the dust.
const DIFFUSE: [[f64; 5]; 7] = [
    [0.0; 5],
    [0.201, 0.221, 0.255, 0.310, 0.415],
    [0.297, 0.320, 0.357, 0.411, 0.467],
    [0.368, 0.390, 0.424, 0.462, 0.460],
    [0.441, 0.456, 0.478, 0.484, 0.415],
    [0.507, 0.492, 0.468, 0.401, 0.285],
    [0.385, 0.347, 0.298, 0.231, 0.162],
];

/// The last interval that starts at or below `value`, and the position in it; the end intervals extrapolate.
fn place(axis: &[f64], value: f64) -> (usize, f64) {
    let last = axis.len().saturating_sub(2);
    let at = axis.iter().rposition(|start| *start <= value).unwrap_or(0).min(last);
    (at, (value - axis[at]) / (axis[at + 1] - axis[at]))
}

/// Direct and diffuse light on level ground per unit of light on a level plane above the dust, dimensionless.
///
/// `elevation_rad` must be above 0.
pub(crate) fn split(optical_depth: f64, elevation_rad: f64) -> [f64; 2] {
    let (row, v) = place(&DEPTHS, optical_depth);
    let (column, u) = place(&ZENITHS_DEG, 90.0 - elevation_rad.to_degrees());
    let along = |row: usize| DIFFUSE[row][column] + u * (DIFFUSE[row][column + 1] - DIFFUSE[row][column]);
    let diffuse = along(row) + v * (along(row + 1) - along(row));
    [(-optical_depth / elevation_rad.sin()).exp(), diffuse.max(0.0)]
}

/// Light on level ground from a dome of radiance `e^{−γ/15°}` around a sun at this elevation.
pub(crate) fn glow_on_level_ground(elevation_rad: f64) -> f64 {
    const ROWS: usize = 60;
    const COLUMNS: usize = 120;
    let (sin_sun, cos_sun) = elevation_rad.sin_cos();
    let mut sum = 0.0;
    for row in 0..ROWS {
        let height_rad = (row as f64 + 0.5) / ROWS as f64 * FRAC_PI_2;
        let (sin, cos) = height_rad.sin_cos();
        for column in 0..COLUMNS {
            let azimuth_rad = (column as f64 + 0.5) / COLUMNS as f64 * TAU;
            let towards = sin * sin_sun + cos * cos_sun * azimuth_rad.cos();
            sum += sin * cos * (-towards.clamp(-1.0, 1.0).acos() / GLOW_RAD).exp();
        }
    }
    sum * (FRAC_PI_2 / ROWS as f64) * (TAU / COLUMNS as f64) / std::f64::consts::PI
}

/// The dome over a site: its radiance, in the unit of a white Lambert surface under light 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dome {
    /// Radiance far from the sun; also the light of the uniform part on level ground.
    pub even: f32,
    /// Light of the glow around the sun on level ground.
    pub glow_on_level: f32,
    aureole: f32,
}

impl Dome {
    /// A dome that gives `light` to level ground, with the sun at `elevation_rad`.
    pub(crate) fn new(light: f64, aureole: f64, elevation_rad: f64) -> Self {
        let glow = aureole * glow_on_level_ground(elevation_rad);
        let even = light / (1.0 + glow);
        Self { even: even as f32, glow_on_level: (light - even) as f32, aureole: aureole as f32 }
    }

    /// Radiance at an angle from the sun given by its cosine.
    pub(crate) fn radiance(&self, cos_from_sun: f32) -> f32 {
        let angle_rad = cos_from_sun.clamp(-1.0, 1.0).acos();
        self.even * (1.0 + self.aureole * (-angle_rad / GLOW_RAD as f32).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_split_is_that_of_the_table() {
        // domain.md 11.1, both values of some cells.
        for (depth, zenith_deg, direct, diffuse) in [
            (0.3, 0.0, 0.741, 0.201),
            (0.5, 60.0, 0.368, 0.411),
            (1.0, 75.0, 0.021, 0.415),
            (4.0, 30.0, 0.010, 0.347),
        ] {
            let [sun, sky] = split(depth, f64::to_radians(90.0 - zenith_deg));
            assert!(
                (sun - direct).abs() < 6e-4 && (sky - diffuse).abs() < 1e-9,
                "{depth} {zenith_deg}: {sun} {sky}"
            );
        }
        // Linear between rows and columns, and below the last column.
        let [_, sky] = split(0.4, 45f64.to_radians());
        assert!((sky - 0.306).abs() < 1e-9, "{sky}");
        let [_, sky] = split(0.3, 5f64.to_radians());
        assert!((sky - 0.485).abs() < 1e-9, "{sky}");
        assert_eq!(split(0.0, 1.0), [1.0, 0.0]);
    }

    #[test]
    fn the_dome_gives_level_ground_its_light() {
        for (elevation_deg, aureole) in [(6.0f64, 2.0), (42.0, 2.0), (90.0, 8.0)] {
            let dome = Dome::new(0.35, aureole, elevation_deg.to_radians());
            let (sin_sun, cos_sun) = elevation_deg.to_radians().sin_cos();
            // Uniformly spread directions, each with the same solid angle.
            let count = 200_000;
            let sum: f64 = (0..count)
                .map(|k| {
                    let up = (f64::from(k) + 0.5) / f64::from(count);
                    let azimuth_rad = 2.399_963_229_728_653 * f64::from(k);
                    let towards = up * sin_sun + (1.0 - up * up).sqrt() * cos_sun * azimuth_rad.cos();
                    2.0 * up * f64::from(dome.radiance(towards as f32)) / f64::from(count)
                })
                .sum();
            assert!((sum / 0.35 - 1.0).abs() < 2e-3, "{elevation_deg}: {sum}");
        }
    }
}
