//! `sightline study odometry`: visual odometry in simulated drives without a target.

use std::sync::{Mutex, PoisonError};

use clap::{Args, ValueEnum};
use serde::Serialize;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_rover::visual_odometry::OdometryPreset;
use sightline_study::odometry::{OdometryDrives, OdometryRow, OdometrySummary, Scene, summary};

use super::terminal::{self, Progress};

/// The drives and the settings.
#[derive(Debug, Args)]
pub(super) struct OdometryStudy {
    /// Number of worlds for each ground.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    worlds: u64,
    /// The seed of the first world; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Steps of a drive: 25 to 75 cm, turns of up to 18°.
    #[arg(long, default_value_t = 25, value_parser = clap::value_parser!(u32).range(1..=500))]
    steps: u32,
    /// The ground.
    #[arg(long, value_delimiter = ',', default_value = "textured,slope,own-tracks,picket-fence,featureless")]
    scenes: Vec<SceneName>,
    /// The settings.
    #[arg(long, value_delimiter = ',', default_value = "sightline")]
    configurations: Vec<Configuration>,
    /// Side of the images, px.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=2048))]
    size: u32,
    /// Samples along each side of a pixel.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=8))]
    samples_per_axis: u32,
    /// Output format.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// The ground by name.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum SceneName {
    /// Soil with rocks and texture; every step has a random slip of 0 to 125 %.
    Textured,
    /// The same with the slip of soil and slope.
    Slope,
    /// Smooth ground on which the rover sees its own tracks behind it.
    OwnTracks,
    /// The same, driving straight and without any texture of the ground.
    PicketFence,
    /// Ground without texture.
    Featureless,
}

impl From<SceneName> for Scene {
    fn from(name: SceneName) -> Self {
        match name {
            SceneName::Textured => Self::Textured,
            SceneName::Slope => Self::Slope,
            SceneName::OwnTracks => Self::OwnTracks,
            SceneName::PicketFence => Self::PicketFence,
            SceneName::Featureless => Self::Featureless,
        }
    }
}

/// The settings by name.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(super) enum Configuration {
    /// The default settings of Sightline.
    Sightline,
    /// As flown on the Mars Exploration Rovers: 256 × 256 px, pseudo-normalised correlation.
    Mer2007,
}

impl Configuration {
    pub(super) const fn preset(self) -> (&'static str, OdometryPreset) {
        match self {
            Self::Sightline => ("sightline", OdometryPreset::Sightline),
            Self::Mer2007 => ("mer2007", OdometryPreset::Mer2007),
        }
    }
}

/// Output format.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// One sentence for each ground and configuration.
    Text,
    /// One JSON object with all rows and the summaries.
    Json,
}

/// The study as JSON.
#[derive(Serialize)]
struct Document {
    rows: Vec<OdometryRow>,
    summaries: Vec<OdometrySummary>,
}

impl OdometryStudy {
    /// Runs the drives and writes the rows.
    ///
    /// # Errors
    /// A world that cannot be created, or no space for images.
    pub(super) fn run(&self) -> Result<()> {
        let folder = std::env::temp_dir().join(format!("sightline-odometry-{}", std::process::id()));
        let seeds: Vec<u64> = (self.first_seed..self.first_seed + self.worlds).collect();
        let all = seeds.len() * self.scenes.len() * self.configurations.len();
        let progress = Mutex::new((0, Progress::new("drive")));
        let tell = || {
            let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
            progress.0 += 1;
            let done = progress.0;
            progress.1.tell(done, all);
        };
        let mut document = Document { rows: Vec::new(), summaries: Vec::new() };
        for (configuration, preset) in self.configurations.iter().map(|name| name.preset()) {
            let settings = preset.settings();
            settings.validate()?;
            for scene in self.scenes.iter().copied().map(Scene::from) {
                let drives = OdometryDrives {
                    configuration,
                    settings: &settings,
                    scene,
                    steps: self.steps as usize,
                    size: self.size,
                    samples_per_axis: self.samples_per_axis,
                };
                let rows = drives.run(&seeds, &folder, Cancel::default(), &tell);
                // The images are not needed any more.
                let _ = std::fs::remove_dir_all(&folder);
                let rows = rows?;
                document.summaries.extend(summary(&rows));
                document.rows.extend(rows);
            }
        }
        match self.format {
            Format::Json => {
                let text = serde_json::to_string(&document);
                terminal::line(&text.map_err(|error| Error::Request(error.to_string()))?)
            }
            Format::Text => document.summaries.iter().try_for_each(|found| terminal::line(&sentence(found))),
        }
    }
}

/// A summary as one line of text.
fn sentence(found: &OdometrySummary) -> String {
    let wrong = found.silently_wrong_below_percent.map_or_else(
        || format!("{} silently wrong", found.silently_wrong),
        |bound| format!("0 silently wrong (below {:.2} % with 95 %)", bound.min(100.0)),
    );
    let nees = found.nees_per_dof.map_or_else(String::new, |[mean, spread]| {
        format!(", NEES per degree of freedom {mean:.2} ± {spread:.2} over drives")
    });
    let slip = found
        .slip_error_points
        .map_or_else(String::new, |points| format!(", error of the slip {points:.2} points (95 %)"));
    let drives = if found.drives == 1 { "drive" } else { "drives" };
    format!(
        "{} {}: {:.2} % of {} updates in {} {drives} converged, {wrong}, drift {:.2} % (median) and {:.2} % (95 %){slip}{nees}",
        found.configuration,
        found.scene.name(),
        found.converged_percent,
        found.updates,
        found.drives,
        found.drift_percent[0],
        found.drift_percent[1],
    )
}
