//! Surface details beyond noise: grains and drifts on soil, veins and pits in rock.
//!
//! * **Grains** are small stones below the size of the geometric pebbles: five-sided frusta in the cells of jittered
//!   square lattices, at most one to a cell and wholly inside it, so that one hash finds it. Their sides are
//!   within a circle of radius r and have the slope 0.8, their top is flat, and each grain has its own albedo.
//! * **Drifts** are smooth patches of fine bright dust: where noise of 0.4 and 0.8 m exceeds a threshold, most
//!   grains vanish and the soil's micro-relief is flattened.
//! * **Veins** are thin bright sheets through a rock: where noise of 6 and 12 cm crosses zero.
//! * **Pits** are small dark hollows, spheres in the cells of a lattice cut by the surface.
//!
//! Nothing repeats (`texture.rs`: hashes of full lattice coordinates). Each detail fades out like an octave of its own
//! size when an image cannot resolve it. All contrasts are multiples of the texture's `albedo_std`, so that a surface
//! without texture has no details either; slopes of grains and pits are those of solid shapes.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | r | radius of a grain or pit | m |
//! | c | `cutoff_m` | m |
//!
//! Frames: soil at (x, y) of the site, rock about its centre. Source: ours, after domain.md 10.4.

#![expect(
    clippy::needless_range_loop,
    reason = "plain loops over lanes become vectors, adaptors do not always"
)]

use crate::ground::texture::{LANES, OctaveSettings, Octaves, TextureLanes, least, mix, weight};
use crate::ground::value_noise::{Cells, Points, cell_hash, cell_of};

/// Sides of the cells of the grains' lattices, m: mean diameters 1.3 cm, 6 mm and 3 mm.
const GRAIN_CELLS_M: [f64; 3] = [0.026, 0.012, 0.006];
/// Side of the cells of the pits' lattice, m.
const PIT_CELL_M: f64 = 0.016;
/// Mean of 2.378 (r/cell)² for r/cell uniform in 0.20 to 0.45: the fraction of its cell that a pentagon covers.
const GRAIN_PART: f64 = 0.2636;
/// Distance of a pentagon's sides from its centre over its circumradius: cos 36°.
const PENTAGON: f32 = 0.809_017;

/// A deviation of albedo (relative) and of slope (m/m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Detail<const DIMENSIONS: usize> {
    pub(super) albedo: f32,
    pub(super) slope: [f32; DIMENSIONS],
}

impl<const DIMENSIONS: usize> Detail<DIMENSIONS> {
    const NONE: Self = Self { albedo: 0.0, slope: [0.0; DIMENSIONS] };
}

/// Grains and drifts.
#[derive(Clone, Debug)]
pub(super) struct SoilDetails {
    drifts: Octaves<2>,
    /// Threshold of the noise above which drifts form, in its standard deviations; infinite without drifts.
    drift_level: f32,
    /// Probability of a grain in a cell.
    grains: f32,
    contrast: f32,
    seed: u32,
}

/// Veins and pits.
#[derive(Clone, Debug)]
pub(super) struct RockDetails {
    veins: Octaves<3>,
    contrast: f32,
    seed: u32,
}

/// Noise of unit standard deviation over two octaves.
fn broad_noise(longest_m: f64) -> OctaveSettings {
    OctaveSettings {
        longest_m,
        shortest_m: 0.49 * longest_m,
        ratio: 2.0,
        albedo_exponent: 0.5,
        albedo_std: 1.0,
        slope_std: 0.0,
    }
}

/// Eight bits of a hash as a number in [0, 1].
#[inline(always)]
fn byte(hash: u32, index: u32) -> f32 {
    ((hash >> (8 * index)) & 0xff) as f32 / 255.0
}

/// The slope of a five-sided frustum inside the unit circle, rotated by its hash; `None` outside it.
#[inline(always)]
fn frustum_slope(d: [f32; 2], hash: u32) -> Option<[f32; 2]> {
    let (mut sin, mut cos) = (std::f32::consts::TAU / 5.0 * byte(hash, 3)).sin_cos();
    let (step_sin, step_cos) = (0.951_056_5, 0.309_017);
    let (mut outmost, mut side) = (f32::NEG_INFINITY, [0.0; 2]);
    for _ in 0..5 {
        let out = d[0] * cos + d[1] * sin;
        if out > outmost {
            (outmost, side) = (out, [cos, sin]);
        }
        (cos, sin) = (cos * step_cos - sin * step_sin, sin * step_cos + cos * step_sin);
    }
    // Down is positive: the ground rises (z falls) towards the centre.
    let top = 0.25 + 0.3 * byte(hash, 2);
    (outmost < PENTAGON).then(|| if outmost > top { side.map(|c| 0.8 * c) } else { [0.0; 2] })
}

