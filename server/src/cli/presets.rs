//! `sightline presets`: the named configurations of the tracker and the settings that each changes.

use clap::{Args, ValueEnum};
use sightline_geometry::error::{Error, Result};
use sightline_track::presets::{PRESETS, Preset, preset};

use super::terminal;

/// List the named configurations of the tracker, or print one.
#[derive(Debug, Args)]
pub(super) struct Presets {
    /// The configuration to print as TOML; without it, all are listed.
    name: Option<String>,
    /// Output format.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// Output format of presets.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// One line each: the name and the description.
    Text,
    /// One TOML table each, with the changed settings.
    Toml,
}

impl Presets {
    /// Lists the presets, or prints one.
    ///
    /// # Errors
    /// A name that does not exist.
    pub(super) fn run(self) -> Result<()> {
        if let Some(name) = &self.name {
            return terminal::line(table(preset(name)?)?.trim_end());
        }
        let width = PRESETS.iter().map(|preset| preset.name.len()).max().unwrap_or_default();
        for preset in PRESETS {
            match self.format {
                Format::Text => terminal::line(&format!("{:width$}  {}", preset.name, preset.description))?,
                Format::Toml => terminal::line(&table(preset)?)?,
            }
        }
        Ok(())
    }
}

/// A preset as a TOML table: its description and the changed settings.
fn table(preset: &Preset) -> Result<String> {
    let changes = preset.settings()?.changes();
    let text = toml::to_string(&changes).map_err(|error| Error::Request(error.to_string()))?;
    Ok(format!("# {}\n[{}]\n{text}", preset.description, preset.name))
}
