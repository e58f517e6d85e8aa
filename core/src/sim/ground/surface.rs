//! What the surfaces look like: albedo and shading normal of soil and rock.
//!
//! Soil: two-dimensional octaves over the site's plane; its normal is the smooth slope of the height field
//! plus the micro-slope. Rock: three-dimensional octaves about the rock's centre, on the face's normal;
//! each rock has its own brightness, and dust lies in patches on what faces up. Grains, drifts, veins and pits
//! come on top (`details.rs`). The micro-relief tilts normals only: the surface that rays meet is that of
//! `terrain.rs` and `rocks.rs`.
//!
//! **Spectrum.** The albedo's power per unit area of the frequency plane falls as f^−β (`spectrum_slope`): octaves with
//! amplitude ∝ λ^h hold their variance λ^{2h} in a band of area ∝ λ^{−2}, so h = (β − 2)/2.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | β | `spectrum_slope` | – |
//! | c | `cutoff_m` | m: wavelengths below it are left out, below twice it are weakened (`texture.rs`) |
//!
//! Frames: site. Sources: domain.md 10.4.

use crate::frames::{Point3, Vector3};

use crate::sim::ground::details::{RockDetails, SoilDetails};
use crate::sim::ground::rocks::Rock;
use crate::sim::ground::terrain::Terrain;
use crate::sim::ground::texture::{OctaveSettings, Octaves, mix};
use crate::sim::light::reflection::Appearance;
use crate::sim::scenario::TextureSettings;

/// The look of soil and rock.
#[derive(Clone, Debug)]
pub struct Surfaces {
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
    /// The look of the scenario's surfaces.
    pub fn new(settings: &TextureSettings, seed: u64) -> Self {
        let octaves = |longest_m: f64, slope_std: f64| OctaveSettings {
            longest_m,
            shortest_m: settings.shortest_m,
            ratio: 2.1,
            albedo_exponent: 0.5 * (settings.spectrum_slope - 2.0),
            albedo_std: settings.albedo_std,
            slope_std,
        };
        // A rock is no larger than half a metre: longer waves would only change its brightness.
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

    /// The soil at a point of the ground.
    #[inline(always)]
    pub fn soil(&self, terrain: &Terrain, point: &Point3, cutoff_m: f32) -> Appearance {
        let texture = self.soil.at(point.x, point.y, cutoff_m);
        let drift = self.soil_details.drift(point.x, point.y);
        let grains = self.soil_details.grains(point.x, point.y, cutoff_m);
        let slope = terrain.smooth_slope_at(point.x, point.y);
        let (bare, rough) = (1.0 - 0.7 * drift, 1.0 - 0.4 * drift);
        let albedo = texture.albedo * rough + bare * grains.albedo + 0.7 * self.albedo_std * drift;
        let [dx, dy]: [f32; 2] =
            std::array::from_fn(|k| slope[k] + rough * texture.slope[k] + bare * grains.slope[k]);
        Appearance { albedo: self.soil_albedo * (1.0 + albedo).max(0.1), normal: unit([dx, dy, -1.0]) }
    }

    /// A rock at a point of one of its faces.
    #[inline(always)]
    pub fn rock(&self, rock: &Rock, point: &Point3, face: &Vector3, cutoff_m: f32) -> Appearance {
        let (p, own) = (point - rock.centre, &rock.look);
        let shift = own.texture_shift_m;
        let p_m = [p.x + shift[0], p.y + shift[1], p.z + shift[2]];
        let mut texture = self.rock.at(p_m, cutoff_m);
        if own.veins > 0.0 {
            texture.albedo += self.rock_details.veins(p_m, own.veins, cutoff_m);
        }
        if own.pits > 0.0 {
            let pits = self.rock_details.pits(p_m, own.pits, cutoff_m);
            texture.albedo += pits.albedo;
            texture.slope.iter_mut().zip(pits.slope).for_each(|(sum, slope)| *sum += slope);
        }
        let n = [face.x as f32, face.y as f32, face.z as f32];
        // A relief of height b over the face tilts its normal by the part of ∇b that lies in the face.
        let out = n[0] * texture.slope[0] + n[1] * texture.slope[1] + n[2] * texture.slope[2];
        let normal = unit(std::array::from_fn(|k| n[k] - (texture.slope[k] - out * n[k])));
        let up = (-n[2]).max(0.0);
        // Dust lies in the hollows of the noise and leaves its crests bare.
        let dust = (self.dust * up * up * (1.0 + 3.0 * texture.albedo)).clamp(0.0, 1.0);
        let bare = self.rock_albedo * own.brightness;
        let albedo = bare + dust * (self.soil_albedo - bare);
        Appearance { albedo: albedo * (1.0 + texture.albedo).max(0.1), normal }
    }
}
