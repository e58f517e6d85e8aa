//! `cargo xtask check`: format, lints, documentation and the project's own rules.

use anyhow::{Context, Result, bail};

use crate::{cmd, deny, features, house_rules, public_functions, strings, wasm_target, web};

/// Runs every check, fast ones first.
pub(crate) fn check() -> Result<()> {
    keep_rules()?;
    features::check()?;
    deny::check()?;
    cmd::run(&mut cmd::cargo(&["fmt", "--all", "--check"]), "run `cargo fmt --all`")?;
    // The server's build embeds or reads this folder, which a fresh clone does not have.
    std::fs::create_dir_all(web::output_dir()).context("the folder target/web cannot be made")?;
    let mend = "mend what Clippy reports above";
    wasm_target::ensure()?;
    let lints = ["--", "-D", "warnings"];
    cmd::run(
        web::viewer_cargo("clippy")?.args(["--package", "sightline-viewer", "--lib"]).args(lints),
        mend,
    )?;
    for crates in [&["--package", "xtask"][..], &["--workspace", "--exclude", "xtask"]] {
        cmd::run(cmd::cargo(&["clippy", "--all-targets"]).args(crates).args(lints), mend)?;
        cmd::run(
            cmd::cargo(&["doc", "--no-deps"]).args(crates).env("RUSTDOCFLAGS", "-D warnings"),
            "mend the documentation reported above",
        )?;
    }
    cmd::print_line("All checks pass.");
    Ok(())
}

/// Checks the sources against the project's own rules.
fn keep_rules() -> Result<()> {
    let mut broken = house_rules::broken_rules(&cmd::root())?;
    broken.extend(public_functions::findings(&cmd::root())?);
    broken.extend(strings::findings(&cmd::root())?);
    for finding in &broken {
        cmd::print_line(finding);
    }
    match broken.len() {
        0 => {
            cmd::print_line("The rules of the house are kept.");
            Ok(())
        }
        1 => bail!("one rule of the house is broken: mend it as its message says"),
        number => bail!("{number} rules of the house are broken: mend them as their messages say"),
    }
}
