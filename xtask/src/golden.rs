//! `cargo xtask golden`: compares the golden lists of `core/tests/golden`, or records them again.

use anyhow::Result;

use crate::cmd;

/// Compares the golden lists with the current values, or records them again.
pub(crate) fn golden(is_update: bool) -> Result<()> {
    let mut command = cmd::cargo(&["test", "--package", "sightline-core", "--test", "golden"]);
    if is_update {
        command.env("SIGHTLINE_GOLDEN", "update");
        cmd::run(&mut command, "mend the tests reported above; the lists may be written in part")?;
        cmd::print_line("Golden lists written, except those named above as left out.");
        cmd::print_line(
            "Look at `git diff core/tests/golden/lists`, then commit it with the change that it belongs to.",
        );
    } else {
        command.env_remove("SIGHTLINE_GOLDEN");
        cmd::run(
            &mut command,
            "mend the code, or record the lists again with `cargo xtask golden --update` if the change is intended",
        )?;
        cmd::print_line("Golden lists unchanged; those named above as left out were not compared.");
    }
    Ok(())
}
