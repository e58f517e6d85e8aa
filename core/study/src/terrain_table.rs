//! Table II (K§5.5, R125) compared with ours: a line per terrain, configuration and use of visual odometry, over all
//! worlds.
//!
//! The paper counts trials with one target each, all with visual odometry. Ours counts targets, many per world.

use super::paper::{PaperTerrain, TABLE_II};
use super::row::Row;
use sightline_geometry::estimate::quantile::median;

/// Headings of the table, one per cell of [`TerrainLine::cells`].
pub const HEADINGS: [&str; 18] = [
    "terrain",
    "paper: trials",
    "failures",
    "cause",
    "configuration",
    "odometry",
    "worlds",
    "targets",
    "kept",
    "kept, %",
    "lost: window",
    "lost: correction",
    "lost: match",
    "lost: hidden",
    "false",
    "not driven",
    "prediction off, px",
    "pose off, cm",
];

/// One line of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct TerrainLine {
    /// Our terrain.
    pub terrain: String,
    /// Line of the paper; `None` for the stuck rover, which the paper counts among the steep inclines.
    pub paper: Option<PaperTerrain>,
    /// The configuration.
    pub configuration: String,
    /// Use of visual odometry.
    pub odometry: String,
    /// Number of worlds.
    pub worlds: usize,
    /// Number of targets.
    pub targets: u64,
    /// Number of targets tracked to the end of the planned drive.
    pub kept: u64,
    /// Numbers of losses by window, correction and match, and of hidden targets (`by_pose`).
    pub lost: [u64; 4],
    /// Number of targets with false tracking at the end; they are included in the losses.
    pub false_tracked: u64,
    /// Number of targets tracked at the stop at which slip ended the drive.
    pub not_driven: u64,
    /// Distance between prediction and target at the losses, median over the worlds, px.
    pub prediction_off_px: Option<f64>,
    /// Distance between the estimated and the true pose at the last stop, median over the worlds, m.
    pub pose_err_m: Option<f64>,
}

impl TerrainLine {
    /// Cells, one for each of [`HEADINGS`]; a dash if there is no value.
    pub fn cells(&self) -> [String; HEADINGS.len()] {
        let dash = || "–".to_owned();
        let printed = |of: fn(&PaperTerrain) -> String| self.paper.as_ref().map_or_else(dash, of);
        let number = |value: Option<f64>| value.map_or_else(dash, |value| format!("{value:.1}"));
        let [by_window, by_correction, by_match, hidden] = self.lost.map(|count| count.to_string());
        [
            self.terrain.clone(),
            printed(|paper| paper.trials.to_string()),
            printed(|paper| paper.failures.to_string()),
            printed(|paper| paper.cause.to_owned()),
            self.configuration.clone(),
            self.odometry.clone(),
            self.worlds.to_string(),
            self.targets.to_string(),
            self.kept.to_string(),
            number(Some(100.0 * self.kept as f64 / self.targets.max(1) as f64)),
            by_window,
            by_correction,
            by_match,
            hidden,
            self.false_tracked.to_string(),
            self.not_driven.to_string(),
            number(self.prediction_off_px),
            number(self.pose_err_m.map(|value_m| 100.0 * value_m)),
        ]
    }
}

