//! Visual odometry in simulated drives: rates of convergence and of silent errors, and drift.
//!
//! A drive has no target. At every stop the mast points at the ground ahead, one pair is captured, and the motion since
//! the previous stop is measured and compared with the true one:
//!
//! ```text
//! error of an update   δ:  T_true = exp(δ) T        NEES per dof = δᵀ Σ⁻¹ δ / 6
//! silently wrong       accepted, while √(τᵀ Σ_τ⁻¹ τ) > 5 and |τ| > max(1 cm, 4 % of the step),
//!                      or the rotation error > 0.2° and > 5 σ
//! drift                distance of the last estimated position from the true one, % of the true path length
//! ```
//! Rejected steps use wheels and gyro. Frames: rover frame after, site. Source: design.md, domain.md 9.

mod drive;
mod row;

pub use row::{OdometryRow, OdometryStep, OdometrySummary, summary};

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_rover::visual_odometry::OdometrySettings;
use sightline_world::scenario::{ForcedSlip, OdometryModel};
use sightline_world::{Scenario, library};

use self::drive::OdometryDrive;

/// Metres driven before the first update if the mast points back at the tracks.
const TRACKS_BEFORE: usize = 4;

/// The ground of the drives of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scene {
    /// Soil with rocks and texture; the slip of every step is drawn from 0 to 125 %.
    Textured,
    /// As `Textured`, with the slip of soil and slope: the drives by which drift is measured.
    Slope,
    /// Smooth ground on which the rover views its own tracks behind it.
    OwnTracks,
    /// As `OwnTracks`, but straight and without ground texture: periodic tracks.
    PicketFence,
    /// Ground without texture.
    Featureless,
}

impl Scene {
    /// All scenes.
    pub const ALL: [Self; 5] =
        [Self::Textured, Self::Slope, Self::OwnTracks, Self::PicketFence, Self::Featureless];

    /// Name in rows and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Textured => "textured",
            Self::Slope => "slope",
            Self::OwnTracks => "own-tracks",
            Self::PicketFence => "picket-fence",
            Self::Featureless => "featureless",
        }
    }

    /// Returns whether the mast points backwards.
    fn looks_back(self) -> bool {
        matches!(self, Self::OwnTracks | Self::PicketFence)
    }
}

/// The drives of a study.
#[derive(Clone, Copy, Debug)]
pub struct OdometryDrives<'a> {
    /// Name of the settings.
    pub configuration: &'a str,
    /// The settings.
    pub settings: &'a OdometrySettings,
    /// The ground.
    pub scene: Scene,
    /// Number of steps of a drive.
    pub steps: usize,
    /// Side of the images, px.
    pub size: u32,
    /// Samples along each side of a pixel.
    pub samples_per_axis: u32,
}

/// A commanded step.
#[derive(Clone, Copy, Debug)]
struct Commanded {
    length_m: f64,
    turn_rad: f64,
}

impl Commanded {
    /// Commands that lead away from the rock that stalled this step, last command first: back along the path, and a turn
    /// of 36°, to the left if `side` is odd.
    fn escape(self, side: u64) -> Vec<Self> {
        let side = if side.is_multiple_of(2) { 1.0 } else { -1.0 };
        let turn = Self { length_m: 0.0, turn_rad: side * 18f64.to_radians() };
        let back_m = if self.length_m < 0.0 { 0.5 } else { -0.5 };
        vec![turn, turn, Self { length_m: back_m, turn_rad: 0.0 }]
    }
}

