//! The laws by which a surface reflects the sun: lunar–Lambert, or Hapke's.
//!
//! Both have the form `r = μ0 f(μ0, μ, g; A)`, radiance in the unit of a white Lambert surface that faces a sun of
//! irradiance 1, with `f` symmetric in μ0 and μ (Helmholtz reciprocity).
//!
//! ```text
//! lunar–Lambert  f = A [ 2L/(m0 + m) + (1 − L) ]
//! Hapke          f = (w/4) /(m0 + m) · { [1 + B(g)] P(g) + H(m0) H(m) − 1 }
//!                H(x) = (1 + 2x)/(1 + 2xγ),  γ = sqrt(1 − w),  B = B0/(1 + tan(g/2)/h)
//!                P = (1+c)/2 · (1−b²)/(1 − 2b cos g + b²)^{3/2} + (1−c)/2 · (1−b²)/(1 + 2b cos g + b²)^{3/2}
//! roughness      m = sqrt(μ² + s²),  s = tan(mean slope)
//! ```
//!
//! The last line is ours: a level plain seen or lit at a grazing angle consists of slopes below the resolution that hide
//! one another, so that its effective cosine does not approach 0. Without it a plain under a low sun is three times as
//! bright at the horizon as near the camera. It is symmetric and preserves reciprocity.
//!
//! The albedo A of a texture is, for Hapke's law, the reflectance under uniform light from all directions:
//! `A = (1 − γ)/(1 + γ)`, so `γ = (1 − A)/(1 + A)` and `w = 1 − γ²`: soil of 0.26 has w = 0.66, rock of 0.19 has 0.54.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | μ0, μ | cosines of incidence and emission | – |
//! | g | phase angle between the sun and the camera | rad |
//! | A | `albedo` | – |
//! | L | `lunar` | – |
//! | b, c | `lobe`, `backscatter` | – |
//! | B0, h | `surge`, `surge_width` | – |
//! | w | single-scattering albedo | – |
//!
//! Sources: domain.md 11.2; Hapke 1981; McEwen 1991.

use crate::scenario::{Reflectance, SunSettings};

/// A law of reflection with its parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Law {
    kind: Reflectance,
    lunar: f32,
    /// s², dimensionless.
    roughness: f32,
    lobe: f32,
    backscatter: f32,
    surge: f32,
    surge_width: f32,
}

/// x^{−3/2}.
#[inline(always)]
fn inverse_three_halves(x: f32) -> f32 {
    1.0 / (x * x.sqrt())
}

impl Law {
    /// The law of the settings.
    pub(crate) fn new(settings: &SunSettings) -> Self {
        Self {
            kind: settings.reflectance,
            lunar: settings.lunar_lambert as f32,
            roughness: settings.roughness_deg.to_radians().tan().powi(2) as f32,
            lobe: settings.hapke_lobe as f32,
            backscatter: settings.hapke_backscatter as f32,
            surge: settings.hapke_surge as f32,
            surge_width: settings.hapke_surge_width as f32,
        }
    }

    /// Radiance under a sun of irradiance 1; cosines of incidence and emission (0 to 1) and of the phase angle.
    #[inline(always)]
    pub(crate) fn radiance(&self, albedo: f32, incidence: f32, emission: f32, cos_phase: f32) -> f32 {
        // The floor keeps a surface without roughness finite where both cosines vanish.
        let [m0, m] = [incidence, emission].map(|cosine| (cosine * cosine + self.roughness + 1e-6).sqrt());
        let f = match self.kind {
            Reflectance::LunarLambert => albedo * (2.0 * self.lunar / (m0 + m) + 1.0 - self.lunar),
            Reflectance::Hapke => {
                let gamma = (1.0 - albedo) / (1.0 + albedo);
                let h = |x: f32| (1.0 + 2.0 * x) / (1.0 + 2.0 * x * gamma);
                let single = (1.0 + self.opposition(cos_phase)) * self.phase_function(cos_phase);
                0.25 * (1.0 - gamma * gamma) / (m0 + m) * (single + h(m0) * h(m) - 1.0)
            }
        };
        incidence * f
    }

    /// P(g), whose mean over all directions is 1.
    #[inline(always)]
    fn phase_function(&self, cos_phase: f32) -> f32 {
        let (b, c) = (self.lobe, self.backscatter);
        let back = inverse_three_halves(1.0 - 2.0 * b * cos_phase + b * b);
        let forward = inverse_three_halves(1.0 + 2.0 * b * cos_phase + b * b);
        0.5 * (1.0 - b * b) * ((1.0 + c) * back + (1.0 - c) * forward)
    }

