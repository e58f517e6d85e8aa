//! What the surfaces look like: albedo and shading normal of soil and rock.
//!
//! Soil: two-dimensional octaves over the site's plane; its normal is the smooth slope of the height field
//! plus the micro-slope. Rock: three-dimensional octaves about the rock's centre, on the face's normal;
//! each rock has its own brightness, and dust lies on what faces up. The micro-relief tilts normals only:
//! the surface that rays meet is that of `terrain.rs` and `rocks.rs`.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | c | `cutoff_m` | m: wavelengths below it are left out, below twice it are weakened (`texture.rs`) |
//!
//! Frames: site. Sources: domain.md 10.4.

use crate::frames::{Point3, Vector3};

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
            albedo_exponent: 0.05,
            albedo_std: settings.albedo_std,
            slope_std,
        };
        // A rock is no larger than half a metre: longer waves would only change its brightness.
        let rock_longest_m = settings.longest_m.min(0.2).max(settings.shortest_m);
        Self {
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
        let slope = terrain.smooth_slope_at(point.x, point.y);
        Appearance {
            albedo: self.soil_albedo * (1.0 + texture.albedo).max(0.1),
            normal: unit([slope[0] + texture.slope[0], slope[1] + texture.slope[1], -1.0]),
        }
    }

    /// A rock at a point of one of its faces.
    #[inline(always)]
    pub fn rock(&self, rock: &Rock, point: &Point3, face: &Vector3, cutoff_m: f32) -> Appearance {
        let p = point - rock.centre;
        let shift = rock.texture_shift_m;
        let texture = self.rock.at([p.x + shift[0], p.y + shift[1], p.z + shift[2]], cutoff_m);
        let n = [face.x as f32, face.y as f32, face.z as f32];
        // A relief of height b over the face tilts its normal by the part of ∇b that lies in the face.
        let out = n[0] * texture.slope[0] + n[1] * texture.slope[1] + n[2] * texture.slope[2];
        let normal = unit(std::array::from_fn(|k| n[k] - (texture.slope[k] - out * n[k])));
        let up = (-n[2]).max(0.0);
        let dust = self.dust * up * up;
        let own = self.rock_albedo * rock.brightness;
        let albedo = own + dust * (self.soil_albedo - own);
        Appearance { albedo: albedo * (1.0 + texture.albedo).max(0.1), normal }
    }
}