impl OdometryDrives<'_> {
    /// Scenario of a world; the seed also draws slope, sun and slips.
    ///
    /// # Errors
    /// An error of the library's scenario, or a scenario for which no world can be generated.
    pub fn scenario(&self, seed: u64) -> Result<Scenario> {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x0d0e_7291);
        let mut scenario = Scenario { seed, ..library::scenario("approach-10")? };
        scenario.terrain.slope_deg = random.random_range(0.0..31.0);
        scenario.terrain.slope_azimuth_deg = random.random_range(-180.0..180.0);
        scenario.sun.azimuth_deg = random.random_range(0.0..360.0);
        // Above the steepest slope, so that the ground is lit.
        scenario.sun.elevation_deg = random.random_range(35.0..70.0);
        (scenario.camera.image_size, scenario.camera.samples_per_axis) = (self.size, self.samples_per_axis);
        scenario.rover.odometry = OdometryModel::WheelsAndImu;
        match self.scene {
            Scene::Slope => (scenario.rover.slip_scale, scenario.rover.slip_spread) = (1.0, 0.2),
            _ => {
                let slips = (1..=(self.steps + TRACKS_BEFORE) as u32)
                    .map(|stop| ForcedSlip { stop, slip: random.random_range(0.0..1.25) });
                scenario.rover.forced_slip = slips.collect();
            }
        }
        if self.scene.looks_back() {
            scenario.rover.tracks = true;
            scenario.rover.forced_slip.iter_mut().for_each(|forced| forced.slip *= 0.4);
        }
        if self.scene != Scene::Textured && self.scene != Scene::Slope {
            smooth(&mut scenario, self.scene);
        }
        scenario.validate()?;
        Ok(scenario)
    }

    /// Commanded steps of a drive.
    fn commanded(&self, seed: u64) -> Vec<Commanded> {
        let mut random = Pcg64::seed_from_u64(seed ^ 0x57e9_57e9);
        let mut heading_rad = 0.0f64;
        let step = |_| {
            let length_m = random.random_range(0.25..0.75);
            let turn_deg: f64 = random.random_range(-18.0..18.0);
            // Limits the deviation from the first heading.
            let turn_rad = match self.scene {
                Scene::PicketFence => 0.0,
                _ if heading_rad.abs() > 0.7 => -heading_rad.signum() * turn_deg.abs().to_radians(),
                _ => turn_deg.to_radians(),
            };
            heading_rad += turn_rad;
            Commanded { length_m, turn_rad }
        };
        (0..self.steps).map(step).collect()
    }

    /// Runs the drives of some worlds in parallel; rows are in the order of the seeds. `tell` is called after each.
    ///
    /// # Errors
    /// A world that cannot be generated, or [`Error::Cancelled`].
    pub fn run(
        &self,
        seeds: &[u64],
        folder: &Path,
        cancel: Cancel<'_>,
        tell: &(dyn Fn() + Sync),
    ) -> Result<Vec<OdometryRow>> {
        let one = |&seed: &u64| {
            let row = self.drive(seed, &folder.join(format!("{}-{seed}", self.scene.name())), cancel);
            tell();
            row
        };
        seeds.par_iter().map(one).collect()
    }

    /// Runs one drive in a folder that is removed afterwards; it ends early if the rover cannot continue.
    ///
    /// # Errors
    /// A world that cannot be generated, or [`Error::Cancelled`].
    pub fn drive(&self, seed: u64, folder: &Path, cancel: Cancel<'_>) -> Result<OdometryRow> {
        let scenario = self.scenario(seed)?;
        let outcome = self.driven(&scenario, seed, folder, cancel);
        // A folder that cannot be removed does no harm.
        let _ = std::fs::remove_dir_all(folder);
        outcome
    }

    fn driven(
        &self,
        scenario: &Scenario,
        seed: u64,
        folder: &Path,
        cancel: Cancel<'_>,
    ) -> Result<OdometryRow> {
        let mut drive = OdometryDrive::begin(scenario, self, folder, cancel)?;
        if self.scene.looks_back() {
            drive.lay_tracks(cancel)?;
        }
        let (mut problem, mut escape, mut stalls) = (None, Vec::new(), 0);
        for planned in self.commanded(seed) {
            let commanded = escape.pop().unwrap_or(planned);
            match drive.step(commanded, cancel) {
                Ok(true) => {
                    stalls += 1;
                    escape = commanded.escape(seed + stalls / 2);
                }
                Ok(false) => {}
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                Err(error) => {
                    problem = Some(error.to_string());
                    break;
                }
            }
        }
        Ok(drive.row(scenario, seed, problem))
    }
}

/// Reduces the texture of the ground.
fn smooth(scenario: &mut Scenario, scene: Scene) {
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.0, 0);
    scenario.terrain.rms_at_1m_m = 0.005;
    scenario.texture.grain_cover = 0.0;
    scenario.texture.drift_cover = 0.0;
    let part = if scene == Scene::OwnTracks { 0.2 } else { 0.02 };
    scenario.texture.albedo_std *= part;
    scenario.texture.soil_slope_std *= part;
}
