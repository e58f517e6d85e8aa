//! Appearance of the surfaces: albedo and shading normal of soil and rock.
//!
//! Soil: two-dimensional octaves over the site's plane; its normal is the smooth slope of the height field plus the
//! micro-slope. Rock: three-dimensional octaves about the rock's centre, on the face's normal; each rock has its own
//! brightness, and upward faces have patches of dust. Grains, drifts, veins and pits are added (`details.rs`). The
//! micro-relief tilts normals only: the surface that rays meet is that of `terrain.rs` and `rocks.rs`.
//!
//! **Spectrum.** The albedo's power per unit area of the frequency plane falls as f^−β (`spectrum_slope`): octaves with
//! amplitude ∝ λ^h have the variance λ^{2h} in a band of area ∝ λ^{−2}, so h = (β − 2)/2.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | β | `spectrum_slope` | – |
//! | c | `cutoff_m` | m: shorter wavelengths are left out, those up to twice it weakened (`texture.rs`) |
//!
//! Frames: site. Sources: domain.md 10.4.

use sightline_geometry::frames::{Point3, Vector3};

use crate::ground::details::{RockDetails, SoilDetails};
use crate::ground::rocks::Rock;
use crate::ground::terrain::Terrain;
use crate::ground::texture::{LANES, OctaveSettings, Octaves, TextureSample, mix};
use crate::ground::value_noise::Points;
use crate::light::reflection::Appearance;
use crate::scenario::TextureSettings;

/// A point of a rock's face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face<'a> {
    /// The rock.
    pub rock: &'a Rock,
    /// The point, m, site frame.
    pub point: Point3,
    /// The face's outward unit normal, site frame.
    pub normal: Vector3,
}

/// The appearance of soil and rock.
#[derive(Clone, Debug)]
pub(crate) struct Surfaces {
    soil: Octaves<2>,
    rock: Octaves<3>,
    soil_details: SoilDetails,
    rock_details: RockDetails,
    albedo_std: f32,
    soil_albedo: f32,
    rock_albedo: f32,
    dust: f32,
}

#[inline(always)]
fn unit(v: [f32; 3]) -> [f32; 3] {
    let scale = 1.0 / (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|c| c * scale)
}

impl Surfaces {
    /// Builds the appearance from the scenario's texture settings.
    pub(crate) fn new(settings: &TextureSettings, seed: u64) -> Self {
        let octaves = |longest_m: f64, slope_std: f64| OctaveSettings {
            longest_m,
            shortest_m: settings.shortest_m,
            ratio: 2.1,
            albedo_exponent: 0.5 * (settings.spectrum_slope - 2.0),
            albedo_std: settings.albedo_std,
            slope_std,
        };
        // A rock is at most about half a metre wide: longer waves would only change its mean brightness.
        let rock_longest_m = settings.longest_m.min(0.2).max(settings.shortest_m);
        let (grains, drifts) = (settings.grain_cover, settings.drift_cover);
        Self {
            soil_details: SoilDetails::new(grains, drifts, settings.albedo_std, seed),
            rock_details: RockDetails::new(settings.albedo_std, seed),
            albedo_std: settings.albedo_std as f32,
            soil: Octaves::new(&octaves(settings.longest_m, settings.soil_slope_std), mix(seed ^ 0x5011)),
            rock: Octaves::new(&octaves(rock_longest_m, settings.rock_slope_std), mix(seed ^ 0x20c4)),
            soil_albedo: settings.soil_albedo as f32,
            rock_albedo: settings.rock_albedo as f32,
            dust: settings.dust as f32,
        }
    }

