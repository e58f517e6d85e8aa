//! Installs Debian packages if this is possible without a password.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::Result;

use crate::cmd;

/// Installs packages and prints `why`; false on systems without `apt-get` or without permission to install.
pub(crate) fn install(why: &str, packages: &[&str]) -> Result<bool> {
    let Some(apt_get) = apt_get() else { return Ok(false) };
    cmd::print_line(format!("{why}: installing Debian's packages."));
    let mend = format!("install by hand: {}", packages.join(", "));
    cmd::run(apt_get().args(["update"]), &mend)?;
    cmd::run(apt_get().args(["install", "-y", "--no-install-recommends"]).args(packages), &mend)?;
    Ok(true)
}

/// The `apt-get` command with permission to install, if possible without a password.
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
