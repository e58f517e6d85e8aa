//! The hand-offs of a study as a table in the paper's form (D-Tab 1 and 3, R210–R213): a line per configuration and
//! point of the grid, over all worlds.
//!
//! In centimetres, as in the paper; median and 95th percentile over the rows.

use super::row::Row;
use sightline_geometry::estimate::quantile::quantile;

/// Columns: title, column of the rows, and prefix of the counts of tried and failed registrations.
const COLUMNS: [(&str, &str, Option<&str>); 4] = [
    ("drift", "drift_m", None),
    ("tracker", "tracker_error_m", None),
    ("first view", "first_view_error_m", Some("first_view")),
    ("hand-off", "hand_off_error_m", Some("hand_off")),
];

/// The lines of the table, the first one its head; empty without hand-offs. `variable` is the study's variable.
pub fn lines(rows: &[Row], variable: &str) -> Vec<String> {
    let mut groups: Vec<(String, String)> = Vec::new();
    let label = |row: &Row| {
        let value = row.columns.get(variable).map(|value| value.to_string().trim_matches('"').to_owned());
        (row.configuration.clone(), value.unwrap_or_else(|| row.scenario.clone()))
    };
    for row in rows.iter().filter(|row| row.columns.contains_key("tracker_error_m")) {
        let group = label(row);
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    if groups.is_empty() {
        return Vec::new();
    }
    let titles = COLUMNS.map(|(title, ..)| format!("{:>22}", format!("{title}, cm")));
    let head = format!("{:<24} {:<16} {:>6}{}", "configuration", variable, "worlds", titles.concat());
    let line = |group: &(String, String)| {
        let own: Vec<&Row> = rows.iter().filter(|row| label(row) == *group).collect();
        let cells = COLUMNS.map(|(_, column, tried)| format!("{:>22}", cell(&own, column, tried)));
        format!("{:<24} {:<16} {:>6}{}", group.0, group.1, own.len(), cells.concat())
    };
    std::iter::once(head).chain(groups.iter().map(line)).collect()
}

/// Median and 95th percentile, and the numbers of used and of tried registrations.
fn cell(rows: &[&Row], column: &str, tried: Option<&str>) -> String {
    let values: Vec<f64> = rows.iter().filter_map(|row| row.number(column)).collect();
    let of = |share: f64| {
        quantile(&values, share).map_or_else(|| "–".to_owned(), |value_m| format!("{:.2}", 100.0 * value_m))
    };
    let sum = |name: &str, what: &str| -> f64 {
        rows.iter().filter_map(|row| row.number(&format!("{name}_{what}"))).sum()
    };
    let used = tried.map_or_else(String::new, |name| {
        format!(" ({:.0}/{:.0})", sum(name, "tried") - sum(name, "failed"), sum(name, "tried"))
    });
    format!("{} {}{used}", of(0.5), of(0.95))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn row(seed: u64, scenario: &str, hand_off_m: Option<f64>) -> Row {
        let columns = json!({
            "scenario": scenario, "drift_m": 0.001, "tracker_error_m": 0.01 * seed as f64,
            "first_view_error_m": 0.002, "first_view_tried": 1, "first_view_failed": 0,
            "hand_off_error_m": hand_off_m, "hand_off_tried": 1, "hand_off_failed": u8::from(hand_off_m.is_none()),
        });
        Row {
            study: "k9".to_owned(),
            configuration: "combined".to_owned(),
            scenario: scenario.to_owned(),
            seed,
            columns: serde_json::from_value(columns).unwrap(),
        }
    }

    #[test]
    fn a_line_has_medians_in_centimetres_and_counts_what_was_used() {
        let rows = [
            row(1, "k9-5", Some(0.004)),
            row(2, "k9-5", None),
            row(3, "k9-5", Some(0.006)),
            row(1, "k9-10", None),
        ];
        let lines = lines(&rows, "scenario");
        assert_eq!(lines.len(), 3);
        assert!(
            lines[1].contains("k9-5")
                && lines[1].contains("2.00 2.90")
                && lines[1].contains("0.50 0.59 (2/3)"),
            "{}",
            lines[1]
        );
        assert!(lines[2].contains("– – (0/1)"), "{}", lines[2]);
    }

    #[test]
    fn a_study_without_hand_overs_has_no_table() {
        let mut plain = row(1, "k9-5", None);
        plain.columns.clear();
        assert!(lines(&[plain], "scenario").is_empty());
    }
}
