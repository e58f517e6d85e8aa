//! `cargo xtask drill`: tests the program under load and with faults, at full scale, and prints a table.

use anyhow::Result;

use crate::{cmd, serve, test};

/// Number of power cuts, and number of times that the program is killed.
const CUTS: &str = "1000";
const KILLS: &str = "200";

/// The start of a table line in the output of the tests, which may follow the name of a test.
const MARK: &str = "drill | ";

/// Runs every drill in sequence and prints the table of outcomes, even if one of them fails.
pub(crate) fn drill() -> Result<()> {
    serve::build_all()?;
    let mut command =
        cmd::cargo(&["test", "--workspace", "--exclude", "xtask", "--no-fail-fast", "--", "--nocapture"]);
    command.args(["--test-threads=1", "drill_", "power_", "killed_"]);
    command.env("SIGHTLINE_BIN", cmd::sightline_binary()).env("SIGHTLINE_DRILL", "whole");
    command.env("SIGHTLINE_POWER_LOSS_POINTS", CUTS).env("SIGHTLINE_KILLS", KILLS);
    let mut outcomes = Vec::new();
    let count = test::run_and_read(&mut command, |line| outcomes.extend(outcome(line)));
    for line in table(&outcomes) {
        cmd::print_line(line);
    }
    cmd::print_line(count?.shown());
    Ok(())
}

/// The name and outcome of a drill, parsed from a line of the tests.
fn outcome(line: &str) -> Option<[String; 2]> {
    let (_, rest) = line.split_once(MARK)?;
    let (name, outcome) = rest.split_once(" | ")?;
    Some([name, outcome].map(|text| text.trim().to_owned()))
}

/// The lines of the table, with the first column padded to equal width.
fn table(outcomes: &[[String; 2]]) -> Vec<String> {
    let width = outcomes.iter().map(|[name, _]| name.chars().count()).max().unwrap_or(0).max("drill".len());
    let mut lines = vec![String::new(), format!("| {:<width$} | outcome", "drill")];
    lines.push(format!("|{}|--------", "-".repeat(width + 2)));
    lines.extend(outcomes.iter().map(|[name, outcome]| format!("| {name:<width$} | {outcome}")));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_of_tests_become_a_table() {
        let lines = [
            "test drill::clock::drill_of_clocks ... drill | clock before 1970            | starts",
            "ok",
            "drill | full disk | 12 → 12 | all written",
        ];
        let outcomes: Vec<_> = lines.iter().filter_map(|line| outcome(line)).collect();
        let expected = [
            "",
            "| drill             | outcome",
            "|-------------------|--------",
            "| clock before 1970 | starts",
            "| full disk         | 12 → 12 | all written",
        ];
        assert_eq!(table(&outcomes), expected);
    }
}
