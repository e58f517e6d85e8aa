//! Settings of the navigator on the goodness map, and its two presets.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::error::{Error, Result};
use sightline_track::limits::Domain;
use sightline_track::settings_group;

/// Named set of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum NavigatorPreset {
    /// Votes of hazard, goal and steering; the worst cell under a path counts as much as the mean (R9).
    #[default]
    Gestalt,
    /// Goodness and certainty integrated under the path, old data discounted; an arbiter adds the goal.
    Morphin,
}

settings_group! {
    /// Settings of the navigator on the goodness map.
    NavigatorSettings as "navigator" {
        /// Number of arcs, from the tightest to the left to the tightest to the right.
        curvature_count: u32 = 23, "", Domain::OddBetween(3, 101), "ours, after Goldberg02";
        /// Curvature of the tightest arc.
        curvature_max_per_m: f64 = 1.0, "1/m", Domain::Between(0.05, 5.0), "ours, after Goldberg02";
        /// Smallest length over which paths are evaluated.
        evaluated_min_m: f64 = 1.2, "m", Domain::Between(0.1, 5.0), "ours, after Goldberg02";
        /// Sampling interval along a path.
        sample_m: f64 = 0.05, "m", Domain::Between(0.01, 0.5), "ours: half a cell";
        /// Distance of the leading disc of the footprint from the rover's origin: the disc covers the front wheels with a
        /// margin of 13 cm, because the top of a rock is that far behind its foot, where a wheel stalls.
        reach_m: f64 = 0.55, "m", Domain::Between(0.0, 2.0), "ours";
        /// Increment of the turns in place that are tried if no arc passes.
        turn_deg: f64 = 20.0, "deg", Domain::Between(1.0, 180.0), "ours, after Goldberg02";
        /// Distance backwards that is tried if no turn passes either; 0: none.
        back_up_m: f64 = 0.5, "m", Domain::Between(0.0, 5.0), "ours";
        /// A path is vetoed if a cell under its driven part has a lower goodness.
        goodness_min: f64 = 0.15, "", Domain::Between(0.0, 0.99), "ours, after Goldberg02";
        /// A path is vetoed if a larger fraction of the cells under its driven part is unknown.
        unknown_share_max: f64 = 0.30, "", Domain::Between(0.0, 1.0), "ours, after Goldberg02";
        /// A path backwards is vetoed on ground of lower certainty: no camera looks there.
        back_certainty_min: f64 = 0.8, "", Domain::Between(0.0, 1.0), "ours";
        /// Weight of the hazard in the vote.
        hazard_weight: f64 = 0.6, "", Domain::Between(0.0, 1.0), "ours, after Goldberg02";
        /// Weight of the goal in the vote.
        goal_weight: f64 = 0.3, "", Domain::Between(0.0, 1.0), "ours, after Goldberg02";
        /// Weight of steering in the vote.
        steer_weight: f64 = 0.1, "", Domain::Between(0.0, 1.0), "ours, after Goldberg02";
        /// Angle between heading and route at which the goal term is 1/e.
        goal_width_deg: f64 = 25.0, "deg", Domain::Between(1.0, 180.0), "ours, after Goldberg02";
        /// Weight of the worst cell in the hazard term; the remainder is that of the mean.
        worst_weight: f64 = 0.5, "", Domain::Between(0.0, 1.0), "ours, after Goldberg02";
        /// Distance driven in which the certainty of a cell halves in the hazard term; 0: never.
        age_half_life_m: f64 = 0.0, "m", Domain::Between(0.0, 1000.0), "ours; off";
        /// Whether the goal term follows a route over the map instead of the straight line to the goal.
        has_route: bool = true, "", Domain::Switch, "ours (D*)";
        /// Distance along the route of the point that a path heads for.
        look_ahead_m: f64 = 1.0, "m", Domain::Between(0.1, 5.0), "ours";
        /// Distance from bad cells below which ground costs more.
        clearance_m: f64 = 0.3, "m", Domain::Between(0.0, 3.0), "ours";
        /// Cost of unknown ground, in multiples of good ground.
        unknown_cost: f64 = 2.0, "", Domain::Between(1.0, 100.0), "ours";
        /// Cost of the worst ground, in multiples of good ground.
        bad_cost: f64 = 50.0, "", Domain::Between(1.0, 10_000.0), "ours";
        /// Distance within which a rover on bad cells must have left them.
        escape_m: f64 = 0.6, "m", Domain::Between(0.0, 3.0), "ours";
    }
}

impl NavigatorPreset {
    /// The settings of the preset.
    pub fn settings(self) -> NavigatorSettings {
        let gestalt = NavigatorSettings::default();
        match self {
            Self::Gestalt => gestalt,
            Self::Morphin => NavigatorSettings {
                worst_weight: 0.0,
                age_half_life_m: 10.0,
                hazard_weight: 0.5,
                goal_weight: 0.5,
                steer_weight: 0.0,
                ..gestalt
            },
        }
    }
}

impl NavigatorSettings {
    /// Rejects values out of range.
    ///
    /// # Errors
    /// [`Error::Setting`] with the setting and its range.
    pub fn validate(&self) -> Result<()> {
        let document = serde_json::to_value(self).map_err(|e| Error::setting("navigator", e.to_string()))?;
        for info in Self::table() {
            if let Some(problem) = info.problem_with(&document[&info.key]) {
                return Err(Error::setting(info.key, problem));
            }
        }
        Ok(())
    }
}