/// Table of some rows, in their order; empty for studies without odometry.
pub fn table(rows: &[Row]) -> Vec<TerrainLine> {
    let word = |row: &Row, name: &str| row.columns.get(name)?.as_str().map(str::to_owned);
    let label = |row: &Row| Some((word(row, "terrain")?, row.configuration.clone(), word(row, "odometry")?));
    let mut labels: Vec<(String, String, String)> = Vec::new();
    for label in rows.iter().filter_map(label) {
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    // Terrain by terrain, as in the paper; otherwise in the order of the rows.
    let mut terrains: Vec<&String> = Vec::new();
    labels.iter().for_each(|(terrain, ..)| {
        if !terrains.contains(&terrain) {
            terrains.push(terrain);
        }
    });
    let of_terrain =
        |terrain: &String| labels.iter().filter(|label| label.0 == *terrain).cloned().collect::<Vec<_>>();
    let ordered = terrains.iter().flat_map(|terrain| of_terrain(terrain));
    ordered
        .map(|own| {
            let of_label: Vec<&Row> = rows.iter().filter(|row| label(row).as_ref() == Some(&own)).collect();
            line(own, &of_label)
        })
        .collect()
}

fn line((terrain, configuration, odometry): (String, String, String), rows: &[&Row]) -> TerrainLine {
    let sum = |name: &str| rows.iter().filter_map(|row| row.columns.get(name)?.as_u64()).sum();
    let middle = |name: &str| median(&rows.iter().filter_map(|row| row.number(name)).collect::<Vec<_>>());
    TerrainLine {
        paper: TABLE_II.iter().find(|paper| paper.terrain == terrain).copied(),
        worlds: rows.len(),
        targets: sum("targets"),
        kept: sum("tracked"),
        lost: ["lost_by_window", "lost_by_correction", "lost_by_match", "lost_hidden"].map(sum),
        false_tracked: sum("false_tracked"),
        not_driven: sum("not_driven"),
        prediction_off_px: middle("prediction_off_px_median"),
        pose_err_m: middle("pose_err_m"),
        terrain,
        configuration,
        odometry,
    }
}

/// Lines of text, the first one the headings; empty for studies without odometry.
pub fn lines(rows: &[Row]) -> Vec<String> {
    let table: Vec<[String; HEADINGS.len()]> = table(rows).iter().map(TerrainLine::cells).collect();
    if table.is_empty() {
        return Vec::new();
    }
    let all: Vec<[String; HEADINGS.len()]> =
        std::iter::once(HEADINGS.map(str::to_owned)).chain(table).collect();
    let width = |column: usize| all.iter().map(|cells| cells[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..HEADINGS.len()).map(width).collect();
    let text = |cells: &[String; HEADINGS.len()]| {
        let padded = cells.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    all.iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn row(seed: u64, terrain: &str, odometry: &str, kept: u64) -> Row {
        let columns = json!({
            "terrain": terrain, "odometry": odometry, "targets": 20, "tracked": kept, "false_tracked": 0,
            "not_driven": 0, "lost_by_window": 20 - kept, "lost_by_correction": 0, "lost_by_match": 0, "lost_hidden": 0,
            "prediction_off_px_median": (kept < 20).then_some(70.0), "pose_err_m": 0.01 * seed as f64,
        });
        Row {
            study: "terrain".to_owned(),
            configuration: "sightline".to_owned(),
            scenario: terrain.to_owned(),
            seed,
            columns: serde_json::from_value(columns).unwrap(),
        }
    }

    #[test]
    fn the_papers_row_stands_beside_the_sum_of_the_worlds() {
        let rows = [
            row(1, "slope-steep", "off", 0),
            row(2, "slope-steep", "off", 3),
            row(1, "stuck", "off", 0),
            row(1, "slope-steep", "full", 20),
        ];
        let table = table(&rows);
        assert_eq!(table.len(), 3);
        let [off, full, stuck] = [&table[0], &table[1], &table[2]];
        assert_eq!((off.worlds, off.targets, off.kept, off.lost), (2, 40, 3, [37, 0, 0, 0]));
        assert_eq!((full.odometry.as_str(), full.kept, full.prediction_off_px), ("full", 20, None));
        assert_eq!((off.paper.unwrap().trials, stuck.paper), (6, None));
        assert!((off.pose_err_m.unwrap() - 0.015).abs() < 1e-12 && off.cells()[17] == "1.5");
        let lines = lines(&rows);
        assert!(lines.len() == 4 && lines[1].contains("slip reached 100 %"), "{lines:?}");
    }

    #[test]
    fn a_study_without_odometry_has_no_table() {
        let mut plain = row(1, "slope-flat", "off", 20);
        plain.columns.remove("odometry");
        assert!(lines(&[plain]).is_empty());
    }

    #[test]
    fn table_two_adds_up_to_what_is_printed() {
        let sum = |of: fn(&PaperTerrain) -> u32| TABLE_II.iter().map(of).sum::<u32>();
        assert_eq!((sum(|paper| paper.trials), sum(|paper| paper.failures)), (26, 2));
    }
}