    /// The soil at the first `count` of many points of the ground, (x, y) by lane, m, site frame.
    #[inline(always)]
    pub(crate) fn soil(
        &self,
        terrain: &Terrain,
        p_m: &[[f64; LANES]; 2],
        cutoff_m: &[f32; LANES],
        count: usize,
    ) -> [Appearance; LANES] {
        let points = Points::new(p_m);
        let texture = self.soil.at_lanes(&points, cutoff_m);
        let drifts = self.soil_details.drifts(&points);
        let grains = self.soil_details.grains(p_m, cutoff_m);
        let mut looks = [Appearance::default(); LANES];
        for (lane, look) in looks.iter_mut().enumerate().take(count) {
            let slope = terrain.smooth_slope_at(p_m[0][lane], p_m[1][lane]);
            let drift = drifts[lane];
            let (bare, rough) = (1.0 - 0.7 * drift, 1.0 - 0.4 * drift);
            let albedo = texture.albedo[lane] * rough + bare * grains.albedo[lane];
            let albedo = albedo + 0.7 * self.albedo_std * drift;
            let mut normal = [0.0, 0.0, -1.0];
            for k in 0..2 {
                normal[k] = slope[k] + rough * texture.slope[k][lane] + bare * grains.slope[k][lane];
            }
            *look = Appearance { albedo: self.soil_albedo * (1.0 + albedo).max(0.1), normal: unit(normal) };
        }
        looks
    }

    /// One rock at points of its faces; lanes without a point come last.
    #[inline(always)]
    pub(crate) fn rock(
        &self,
        faces: &[Option<Face<'_>>; LANES],
        cutoff_m: &[f32; LANES],
    ) -> [Appearance; LANES] {
        let (mut p_m, mut veins) = ([[0.0; LANES]; 3], [0.0; LANES]);
        let mut has_veins = false;
        for (lane, face) in faces.iter().flatten().enumerate() {
            let (from_centre, look) = (face.point - face.rock.centre, &face.rock.look);
            for (k, axis) in p_m.iter_mut().enumerate() {
                axis[lane] = from_centre[k] + look.texture_shift_m[k];
            }
            veins[lane] = look.veins;
            has_veins |= look.veins > 0.0;
        }
        for axis in &mut p_m {
            // Lanes without a point repeat the first.
            let first = axis[0];
            axis.iter_mut().skip(faces.iter().flatten().count()).for_each(|at| *at = first);
        }
        let points = Points::new(&p_m);
        let mut texture = self.rock.at_lanes(&points, cutoff_m);
        if has_veins {
            veins = self.rock_details.veins(&points, &veins, cutoff_m);
        }
        let mut looks = [Appearance::default(); LANES];
        for (lane, face) in faces.iter().flatten().enumerate() {
            if face.rock.look.veins > 0.0 {
                texture.albedo[lane] += veins[lane];
            }
            let mut sample = TextureSample {
                albedo: texture.albedo[lane],
                slope: [texture.slope[0][lane], texture.slope[1][lane], texture.slope[2][lane]],
            };
            if face.rock.look.pits > 0.0 {
                let p_m = [p_m[0][lane], p_m[1][lane], p_m[2][lane]];
                let pits = self.rock_details.pits(p_m, face.rock.look.pits, cutoff_m[lane]);
                sample.albedo += pits.albedo;
                sample.slope.iter_mut().zip(pits.slope).for_each(|(sum, slope)| *sum += slope);
            }
            looks[lane] = self.on_face(face, &sample);
        }
        looks
    }

    /// Appearance of a rock with this texture on one of its faces.
    fn on_face(&self, face: &Face<'_>, texture: &TextureSample<3>) -> Appearance {
        let n = [face.normal.x as f32, face.normal.y as f32, face.normal.z as f32];
        // A relief of height b over the face tilts its normal by the component of ∇b in the face.
        let out = n[0] * texture.slope[0] + n[1] * texture.slope[1] + n[2] * texture.slope[2];
        let normal = unit(std::array::from_fn(|k| n[k] - (texture.slope[k] - out * n[k])));
        let up = (-n[2]).max(0.0);
        // Dust fills the hollows of the noise and leaves its crests bare.
        let dust = (self.dust * up * up * (1.0 + 3.0 * texture.albedo)).clamp(0.0, 1.0);
        let bare = self.rock_albedo * face.rock.look.brightness;
        let albedo = bare + dust * (self.soil_albedo - bare);
        Appearance { albedo: albedo * (1.0 + texture.albedo).max(0.1), normal }
    }
}
