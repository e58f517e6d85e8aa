//! Every threshold and parameter that a user may change, declared once with unit, default, range and source.
//!
//! `settings_group!` turns a table into a struct, its defaults and its description, so that the viewer's
//! form, `--set key=value` and the documentation are the same table. Values marked *(ours)* are not from the
//! papers (R228).

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, OneOfBuilder, Schema, Type};

/// The values that a setting accepts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Domain {
    /// A number between two bounds, both included.
    Between(f64, f64),
    /// An odd whole number between two bounds, both included.
    OddBetween(u32, u32),
    /// On or off.
    Switch,
    /// One of these words.
    Choice(Vec<String>),
}

impl Domain {
    /// Returns a choice of `words`.
    pub fn choice(words: &[&str]) -> Self {
        Self::Choice(words.iter().map(|&w| w.to_owned()).collect())
    }

    /// Returns why `value` is not accepted, as a clause that follows the setting's name; `None` if it is accepted.
    pub fn problem_with(&self, value: &serde_json::Value) -> Option<String> {
        match self {
            Self::Between(low, high) => match value.as_f64() {
                Some(v) if (*low..=*high).contains(&v) => None,
                _ => Some(format!("must be a number from {low} to {high}, not {value}")),
            },
            Self::OddBetween(low, high) => match value.as_u64() {
                Some(v) if v % 2 == 1 && (u64::from(*low)..=u64::from(*high)).contains(&v) => None,
                _ => Some(format!("must be an odd whole number from {low} to {high}, not {value}")),
            },
            Self::Switch => (!value.is_boolean()).then(|| format!("must be true or false, not {value}")),
            Self::Choice(words) => {
                let known = value.as_str().is_some_and(|v| words.iter().any(|w| w == v));
                (!known).then(|| format!("must be one of {}, not {value}", words.join(", ")))
            }
        }
    }
}

/// The schema of a setting's value: a number, a switch or a word.
fn value_schema() -> Schema {
    let one = |kind: Type| ObjectBuilder::new().schema_type(kind);
    let kinds = [Type::Number, Type::Boolean, Type::String].map(one);
    Schema::OneOf(kinds.into_iter().fold(OneOfBuilder::new(), OneOfBuilder::item).build())
}

/// The schema of several values.
fn value_list_schema() -> Schema {
    Schema::Array(ArrayBuilder::new().items(RefOr::T(value_schema())).build())
}

/// Values of another setting under which a setting has an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Condition {
    /// The other setting.
    pub key: String,
    /// The values to compare with.
    #[schema(schema_with = value_list_schema)]
    pub values: Vec<serde_json::Value>,
    /// Whether the other setting must have none of these values, instead of one of them.
    pub excluded: bool,
}

impl Condition {
    /// Whether a value of the other setting meets the condition.
    pub(crate) fn is_met_by(&self, value: &serde_json::Value) -> bool {
        let equal = |wanted: &serde_json::Value| match (wanted.as_f64(), value.as_f64()) {
            (Some(wanted), Some(value)) => wanted == value,
            _ => wanted == value,
        };
        self.values.iter().any(equal) != self.excluded
    }
}

impl std::fmt::Display for Condition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let word =
            |value: &serde_json::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let values: Vec<_> = self.values.iter().map(word).collect();
        write!(f, "{} {} {}", self.key, if self.excluded { "≠" } else { "=" }, values.join(" or "))
    }
}

/// The description of one setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SettingInfo {
    /// The name, unique over all groups.
    pub key: String,
    /// The group of the setting: `limits` or the locator's name.
    pub group: String,
    /// The unit, empty for pure numbers.
    pub unit: String,
    /// The default.
    #[schema(schema_with = value_schema)]
    pub default: serde_json::Value,
    /// The values it may take.
    pub domain: Domain,
    /// The source of the default.
    pub source: String,
    /// The effect, and the symptoms of a wrong value.
    pub help: String,
    /// Conditions of which at least one must be met for the setting to have an effect; empty: it always has one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub only_if: Vec<Condition>,
}

