//! `cargo xtask dist`: one program to hand out, with the viewer inside.

use anyhow::{Context, Result};

use crate::{cmd, web};

/// Builds the page, then the optimised program that embeds it, and puts it at `target/dist/sightline`.
pub(crate) fn dist() -> Result<()> {
    web::web()?;
    cmd::run(
        &mut cmd::cargo(&["build", "--package", "sightline-server", "--bin", "sightline", "--release"]),
        "mend what the compiler reports above",
    )?;
    let name = format!("sightline{}", std::env::consts::EXE_SUFFIX);
    let built = cmd::target_dir().join("release").join(&name);
    let directory = cmd::root().join("target").join("dist");
    let program = directory.join(&name);
    std::fs::create_dir_all(&directory)
        .and_then(|()| std::fs::copy(&built, &program))
        .with_context(|| format!("{} cannot be copied to {}", built.display(), program.display()))?;
    cmd::say(format!("The program is {}.", program.display()));
    Ok(())
}
