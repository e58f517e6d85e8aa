//! `cargo xtask bench`: runs the benchmarks in the development profile, whose dependencies are already compiled.

use anyhow::Result;

use crate::cmd;

/// Runs the benchmarks whose names contain `filter`, or all of them.
///
/// The development profile is optimised; Cargo's bench profile would compile every dependency again.
pub(crate) fn bench(filter: Option<&str>) -> Result<()> {
    std::fs::create_dir_all(crate::web::output_dir())?;
    let mut cargo =
        cmd::cargo(&["bench", "--workspace", "--exclude", "xtask", "--benches", "--profile", "dev"]);
    if let Some(filter) = filter {
        cargo.arg("--").arg(filter);
    }
    cmd::run(&mut cargo, "mend the benchmark reported above")
}