impl SoilDetails {
    /// Details with a grain cover of `grain_cover` and a drift cover of about `drift_cover`, as fractions of the soil's
    /// area.
    pub(super) fn new(grain_cover: f64, drift_cover: f64, albedo_std: f64, seed: u64) -> Self {
        let levels = GRAIN_CELLS_M.len() as f64;
        // The sum of two octaves of value noise is nearly normal; a logistic curve approximates it well enough.
        let drift_level =
            if drift_cover > 0.0 { (1.0 / drift_cover - 1.0).ln() / 1.702 } else { f64::INFINITY };
        Self {
            drifts: Octaves::new(&broad_noise(0.8), mix(seed ^ 0xd21f)),
            drift_level: drift_level as f32,
            grains: (grain_cover / levels / GRAIN_PART).min(1.0) as f32,
            contrast: albedo_std as f32,
            seed: mix(seed ^ 0x92a1) as u32,
        }
    }

    /// Strength of the drift at each of many points, 0 to 1.
    #[inline(always)]
    pub(super) fn drifts(&self, points: &Points<2>) -> [f32; LANES] {
        if self.drift_level == f32::INFINITY {
            return [0.0; LANES];
        }
        let mut drifts = self.drifts.at_lanes(points, &[1e-6; LANES]).albedo;
        for drift in &mut drifts {
            let t = (0.5 + 1.5 * (*drift - self.drift_level)).clamp(0.0, 1.0);
            *drift = t * t * (3.0 - 2.0 * t);
        }
        drifts
    }

    /// The grains at each of many points.
    #[inline(always)]
    pub(super) fn grains(&self, p_m: &[[f64; LANES]; 2], cutoff_m: &[f32; LANES]) -> TextureLanes<2> {
        let mut sum = TextureLanes { albedo: [0.0; LANES], slope: [[0.0; LANES]; 2] };
        if self.grains <= 0.0 {
            return sum;
        }
        let finest_m = least(cutoff_m);
        for (level, cell_m) in GRAIN_CELLS_M.into_iter().enumerate() {
            if cell_m as f32 <= finest_m {
                break;
            }
            let mut weights = [0.0; LANES];
            for lane in 0..LANES {
                weights[lane] = weight(cell_m as f32, cutoff_m[lane]);
            }
            let cells = Cells::at(p_m, 1.0 / cell_m);
            let seed = self.seed ^ level as u32;
            let mut hashes = [cell_hash(cells.cell(0), seed); LANES];
            if !cells.is_one {
                for lane in 0..LANES {
                    hashes[lane] = cell_hash(cells.cell(lane), seed);
                }
            } else if byte(hashes[0], 0) >= self.grains {
                continue;
            }
            for lane in 0..LANES {
                if weights[lane] <= 0.0 || byte(hashes[lane], 0) >= self.grains {
                    continue;
                }
                if let Some((tone, slope)) = grain(hashes[lane], cells.part(lane)) {
                    sum.albedo[lane] += weights[lane] * 5.0 * self.contrast * tone;
                    sum.slope[0][lane] += weights[lane] * slope[0];
                    sum.slope[1][lane] += weights[lane] * slope[1];
                }
            }
        }
        sum
    }
}

/// The tone (−½ to ½) and slope of the grain given by a cell's hash, at a position (0 to 1) in the cell; `None` outside
/// it.
fn grain(hash: u32, [u, v]: [f32; 2]) -> Option<(f32, [f32; 2])> {
    // Of the four bytes one decides whether there is a grain, one its size, two its position.
    let radius = 0.20 + 0.25 * byte(hash, 1);
    let room = 1.0 - 2.0 * radius;
    let d = [u - radius - room * byte(hash, 2), v - radius - room * byte(hash, 3)].map(|c| c / radius);
    if d[0] * d[0] + d[1] * d[1] >= 1.0 {
        return None;
    }
    let slope = frustum_slope(d, hash.wrapping_mul(0x85eb_ca77))?;
    Some((byte(hash.wrapping_mul(0x9e37_79b1), 3) - 0.5, slope))
}

impl RockDetails {
    /// Details of rocks whose texture has this standard deviation of albedo.
    pub(super) fn new(albedo_std: f64, seed: u64) -> Self {
        Self {
            veins: Octaves::new(&broad_noise(0.12), mix(seed ^ 0x7e15)),
            contrast: albedo_std as f32,
            seed: mix(seed ^ 0x9175) as u32,
        }
    }

    /// Relative brightness of veins at each of many points of rocks, each with its strength.
    #[inline(always)]
    pub(super) fn veins(
        &self,
        points: &Points<3>,
        strength: &[f32; LANES],
        cutoff_m: &[f32; LANES],
    ) -> [f32; LANES] {
        let mut veins = self.veins.at_lanes(points, &[1e-6; LANES]).albedo;
        for lane in 0..LANES {
            // Half width 0.05 of the noise's standard deviation: 2 to 5 mm.
            let t = veins[lane] / 0.06;
            let brightness = strength[lane] * 2.5 * self.contrast * weight(0.012, cutoff_m[lane]);
            veins[lane] = brightness * (-t * t).exp();
        }
        veins
    }

