//! `cargo xtask drill`: the program under load and in trouble, on the whole scale, as a table.

use anyhow::Result;

use crate::{cmd, serve, test};

/// Points at which the power is cut, and moments at which the program is killed.
const CUTS: &str = "1000";
const KILLS: &str = "200";

/// Runs every drill, one after the other; the lines of the table begin with `drill |`.
pub(crate) fn drill() -> Result<()> {
    serve::build_all()?;
    let mut command = cmd::cargo(&["test", "--workspace", "--exclude", "xtask", "--", "--nocapture"]);
    command.args(["--test-threads=1", "drill_", "power_", "killed_"]);
    command.env("SIGHTLINE_BIN", cmd::sightline_binary()).env("SIGHTLINE_DRILL", "whole");
    command.env("SIGHTLINE_POWER_LOSS_POINTS", CUTS).env("SIGHTLINE_KILLS", KILLS);
    test::run_and_count(&mut command)?;
    Ok(())
}
