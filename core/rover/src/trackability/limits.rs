//! Limits of trackability beyond those of designation, which are in `limits.rs` and the template's settings.

use serde_json::Value;

use sightline_geometry::error::{Error, Result};
use sightline_track::limits::Domain;
use sightline_track::settings::{Changes, checked};
use sightline_track::settings_group;

settings_group! {
    /// The limits of trackability.
    TrackabilityLimits as "trackability" {
        /// Side of a map's cells.
        cell_px: u32 = 8, "px", Domain::Between(2.0, 64.0), "ours";
        /// Bad if the nearest depth edge is within this distance, where the match has most of its weight.
        /// less).
        edge_bad_px: f64 = 3.0, "px", Domain::Between(0.0, 50.0), "ours; Kim09 §5.2";
        /// Risky if the nearest depth edge is within this many `focus_px`.
        edge_risky_focus: f64 = 1.5, "", Domain::Between(0.0, 10.0), "ours; docs/trackability.md";
        /// A step between neighbours is a depth edge beyond this share of the disparity …
        edge_share: f64 = 0.03, "", Domain::Between(0.0, 1.0), "ours; warn_boundary";
        /// … and beyond the step of the steepest surface whose slope is accepted, px of disparity per px.
        edge_slope: f64 = 0.5, "px/px", Domain::Between(0.0, 10.0), "ours; STRETCH_LIMIT";
        /// Risky if the surface's normal is farther from the line of sight: its appearance changes on the way.
        slant_risky_deg: f64 = 80.0, "deg", Domain::Between(0.0, 90.0), "ours; docs/trackability.md";
        /// Risky if the 3σ error of the range, relative to the range, exceeds this.
        range_error_risky: f64 = 0.10, "", Domain::Between(0.0, 10.0), "ours; the step of Kim09 §5.4";
        /// Bad if it exceeds this.
        range_error_bad: f64 = 0.33, "", Domain::Between(0.0, 10.0), "ours";
        /// Pixels count as overexposed from this fraction of full scale on.
        saturated_level: f64 = 0.98, "", Domain::Between(0.0, 1.0), "ours";
        /// Risky if the fraction of overexposed pixels exceeds this.
        saturated_risky: f64 = 0.02, "", Domain::Between(0.0, 1.0), "ours";
        /// Bad if it exceeds this.
        saturated_bad: f64 = 0.25, "", Domain::Between(0.0, 1.0), "ours";
        /// Pixels count as dark below this fraction of the ground's median level.
        dark_level: f64 = 0.5, "", Domain::Between(0.0, 1.0), "ours";
        /// The score that typically remains after a step of 10 %; the remainder to 1 disturbs the match.
        step_score: f64 = 0.95, "", Domain::Between(0.0, 1.0), "ours; Kim09 §7.1 has 0.79 to 0.94";
        /// Risky if the expected error of a match exceeds this: half of the papers' half pixel.
        match_sigma_risky_px: f64 = 0.25, "px", Domain::Between(0.0, 10.0), "ours; Deans05 §2";
        /// Bad if it exceeds this: the papers' half pixel.
        match_sigma_bad_px: f64 = 0.5, "px", Domain::Between(0.0, 10.0), "ours; Deans05 §2";
        /// The longest safe step as a fraction of the range.
        step_share: f64 = 0.10, "", Domain::Between(0.0, 1.0), "Kim09 §5.4";
        /// Largest foreshortening of the window in a step.
        step_stretch: f64 = 0.10, "", Domain::Between(0.0, 1.0), "Kim09 §4.3.3";
    }
}

/// Limits of which the first must not exceed the second: between them the verdict is risky.
const PAIRS: [[&str; 2]; 3] = [
    ["range_error_risky", "range_error_bad"],
    ["saturated_risky", "saturated_bad"],
    ["match_sigma_risky_px", "match_sigma_bad_px"],
];