    /// B(g).
    #[inline(always)]
    fn opposition(&self, cos_phase: f32) -> f32 {
        let tan_half = ((1.0 - cos_phase).max(0.0) / (1.0 + cos_phase).max(1e-6)).sqrt();
        self.surge / (1.0 + tan_half / self.surge_width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(change: impl Fn(&mut SunSettings)) -> Law {
        let mut settings = SunSettings::default();
        change(&mut settings);
        Law::new(&settings)
    }

    fn laws() -> [Law; 2] {
        [law(|_| {}), law(|s| s.reflectance = Reflectance::Hapke)]
    }

    /// Light reflected into the whole hemisphere over the incident light: (1/π) ∫ r μ dω / μ0.
    fn hemispherical(law: &Law, albedo: f32, incidence: f32) -> f64 {
        let count = 40_000u32;
        let sine = (1.0 - incidence * incidence).sqrt();
        let sum: f64 = (0..count)
            .map(|k| {
                let emission = (k as f32 + 0.5) / count as f32;
                let azimuth = 2.399_963_2 * f64::from(k);
                let phase =
                    incidence * emission + sine * (1.0 - emission * emission).sqrt() * azimuth.cos() as f32;
                f64::from(law.radiance(albedo, incidence, emission, phase) * emission)
            })
            .sum();
        2.0 * sum / f64::from(count) / f64::from(incidence)
    }

    #[test]
    fn light_may_run_either_way() {
        for law in laws() {
            for (a, b, phase) in [(0.1, 0.9, 0.3), (0.02, 0.5, -0.4), (0.7, 0.3, 0.9)] {
                let there = law.radiance(0.3, a, b, phase) / a;
                let back = law.radiance(0.3, b, a, phase) / b;
                assert!((there / back - 1.0).abs() < 1e-5, "{there} {back}");
            }
        }
    }

    #[test]
    fn no_surface_sends_back_more_than_it_gets() {
        for law in laws() {
            for albedo in [0.19, 0.26, 0.5] {
                for incidence in [0.05, 0.2, 0.7, 1.0] {
                    let sent = hemispherical(&law, albedo, incidence);
                    assert!(sent > 0.3 * f64::from(albedo) && sent < 1.0, "{albedo} {incidence}: {sent}");
                }
            }
        }
    }

    #[test]
    fn smooth_laws_send_back_what_their_integrals_say() {
        for incidence in [0.2f32, 0.6, 1.0] {
            let x = f64::from(incidence);
            // ∫ 4L μ/(μ0 + μ) dμ + (1 − L) with L = 1/2.
            let lunar = law(|s| s.roughness_deg = 0.0);
            let expected = 0.26 * (2.0 * (1.0 - x * ((1.0 + x) / x).ln()) + 0.5);
            let sent = hemispherical(&lunar, 0.26, incidence);
            assert!((sent / expected - 1.0).abs() < 2e-3, "{sent} {expected}");
            // With an even phase function and no surge, Hapke's is (w/2) H(μ0) ∫ H(μ) μ/(μ0 + μ) dμ, by partial
            // fractions of x (1 + 2x)/((1 + 2γx)(μ0 + x)) = A + B/(1 + 2γx) + C/(μ0 + x).
            let hapke = law(|s| {
                s.reflectance = Reflectance::Hapke;
                (s.roughness_deg, s.hapke_lobe, s.hapke_surge) = (0.0, 0.0, 0.0);
            });
            let gamma: f64 = 0.74 / 1.26;
            let b = -(1.0 - 1.0 / gamma) / (2.0 * gamma) / (x - 0.5 / gamma);
            let c = -x * (1.0 - 2.0 * x) / (1.0 - 2.0 * gamma * x);
            let integral = 1.0 / gamma + b * (2.0 * gamma).ln_1p() / (2.0 * gamma) + c * ((1.0 + x) / x).ln();
            let h = (1.0 + 2.0 * x) / (1.0 + 2.0 * gamma * x);
            let expected = 0.5 * (1.0 - gamma * gamma) * h * integral;
            let sent = hemispherical(&hapke, 0.26, incidence);
            assert!((sent / expected - 1.0).abs() < 2e-3, "{sent} {expected}");
        }
    }

    #[test]
    fn the_phase_function_keeps_the_light() {
        let law = law(|_| {});
        let mean: f64 = (0..20_000)
            .map(|k| f64::from(law.phase_function((f64::from(k) + 0.5) as f32 / 10_000.0 - 1.0)) / 20_000.0)
            .sum();
        assert!((mean - 1.0).abs() < 1e-4, "{mean}");
    }

    #[test]
    fn hapke_shines_opposite_the_sun_and_lunar_lambert_does_not() {
        let ratio = |law: &Law, degrees: f32| {
            // A level surface seen from straight above, the sun leaving the zenith.
            let cosine = degrees.to_radians().cos();
            law.radiance(0.26, 1.0, 1.0, 1.0) / law.radiance(0.26, 1.0, 1.0, cosine)
        };
        let [lunar, hapke] = laws();
        let plain = law(|s| (s.reflectance, s.hapke_surge) = (Reflectance::Hapke, 0.0));
        assert_eq!(ratio(&lunar, 6.0), 1.0);
        // B falls to a half where tan(g/2) = h: by 5.7° the surge must be half gone; the lobe does not change that fast.
        assert!(ratio(&hapke, 5.725) > 1.2, "{}", ratio(&hapke, 5.725));
        assert!(ratio(&plain, 5.725) < 1.05, "{}", ratio(&plain, 5.725));
        assert!((hapke.opposition(5.725f32.to_radians().cos()) - 0.5).abs() < 1e-3);
    }

    #[test]
    fn a_plain_under_a_low_sun_does_not_shine_at_the_horizon() {
        let incidence = 10f32.to_radians().sin();
        for law in laws() {
            let at = |emission: f32| law.radiance(0.26, incidence, emission, emission * incidence);
            assert!(at(0.02) < 2.2 * at(0.9), "{} {}", at(0.02), at(0.9));
        }
        let smooth = law(|s| s.roughness_deg = 0.0);
        assert!(
            smooth.radiance(0.26, incidence, 0.02, 0.0) > 3.0 * smooth.radiance(0.26, incidence, 0.9, 0.0)
        );
    }
}