    /// The pits at a point of a rock; the slope is that of the height over its face.
    #[inline(always)]
    pub(super) fn pits(&self, p_m: [f64; 3], strength: f32, cutoff_m: f32) -> Detail<3> {
        let weight = weight(PIT_CELL_M as f32, cutoff_m);
        if weight <= 0.0 {
            return Detail::NONE;
        }
        let (cell, [u, v, w]) = cell_of(p_m.map(|c| c / PIT_CELL_M));
        let hash = cell_hash(cell, self.seed);
        if byte(hash, 0) >= 0.6 * strength {
            return Detail::NONE;
        }
        let radius = 0.15 + 0.30 * byte(hash, 1);
        let room = 1.0 - 2.0 * radius;
        let third = byte(hash.wrapping_mul(0x85eb_ca77), 3);
        let d =
            [u - radius - room * byte(hash, 2), v - radius - room * byte(hash, 3), w - radius - room * third];
        let square = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) / (radius * radius);
        if square >= 1.0 {
            return Detail::NONE;
        }
        // Hollow: the height over the face grows outwards from the centre.
        Detail {
            albedo: -weight * 1.5 * self.contrast * (1.0 - square),
            slope: d.map(|c| weight * 0.9 * c / radius),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grains_and_drifts_cover_what_they_should_and_grains_fade_out() {
        let details = SoilDetails::new(0.12, 0.3, 0.1, 7);
        let (mut grains, mut drifts, mut count) = (0.0, 0.0, 0.0);
        for k in 0..200_000 / LANES {
            let p_m = [
                std::array::from_fn(|lane| (LANES * k + lane) as f64 * 0.003_71),
                std::array::from_fn(|lane| ((LANES * k + lane) % 997) as f64 * 0.0131),
            ];
            let points = Points::new(&p_m);
            let (near, far) = (details.grains(&p_m, &[1e-4; LANES]), details.grains(&p_m, &[0.03; LANES]));
            grains += near.albedo.iter().filter(|albedo| **albedo != 0.0).count() as f64;
            drifts += details.drifts(&points).iter().copied().map(f64::from).sum::<f64>();
            count += LANES as f64;
            assert_eq!((far.albedo, far.slope), ([0.0; LANES], [[0.0; LANES]; 2]));
        }
        // Few grains of the three lattices overlap: (1 − 0.04)³ stays bare.
        assert!((grains / count / 0.115 - 1.0f64).abs() < 0.05, "{}", grains / count);
        assert!((drifts / count / 0.3 - 1.0f64).abs() < 0.2, "{}", drifts / count);
    }

    #[test]
    fn the_sides_of_a_grain_fall_outwards_from_its_flat_top() {
        for hash in (0..50u32).map(|k| mix(u64::from(k)) as u32) {
            let (mut flat, mut falling, mut beside) = (0, 0, 0);
            for k in 0..2000 {
                let (r, angle) = ((k as f32 / 2000.0).sqrt(), 2.399_963 * k as f32);
                let d = [r * angle.cos(), r * angle.sin()];
                match frustum_slope(d, hash) {
                    None => beside += 1,
                    Some([0.0, 0.0]) => flat += 1,
                    // z grows outwards, where it points down.
                    Some(slope) => {
                        falling += 1;
                        assert!(slope[0] * d[0] + slope[1] * d[1] > 0.0);
                        assert!((slope[0].hypot(slope[1]) - 0.8).abs() < 1e-5);
                    }
                }
            }
            // A pentagon fills 2.378/π of its circumscribed circle.
            assert!((f64::from(beside) / 2000.0 - 0.243).abs() < 0.01, "{beside}");
            assert!(flat > 100 && falling > 500, "{flat} {falling}");
        }
    }

    #[test]
    fn veins_are_thin_and_pits_are_hollow_and_dark() {
        let details = RockDetails::new(0.1, 3);
        let (mut veined, mut pitted) = (0, 0);
        for k in 0..50_000 {
            let p = [f64::from(k) * 0.0171, f64::from(k % 991) * 0.013, f64::from(k % 97) * 0.02];
            let veins =
                details.veins(&Points::new(&p.map(|axis| [axis; LANES])), &[1.0; LANES], &[1e-4; LANES]);
            veined += u32::from(veins[0] > 0.1);
            let pit = details.pits(p, 1.0, 1e-4);
            pitted += u32::from(pit.albedo < 0.0);
            assert!(pit.albedo <= 0.0);
        }
        assert!((1000..5000).contains(&veined), "{veined}");
        assert!((2000..12_000).contains(&pitted), "{pitted}");
    }
}
