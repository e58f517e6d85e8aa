//! Installing Debian's packages, where that is possible without asking.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::Result;

use crate::cmd;

/// Installs packages and says why; false on systems without `apt-get` or without the right to install.
pub(crate) fn install(why: &str, packages: &[&str]) -> Result<bool> {
    let Some(apt_get) = apt_get() else { return Ok(false) };
    cmd::say(format!("{why}: installing Debian's packages."));
    let mend = format!("install by hand: {}", packages.join(", "));
    cmd::run(apt_get().args(["update"]), &mend)?;
    cmd::run(apt_get().args(["install", "-y", "--no-install-recommends"]).args(packages), &mend)?;
    Ok(true)
}

/// How to run `apt-get` with the right to install, where that is possible without asking.
fn apt_get() -> Option<impl Fn() -> Command> {
    if !Path::new("/etc/debian_version").exists() {
        return None;
    }
    let minute = Duration::from_secs(60);
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
        command.env("DEBIAN_FRONTEND", "noninteractive").stdin(Stdio::null());
        command
    })
}