impl SettingInfo {
    /// Converts `value` to the setting's type: a whole number may be written as 100.0.
    pub(crate) fn normalised(&self, value: &serde_json::Value) -> serde_json::Value {
        let whole = value.as_f64().filter(|v| v.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(v));
        match whole {
            Some(whole) if self.default.is_u64() => (whole as u64).into(),
            _ => value.clone(),
        }
    }

    /// Returns why `value` is not accepted, as a clause that follows the setting's name; `None` if it is accepted.
    pub fn problem_with(&self, value: &serde_json::Value) -> Option<String> {
        let is_broken = self.default.is_u64() && !value.is_u64();
        self.domain
            .problem_with(value)
            .or_else(|| is_broken.then(|| format!("must be a whole number, not {value}")))
    }

    /// Whether the setting has an effect, given the values of the other settings in `table`.
    pub fn has_effect(&self, table: &[Self], value: &dyn Fn(&Self) -> serde_json::Value) -> bool {
        let is_met = |condition: &Condition| {
            let other = table.iter().find(|other| other.key == condition.key);
            other.is_some_and(|other| condition.is_met_by(&value(other)) && other.has_effect(table, value))
        };
        let is_of_the_tracker = self.trackers().is_none_or(|condition| is_met(&condition));
        is_of_the_tracker && (self.only_if.is_empty() || self.only_if.iter().any(is_met))
    }

    /// When the setting has an effect, in words: `measure = sdog`; `None` if it always has one.
    pub fn condition(&self) -> Option<String> {
        let words: Vec<_> = self.only_if.iter().map(Condition::to_string).collect();
        let own = (!words.is_empty()).then(|| words.join(", or "));
        let trackers = self.trackers().filter(|of| self.only_if.iter().all(|own| own.key != of.key));
        match (trackers, own) {
            (Some(trackers), Some(own)) => Some(format!("{trackers}, and {own}")),
            (Some(trackers), None) => Some(trackers.to_string()),
            (None, own) => own,
        }
    }

    /// The trackers that use the group of this setting; `None`: all of them, since all designate by point stereo.
    fn trackers(&self) -> Option<Condition> {
        let words = match self.group.as_str() {
            "features" => ["features", "combined"],
            "shape" => ["shape", "combined"],
            _ => return None,
        };
        let values = words.map(serde_json::Value::from).to_vec();
        Some(Condition { key: "tracker".to_owned(), values, excluded: false })
    }
}

