//! The limits of trackability that designation does not have already; those it has are in `limits.rs` and the template's settings.

use crate::limits::Domain;
use crate::settings_group;

settings_group! {
    /// The limits of trackability.
    TrackabilityLimits as "trackability" {
        /// Side of a map's cells.
        cell_px: u32 = 8, "px", Domain::Between(2.0, 64.0), "ours";
        /// A place is bad whose nearest depth edge is not farther: it lies where the match counts most (`focus_px` less).
        edge_bad_px: f64 = 3.0, "px", Domain::Between(0.0, 50.0), "ours, R119";
        /// A place is risky whose nearest depth edge is not farther than so many widths of the focus (`focus_px`).
        edge_risky_focus: f64 = 1.5, "", Domain::Between(0.0, 10.0), "ours; docs/trackability.md";
        /// A step between neighbours is a depth edge beyond this share of the disparity …
        edge_share: f64 = 0.03, "", Domain::Between(0.0, 1.0), "ours; warn_boundary";
        /// … and beyond what the steepest surface makes whose slope is believed, px of disparity per px.
        edge_slope: f64 = 0.5, "px/px", Domain::Between(0.0, 10.0), "ours; STRETCH_LIMIT";
        /// A place is risky whose surface is turned farther away from the line of sight: what it shows changes on the way.
        slant_risky_deg: f64 = 80.0, "deg", Domain::Between(0.0, 90.0), "ours; docs/trackability.md";
        /// The 3σ error of the range, over the range, from which on a place is risky.
        range_error_risky: f64 = 0.10, "", Domain::Between(0.0, 10.0), "ours; the step of R104";
        /// The same for a bad one.
        range_error_bad: f64 = 0.33, "", Domain::Between(0.0, 10.0), "ours";
        /// Pixels count as overexposed from this share of full scale on.
        saturated_level: f64 = 0.98, "", Domain::Between(0.0, 1.0), "ours";
        /// The share of overexposed pixels from which on a place is risky.
        saturated_risky: f64 = 0.02, "", Domain::Between(0.0, 1.0), "ours";
        /// The same for a bad one.
        saturated_bad: f64 = 0.25, "", Domain::Between(0.0, 1.0), "ours";
        /// Pixels count as dark below this share of the ground's middle level.
        dark_level: f64 = 0.5, "", Domain::Between(0.0, 1.0), "ours";
        /// The score that a step of 10 % typically leaves; what it misses disturbs the match.
        step_score: f64 = 0.95, "", Domain::Between(0.0, 1.0), "ours; R134 has 0.79 to 0.94";
        /// The expected error of a match from which on a place is risky: half of the papers' half pixel.
        match_sigma_risky_px: f64 = 0.25, "px", Domain::Between(0.0, 10.0), "ours; R170";
        /// The same for a bad one: the papers' half pixel.
        match_sigma_bad_px: f64 = 0.5, "px", Domain::Between(0.0, 10.0), "ours; R170";
        /// The longest safe step as a share of the range.
        step_share: f64 = 0.10, "", Domain::Between(0.0, 1.0), "R104, R105";
        /// How much the window may be foreshortened in a step.
        step_stretch: f64 = 0.10, "", Domain::Between(0.0, 1.0), "R60";
    }
}
