//! `sightline-experiments scenery`: the simulated world in numbers, against the laws it follows and against real frames.
//!
//! Rocks against their size–frequency law, ground against its fractal, the noise's mean–variance line against the
//! gain, squares of soil and of rock (simulated, and of recorded frames) by contrast, histogram and spectrum, and
//! the level of targets under a changing share of sky, the whole frame or a subframe being metered. Tables go to the
//! standard output, all numbers to `scenery.json`, figures beside it.

use std::path::PathBuf;

use crate::exposure::exposure_report;
use crate::scenery::{Rectangle, RockReport, ground_report, rock_report};
use clap::Args;
use sightline_geometry::error::{Error, Result};
use sightline_vision::image::GrayImage;

use sightline_world::scenario::RockSettings;
use sightline_world::{Eye, NoiseSeed, Region, Scenario, World, library};

use super::scenery_figure;
use super::scenery_pictures::{Square, simulated_rocks, simulated_soil};
use super::scenery_report::{NoiseRow, Report};
use sightline_server::cli::terminal;

/// Abundances of rocks that are compared with their law.
const ABUNDANCES: [f64; 3] = [0.05, 0.10, 0.30];
/// Least diameters of the table of rocks, m.
const DIAMETERS_M: [f64; 7] = [0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5];
/// Distances of the table of the ground, m.
const DISTANCES_M: [f64; 7] = [0.04, 0.08, 0.16, 0.32, 0.64, 1.0, 2.0];
/// Beside the drive, clear of tracks and cluster, where no rock was moved out of the way.
const BESIDE: [Rectangle; 2] =
    [Rectangle { x_m: [2.5, 8.0], y_m: [1.3, 2.6] }, Rectangle { x_m: [2.5, 8.0], y_m: [-2.6, -1.3] }];
/// The bare ground that is measured.
const GROUND: Rectangle = Rectangle { x_m: [0.0, 12.0], y_m: [-5.0, 5.0] };
/// The scenario whose sky leaves the frame on the way.
const SKY: &str = "sky-full-frame";

/// Measure the simulated scenery.
#[derive(Debug, Args)]
pub(super) struct Scenery {
    /// How many worlds of each abundance.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=100))]
    worlds: u64,
    /// A square of soil in a recorded frame to compare with: a PDS3 picture or a traverse, the square's upper left
    /// corner and, if it is not 256, its side, px; can be given more than once.
    #[arg(long, value_name = "FILE@X,Y")]
    soil: Vec<Square>,
    /// The same for a face of a rock.
    #[arg(long, value_name = "FILE@X,Y,SIDE")]
    rock: Vec<Square>,
    /// The folder for numbers and figures.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

impl Scenery {
    /// Measures, prints and draws.
    ///
    /// # Errors
    /// A traverse that cannot be read, or a folder that cannot be written.
    pub(super) fn run(self) -> Result<()> {
        let scenario = Scenario::demo();
        let rocks = ABUNDANCES.map(|area_fraction| self.rocks(&scenario, area_fraction));
        let worlds = self.worlds_of(&scenario);
        let noise = noise(&scenario);
        let mut pictures = vec![("simulated".to_owned(), simulated_soil(&scenario, &worlds[0])?)];
        pictures.extend(self.soil.iter().map(Square::report).collect::<Result<Vec<_>>>()?);
        let mut rock_faces = simulated_rocks(&scenario, &worlds[0])?;
        rock_faces.extend(self.rock.iter().map(Square::report).collect::<Result<Vec<_>>>()?);
        let sky = library::scenario(SKY)?;
        let exposure = exposure_report(&sky, &World::new(&sky))?;
        let report = Report {
            rocks: ABUNDANCES.into_iter().zip(rocks).collect(),
            ground: ground_report(
                &worlds.iter().collect::<Vec<_>>(),
                &scenario.terrain,
                &GROUND,
                &DISTANCES_M,
            ),
            gain: [scenario.camera.gain_electrons_per_dn, 1.0 / slope(&noise)],
            noise,
            pictures,
            rock_faces,
            exposure,
        };
        std::fs::create_dir_all(&self.out)
            .map_err(|source| Error::Write { path: self.out.clone(), source })?;
        let path = self.out.join("scenery.json");
        let document = serde_json::to_vec_pretty(&report).map_err(|e| Error::Request(e.to_string()))?;
        std::fs::write(&path, document).map_err(|source| Error::Write { path, source })?;
        scenery_figure::draw(&self.out, &report)?;
        print(&report)
    }

    fn worlds_of(&self, scenario: &Scenario) -> Vec<World> {
        (1..=self.worlds).map(|seed| World::new(&Scenario { seed, ..scenario.clone() })).collect()
    }

