//! The browser for the tests: finds it, or installs it on Debian.

use std::path::PathBuf;

use anyhow::{Result, bail};

use crate::{apt, cmd};

/// The two programs with which the tests drive a browser.
pub(crate) struct Browser {
    /// Chromium, or a Chrome.
    pub(crate) chromium: PathBuf,
    /// The driver of the same version.
    pub(crate) chromedriver: PathBuf,
}

/// Finds the browser and its driver; on Debian, installs them if missing.
pub(crate) fn ensure() -> Result<Browser> {
    if let Some(browser) = find()? {
        return Ok(browser);
    }
    if apt::install("The tests need Chromium and its driver", &["chromium", "chromium-driver"])?
        && let Some(browser) = find()?
    {
        return Ok(browser);
    }
    bail!(
        "the browser tests need Chromium and chromedriver: install Debian's packages chromium and chromium-driver, or \
         set SIGHTLINE_CHROMIUM and SIGHTLINE_CHROMEDRIVER to programs of the same version"
    )
}

/// The browser in the environment variables or in `PATH`.
fn find() -> Result<Option<Browser>> {
    let chromium = one(
        "SIGHTLINE_CHROMIUM",
        &["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"],
    )?;
    let chromedriver = one("SIGHTLINE_CHROMEDRIVER", &["chromedriver"])?;
    Ok(chromium.zip(chromedriver).map(|(chromium, chromedriver)| Browser { chromium, chromedriver }))
}

/// One program, from an environment variable or else from `PATH`.
fn one(variable: &str, names: &[&str]) -> Result<Option<PathBuf>> {
    let Some(named) = std::env::var_os(variable) else { return Ok(cmd::find_in_path(names)) };
    let named = PathBuf::from(named);
    if !named.is_file() {
        bail!("{variable} names {}, which is no file: correct it or unset it", named.display());
    }
    Ok(Some(named))
}