/// Declares a group of settings: the struct, its defaults, and `table()` that describes it.
///
/// A setting that has an effect only for some values of another one ends with `, if other = "word" | "word"` or `,
/// unless other = 0.0`; several of these are alternatives.
#[macro_export]
macro_rules! settings_group {
    ($(#[$meta:meta])* $name:ident as $group:literal {
        $( $(#[doc = $help:literal])+ $key:ident: $ty:ty = $default:expr, $unit:literal, $domain:expr, $source:literal
           $(, if $parent:ident = $($value:literal)|+ )* $(, unless $other:ident = $excluded:literal )*; )*
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name { $( $(#[doc = $help])+ pub $key: $ty, )* }

        impl Default for $name {
            fn default() -> Self { Self { $( $key: $default, )* } }
        }

        impl $name {
            /// The description of every setting of this group, in the order of declaration.
            pub fn table() -> Vec<$crate::limits::SettingInfo> {
                let defaults = Self::default();
                vec![ $( $crate::limits::SettingInfo {
                    key: stringify!($key).to_owned(),
                    group: $group.to_owned(),
                    unit: $unit.to_owned(),
                    default: serde_json::to_value(&defaults.$key).unwrap_or_default(),
                    domain: $domain,
                    source: $source.to_owned(),
                    help: [$($help.trim()),+].join(" "),
                    only_if: vec![
                        $( $crate::limits::Condition {
                            key: stringify!($parent).to_owned(),
                            values: vec![$(serde_json::json!($value)),+],
                            excluded: false,
                        }, )*
                        $( $crate::limits::Condition {
                            key: stringify!($other).to_owned(),
                            values: vec![serde_json::json!($excluded)],
                            excluded: true,
                        }, )*
                    ],
                }, )* ]
            }
        }
    };
}

settings_group! {
    /// The thresholds of `judge`: the four loss criteria of K§4.6 and the state machine.
    Limits as "limits" {
        /// Criterion 1: a match that scores below this is rejected. Too high: false losses; too low: false tracking.
        ncc_min: f64 = 0.7, "", Domain::Between(-1.0, 1.0), "Kim09 §4.6";
        /// Criterion 2: a point-stereo match that scores below this is rejected.
        stereo_ncc_min: f64 = 0.7, "", Domain::Between(-1.0, 1.0), "Kim09 §4.6";
        /// Largest distance between the left pixel and the match of its right pixel in the left image; 0: off.
        left_right_max_px: f64 = 0.0, "px", Domain::Between(0.0, 100.0), "ours";
        /// Safety factor on the distance and position tolerances (criteria 3 and 4).
        tolerance_factor: f64 = 1.5, "", Domain::Between(0.1, 100.0), "ours";
        /// Disparity error that the tolerances assume, as a 3σ value.
        disparity_error_px: f64 = 1.0, "px", Domain::Between(0.01, 20.0), "Kim09 §4.2";
        /// Navigation error that the tolerances assume, as a fraction of the distance driven.
        navigation_error_fraction: f64 = 0.02, "", Domain::Between(0.0, 1.0), "Kim09 §4.2";
        /// Lowest score of a match far from the prediction (see far_sigma); -1: the same as for other matches.
        far_ncc_min: f64 = 0.85, "", Domain::Between(-1.0, 1.0), "ours; docs/tracking.md";
        /// Distance from the prediction beyond which a match is far, in standard deviations of prediction and match
        /// combined.
        far_sigma: f64 = 3.0, "", Domain::Between(0.0, 1000.0), "ours; docs/tracking.md", unless far_ncc_min = -1.0, unless far_miss_factor = 1.0;
        /// Largest ratio of the second peak to the best one; near 1 the match is ambiguous. 1: off.
        second_peak_ratio_max: f64 = 1.0, "", Domain::Between(0.0, 1.0), "ours; off";
        /// Largest 1σ error of a match along its worst direction; 0: off.
        match_sigma_max_px: f64 = 0.0, "px", Domain::Between(0.0, 100.0), "ours; off";
        /// Smallest distance of the peak from the border of the search window, beyond which the true match may be; 0: off.
        edge_distance_min_px: f64 = 0.0, "px", Domain::Between(0.0, 100.0), "ours; off";
        /// Warns at designation if the spread of ranges in the window exceeds this fraction of the distance.
        warn_depth_range: f64 = 0.1, "", Domain::Between(0.0, 10.0), "ours";
        /// Warns at designation if the window's standard deviation is below this fraction of full scale.
        warn_contrast: f64 = 0.01, "", Domain::Between(0.0, 1.0), "ours";
        /// Warns at designation if the stereo match leads back to a left pixel farther away than this.
        warn_left_right_px: f64 = 1.5, "px", Domain::Between(0.0, 100.0), "ours";
        /// Warns at designation if a larger fraction of the window is in shadow; needs a known sun direction.
        warn_shadow_share: f64 = 0.2, "", Domain::Between(0.0, 1.0), "ours";
        /// Warns at designation of an occluding boundary: the ranges in the window deviate from a plane by more than this
        /// fraction of the distance.
        warn_boundary: f64 = 0.03, "", Domain::Between(0.0, 10.0), "ours";
        /// Confidence below which the feature tracker declares the target lost and dead reckoning takes over.
        confidence_min: f64 = 0.5, "", Domain::Between(0.0, 1.0), "ours";
        /// Confidence at which a lost target counts as found again.
        confidence_return: f64 = 0.7, "", Domain::Between(0.0, 1.0), "ours";
        /// Largest relative difference of focal length at which two stops have the same cameras; otherwise the target is
        /// handed off. Too large: a change of cameras is missed.
        same_camera_focal_share: f64 = 0.02, "", Domain::Between(0.0001, 1.0), "ours";
        /// Number of further updates after a loss before tracking fails.
        n_retry: u32 = 2, "updates", Domain::Between(0.0, 100.0), "Kim09 §4.6";
        /// Counts the update that detects the loss among the n_retry updates (the stricter reading).
        count_detecting_update: bool = false, "", Domain::Switch, "ours; Kim09 §4.6 leaves it open";
    }
}
