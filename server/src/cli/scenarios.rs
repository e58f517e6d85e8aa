//! `sightline scenarios`: the scenarios of the built-in library.

use clap::Args;
use sightline_geometry::error::Result;
use sightline_world::library;

use super::terminal;

/// List the scenarios that come with the program, or print one.
#[derive(Debug, Args)]
pub(super) struct Scenarios {
    /// The scenario to print as TOML, as a template for your own.
    name: Option<String>,
}

impl Scenarios {
    /// Lists the library, or prints one scenario.
    ///
    /// # Errors
    /// A name that is not in the library.
    pub(super) fn run(self) -> Result<()> {
        if let Some(name) = self.name {
            library::scenario(&name)?;
            return terminal::line(library::toml(&name).unwrap_or_default().trim_end());
        }
        for name in library::names() {
            let scenario = library::scenario(name)?;
            terminal::line(&format!("{name:22} {}", scenario.description))?;
        }
        Ok(())
    }
}