    fn rocks(&self, scenario: &Scenario, area_fraction: f64) -> RockReport {
        let rocks = RockSettings { area_fraction, ..scenario.rocks.clone() };
        let worlds = self.worlds_of(&Scenario { rocks: rocks.clone(), ..scenario.clone() });
        rock_report(&worlds.iter().collect::<Vec<_>>(), &rocks, &BESIDE, &DIAMETERS_M)
    }
}

/// Mean and variance of evenly lit pictures, level by level, from the difference of two exposures.
fn noise(scenario: &Scenario) -> Vec<NoiseRow> {
    const SIDE: u32 = 256;
    let mut scenario = scenario.clone();
    (scenario.camera.response_spread, scenario.camera.flat_field_residue) = (0.0, 0.0);
    let camera = sightline_world::Rig::new(&scenario.camera).cameras_in_rover(None).0;
    let region = Region { x: 0, y: 0, width: SIDE, height: SIDE };
    let full_scale_dn = scenario.camera.recorded_full_scale_dn();
    let level = |part: f64| {
        let radiance = GrayImage::from_pixel(region.width, region.height, image::Luma([1.0]));
        let electrons = part * full_scale_dn * scenario.camera.gain_electrons_per_dn;
        let time_s = electrons / scenario.camera.electrons_per_s;
        let expose = |step: u32| {
            sightline_world::develop(
                &radiance,
                &scenario,
                &camera,
                time_s,
                NoiseSeed { step, eye: Eye::Left },
            )
        };
        let (one, two) = (expose(0), expose(1));
        let pairs = || one.iter().zip(two.iter()).map(|(a, b)| (f64::from(*a), f64::from(*b)));
        let count = f64::from(SIDE * SIDE);
        let mean = pairs().map(|(a, b)| 0.5 * (a + b)).sum::<f64>() / count;
        let variance = pairs().map(|(a, b)| 0.5 * (a - b).powi(2)).sum::<f64>() / count;
        NoiseRow {
            mean_dn: mean * full_scale_dn - scenario.camera.bias_dn,
            variance_dn2: variance * full_scale_dn * full_scale_dn,
        }
    };
    [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9].map(level).to_vec()
}

/// Slope of the least-squares line of variance over mean, DN: 1/gain for shot noise.
fn slope(rows: &[NoiseRow]) -> f64 {
    let count = rows.len() as f64;
    let mean = |of: fn(&NoiseRow) -> f64| rows.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|row| row.mean_dn), mean(|row| row.variance_dn2));
    let products = rows.iter().map(|row| (row.mean_dn - x) * (row.variance_dn2 - y)).sum::<f64>();
    products / rows.iter().map(|row| (row.mean_dn - x).powi(2)).sum::<f64>()
}

fn print(report: &Report) -> Result<()> {
    for (abundance, rocks) in &report.rocks {
        terminal::line(&format!(
            "rocks, k = {abundance}: {:.0} a world; cover {:.4} of {:.4} expected",
            rocks.rocks_per_world, rocks.covered, rocks.covered_expected
        ))?;
        for row in &rocks.rows {
            terminal::line(&format!(
                "  D ≥ {:.2} m: {} counted, {:.1} ± {:.1} expected",
                row.diameter_m, row.counted, row.expected, row.sigma
            ))?;
        }
    }
    for row in &report.ground.rows {
        terminal::line(&format!(
            "ground over {:.2} m: {:.4} m rms, {:.4} expected; slope {:.1}° rms",
            row.distance_m, row.rms_difference_m, row.expected_m, row.slope_deg
        ))?;
    }
    terminal::line(&format!("gain {:.1} e⁻/DN stated, {:.1} measured", report.gain[0], report.gain[1]))?;
    let soil = report.pictures.iter().map(|named| ("soil", named));
    let rock = report.rock_faces.iter().map(|named| ("rock", named));
    for (what, (name, picture)) in soil.chain(rock) {
        let contrast = picture.local_contrast.map_or(f64::NAN, |c| c.p50);
        // A square smaller than 64 px has no spectrum.
        let slope = picture.spectrum_slope.map_or_else(|| "–".to_owned(), |slope| format!("{slope:.2}"));
        let levels = picture.levels;
        terminal::line(&format!(
            "{what}, {name}: contrast {:.3}, local {contrast:.3}, spectrum slope {slope}, levels over the mean 1 % {:.2}, 99 % {:.2}",
            picture.contrast, levels.p1, levels.p99
        ))?;
    }
    for row in &report.exposure {
        terminal::line(&format!(
            "stop {}: {:.1} % sky, {} targets at {:.0} DN by the whole frame, {:.0} DN by the subframe",
            row.stop,
            100.0 * row.sky_share,
            row.targets,
            row.full_frame_dn,
            row.subframe_dn
        ))?;
    }
    Ok(())
}
