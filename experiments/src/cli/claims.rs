//! `sightline-experiments claims`: tracked targets and their NEES in worlds with pointing error.

use clap::Args;
use serde::Serialize;
use sightline_geometry::error::{Error, Result};
use sightline_server::cli::terminal::{self, Progress};
use sightline_study::randomised;
use sightline_track::presets::preset;
use sightline_track::settings::{Changes, Settings, parse_assignment};

use crate::claims::{Claims, claims, world_claim};

/// The worlds and the tracker.
#[derive(Debug, Args)]
pub(super) struct Worlds {
    /// How many worlds.
    #[arg(long, default_value_t = 10)]
    worlds: u64,
    /// The seed of the first world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Side of the images, px.
    #[arg(long, default_value_t = 512)]
    size: u32,
    /// Samples along each side of a pixel.
    #[arg(long, default_value_t = 2)]
    samples_per_axis: u32,
    /// 1σ error of each mast angle, deg; without it, that of the study.
    #[arg(long, value_name = "DEG")]
    pointing_error_deg: Option<f64>,
    /// A named configuration of the tracker, as `sightline presets` lists them.
    #[arg(long, value_name = "NAME", default_value = "sightline")]
    preset: String,
    /// A setting of the tracker; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// The last line.
#[derive(Serialize)]
struct Summary {
    summary: Claims,
}

impl Worlds {
    /// Tracks the targets of every world; writes one JSON object a world, then one of all.
    ///
    /// # Errors
    /// A bad setting, a drive that is impossible in its world, or no room for images.
    pub(super) fn run(&self) -> Result<()> {
        let changes = self.set.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        let settings: Settings = preset(&self.preset)?.settings()?.with(&changes)?;
        let mut base = randomised::base("claim")?;
        (base.camera.image_size, base.camera.samples_per_axis) = (self.size, self.samples_per_axis);
        // The rule's window is that of 1024 × 1024 images.
        base.targets.window_px = (base.targets.window_px * self.size / 1024) | 1;
        let folder = std::env::temp_dir().join(format!("sightline-claims-{}", std::process::id()));
        let mut progress = Progress::new("claims: world");
        let mut found = Vec::new();
        for number in 0..self.worlds {
            progress.tell(number as usize, self.worlds as usize);
            let mut scenario = randomised::world("claim", &base, self.seed + number);
            if let Some(error_deg) = self.pointing_error_deg {
                scenario.drive.pointing_error_deg = error_deg;
            }
            scenario.validate()?;
            let world = world_claim(&scenario, &settings, &folder.join(format!("{number}")))?;
            line(&world)?;
            found.push(world);
            // The images are not needed any more.
            let _ = std::fs::remove_dir_all(&folder);
        }
        line(&Summary { summary: claims(&found) })
    }
}

fn line(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string(value).map_err(|error| Error::Request(error.to_string()))?;
    terminal::line(&text)
}