impl TrackabilityLimits {
    /// These limits with `changes` applied, or an error for an unknown name or a value out of range.
    ///
    /// # Errors
    /// [`Error::Setting`] with the limit, the problem and the allowed values.
    pub fn with(&self, changes: &Changes) -> Result<Self> {
        let table = Self::table();
        let mut document = serde_json::to_value(self).map_err(|e| Error::setting("", e.to_string()))?;
        for (info, value) in checked(changes, &table)? {
            document[&info.key] = value;
        }
        for [risky, bad] in PAIRS {
            let (from, to) = (&document[risky], &document[bad]);
            if from.as_f64() > to.as_f64() {
                let problem = format!("must not lie beyond {bad}, which is {to}: it is {from}");
                return Err(Error::setting(risky, problem));
            }
        }
        serde_json::from_value(document).map_err(|e| Error::setting("limits", e.to_string()))
    }

    /// Parses limits from a text such as `edge_bad_px=4,slant_risky_deg=70`; limits not named there keep their defaults.
    ///
    /// # Errors
    /// As [`Self::with`]; a part without `=`, and a limit that is named twice.
    pub fn parse(text: &str) -> Result<Self> {
        let mut changes = Changes::new();
        for part in text.split(',').map(str::trim).filter(|part| !part.is_empty()) {
            let (key, value) = part
                .split_once('=')
                .ok_or_else(|| Error::setting(part, "write it as name=value, for example edge_bad_px=4"))?;
            let value = value.trim();
            let value = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.to_owned()));
            if changes.insert(key.trim().to_owned(), value).is_some() {
                return Err(Error::setting(key.trim(), "is named twice: name it once"));
            }
        }
        Self::default().with(&changes)
    }

    /// The limits that differ from the defaults, by name.
    pub fn changes(&self) -> Changes {
        let document = serde_json::to_value(self).unwrap_or_default();
        let changed = |info: sightline_track::limits::SettingInfo| {
            let value = document.get(&info.key)?.clone();
            (value != info.default).then_some((info.key, value))
        };
        Self::table().into_iter().filter_map(changed).collect()
    }

    /// Changed limits in the form that [`Self::parse`] reads.
    pub fn text(changes: &Changes) -> String {
        changes.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(",")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_come_back_from_their_text_and_only_what_differs_is_said() {
        let limits =
            TrackabilityLimits::parse("edge_bad_px=4, slant_risky_deg=70,cell_px=16,edge_share=0.03")
                .unwrap();
        assert_eq!((limits.edge_bad_px, limits.slant_risky_deg, limits.cell_px), (4.0, 70.0, 16));
        let text = TrackabilityLimits::text(&limits.changes());
        assert_eq!(text, "cell_px=16,edge_bad_px=4.0,slant_risky_deg=70.0");
        assert_eq!(TrackabilityLimits::parse(&text).unwrap(), limits);
        assert_eq!(TrackabilityLimits::parse("").unwrap(), TrackabilityLimits::default());
    }

    #[test]
    fn what_cannot_be_is_refused_in_a_sentence_that_names_the_limit_and_the_way_out() {
        for (text, expected) in [
            ("edge_bad=4", "edge_bad: there is no such setting; did you mean edge_bad_px?"),
            ("edge_bad_px=-1", "edge_bad_px: must be a number from 0 to 50, not -1"),
            ("edge_bad_px=wide", "edge_bad_px: must be a number from 0 to 50, not \"wide\""),
            ("cell_px=8.5", "cell_px: must be a whole number, not 8.5"),
            ("edge_bad_px", "edge_bad_px: write it as name=value, for example edge_bad_px=4"),
            ("cell_px=8,cell_px=9", "cell_px: is named twice: name it once"),
            (
                "range_error_risky=0.5",
                "range_error_risky: must not lie beyond range_error_bad, which is 0.33: it is 0.5",
            ),
        ] {
            let said = TrackabilityLimits::parse(text).unwrap_err().to_string();
            assert!(said.contains(expected), "{text}: {said}");
        }
    }
}
