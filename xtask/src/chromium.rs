//! The browser of the tests: found, or installed where Debian's packages can be.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use crate::cmd;

/// The two programs with which the tests drive a browser.
pub(crate) struct Browser {
    /// Chromium, or a Chrome.
    pub(crate) chromium: PathBuf,
    /// The driver of the same version.
    pub(crate) chromedriver: PathBuf,
}

/// Finds the browser and its driver; on Debian, installs them when they are missing.
pub(crate) fn ensure() -> Result<Browser> {
    if let Some(browser) = find()? {
        return Ok(browser);
    }
    if let Some(apt_get) = apt_get() {
        cmd::say("The tests need Chromium and its driver: installing Debian's packages.");
        let mend = "install the packages chromium and chromium-driver by hand";
        cmd::run(apt_get().args(["update"]), mend)?;
        cmd::run(
            apt_get().args(["install", "-y", "--no-install-recommends", "chromium", "chromium-driver"]),
            mend,
        )?;
        if let Some(browser) = find()? {
            return Ok(browser);
        }
    }
    bail!(
        "the browser tests need Chromium and chromedriver: install Debian's packages chromium and chromium-driver, or \
         set SIGHTLINE_CHROMIUM and SIGHTLINE_CHROMEDRIVER to programs of the same version"
    )
}

/// The browser that the environment or `PATH` names.
fn find() -> Result<Option<Browser>> {
    let chromium = one(
        "SIGHTLINE_CHROMIUM",
        &["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"],
    )?;
    let chromedriver = one("SIGHTLINE_CHROMEDRIVER", &["chromedriver"])?;
    Ok(chromium.zip(chromedriver).map(|(chromium, chromedriver)| Browser { chromium, chromedriver }))
}

/// One program, from a variable or else from `PATH`.
fn one(variable: &str, names: &[&str]) -> Result<Option<PathBuf>> {
    let Some(named) = std::env::var_os(variable) else { return Ok(cmd::find_in_path(names)) };
    let named = PathBuf::from(named);
    if !named.is_file() {
        bail!("{variable} names {}, which is no file: correct it or unset it", named.display());
    }
    Ok(Some(named))
}

/// How to run `apt-get` with the right to install, where that is possible without asking.
fn apt_get() -> Option<impl Fn() -> std::process::Command> {
    if !Path::new("/etc/debian_version").exists() {
        return None;
    }
    let minute = std::time::Duration::from_secs(60);
    let user = cmd::output(cmd::program("id").arg("-u"), "").ok()?;
    let is_root = user.trim() == "0";
    if !is_root && !cmd::succeeds(cmd::program("sudo").args(["-n", "true"]), minute) {
        return None;
    }
    Some(move || {
        let mut command = if is_root { cmd::program("apt-get") } else { cmd::program("sudo") };
        if !is_root {
            command.args(["-n", "DEBIAN_FRONTEND=noninteractive", "apt-get"]);
        }
        command.env("DEBIAN_FRONTEND", "noninteractive").stdin(std::process::Stdio::null());
        command
    })
}
