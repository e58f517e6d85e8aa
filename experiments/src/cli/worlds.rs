//! The options that experiments in many worlds share: which worlds, which images, which tracker.

use clap::Args;
use sightline_geometry::error::Result;
use sightline_track::presets::preset;
use sightline_track::settings::{Changes, Settings, parse_assignment};
use sightline_world::Scenario;

/// Worlds, images and tracker.
#[derive(Debug, Args)]
pub(super) struct Worlds {
    /// The seed of the first world.
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Side of the images, px.
    #[arg(long, default_value_t = 512)]
    size: u32,
    /// Samples along each side of a pixel.
    #[arg(long, default_value_t = 2)]
    samples_per_axis: u32,
    /// A named configuration of the tracker, as `sightline presets` lists them.
    #[arg(long, value_name = "NAME", default_value = "sightline")]
    preset: String,
    /// A setting of the tracker; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl Worlds {
    /// The configuration of the tracker.
    ///
    /// # Errors
    /// An unknown preset or a bad setting.
    pub(super) fn settings(&self) -> Result<Settings> {
        let changes = self.set.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        preset(&self.preset)?.settings()?.with(&changes)
    }

    /// Gives a scenario these images.
    pub(super) fn size(&self, scenario: &mut Scenario) {
        (scenario.camera.image_size, scenario.camera.samples_per_axis) = (self.size, self.samples_per_axis);
        // The rule's window is that of 1024 × 1024 images.
        scenario.targets.window_px = (scenario.targets.window_px * self.size / 1024) | 1;
    }
}
