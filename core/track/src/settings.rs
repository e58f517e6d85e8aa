//! One tracker configuration: the limits and the locator's own settings, changed by `key=value`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::limits::{Domain, Limits, SettingInfo};
use crate::locate::features::settings::FeatureSettings;
use crate::locate::shape_tracker::settings::ShapeTrackerSettings;
use crate::locate::template::settings::TemplateSettings;
use sightline_geometry::error::{Error, Result};

/// Changes to settings by name, as a user writes them.
pub type Changes = BTreeMap<String, Value>;

/// The locator of the target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TrackerKind {
    /// Normalised correlation of a scaled and rolled template (Kim et al. 2009).
    #[default]
    Template,
    /// The rigid motion of the whole scene, from its features (Deans et al. 2005).
    Features,
    /// The shape of the target's surroundings (Deans et al. 2005).
    Shape,
    /// Features during the drive, the shape at the end (Deans et al. 2005, D§4).
    Combined,
}

impl TrackerKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Template, Self::Features, Self::Shape, Self::Combined];

    /// The name, as in the settings.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Template => "template",
            Self::Features => "features",
            Self::Shape => "shape",
            Self::Combined => "combined",
        }
    }

    /// The method in a few words.
    pub const fn about(self) -> &'static str {
        match self {
            Self::Template => "Normalised correlation of a scaled and rolled template",
            Self::Features => "The rigid transform of the whole scene, from its features",
            Self::Shape => "Registration of the shape of the target's surroundings",
            Self::Combined => "Features during the drive, shape registration at the end",
        }
    }

    /// The name of the validated preset: the configuration that the studies of docs/ recommend.
    pub const fn preset(self) -> &'static str {
        match self {
            Self::Template => "sightline",
            Self::Features => "features",
            Self::Shape => "shape",
            Self::Combined => "combined",
        }
    }

    /// Whether features are tracked during the drive.
    pub const fn follows_features(self) -> bool {
        matches!(self, Self::Features | Self::Combined)
    }

    /// Whether the shape is registered at some stop.
    pub const fn asks_shape(self) -> bool {
        matches!(self, Self::Shape | Self::Combined)
    }
}

/// One tracker configuration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// The locator.
    pub tracker: TrackerKind,
    /// The thresholds of `judge`.
    pub limits: Limits,
    /// The settings of the template locator.
    pub template: TemplateSettings,
    /// The settings of the feature locator.
    pub features: FeatureSettings,
    /// The settings of the shape tracker.
    pub shape: ShapeTrackerSettings,
}

/// The name of the setting that chooses the locator; it is its own group.
const TRACKER: &str = "tracker";

impl Settings {
    /// The description of the choice of the locator.
    fn tracker_info() -> SettingInfo {
        SettingInfo {
            key: TRACKER.to_owned(),
            group: TRACKER.to_owned(),
            unit: String::new(),
            default: serde_json::to_value(TrackerKind::default()).unwrap_or_default(),
            domain: Domain::choice(&TrackerKind::ALL.map(TrackerKind::word)),
            source: "Kim09, Deans05".to_owned(),
            help: "Tracker: template matching, the rigid transform of scene features, registration of the shape of the \
                   target's surroundings, or features during the drive and shape registration at the end."
                .to_owned(),
            only_if: Vec::new(),
        }
    }

    /// The description of every setting, group by group.
    pub fn table() -> Vec<SettingInfo> {
        let mut table = vec![Self::tracker_info()];
        table.extend(Limits::table());
        table.extend(TemplateSettings::table());
        table.extend(FeatureSettings::table());
        table.extend(ShapeTrackerSettings::table());
        table
    }

    /// Side of the square subframe that `capture` cuts out about the prediction, px.
    pub const fn subframe_px(&self) -> u32 {
        self.template.subframe_px
    }

    /// These settings with `changes` applied; an unknown name or a value out of range changes nothing.
    ///
    /// # Errors
    /// [`Error::Setting`] naming the key, what is wrong with it, and the nearest known name.
    pub fn with(&self, changes: &Changes) -> Result<Self> {
        let table = Self::table();
        let mut document = serde_json::to_value(self).map_err(|e| Error::setting("", e.to_string()))?;
        for (info, value) in checked(changes, &table)? {
            let place = if info.group == TRACKER { &mut document } else { &mut document[&info.group] };
            place[&info.key] = value;
        }
        serde_json::from_value(document).map_err(|e| Error::setting(join_keys(changes), e.to_string()))
    }

    /// The value of a setting, by its group and name.
    pub fn value(&self, group: &str, key: &str) -> Option<Value> {
        let document = serde_json::to_value(self).ok()?;
        let place = if group == TRACKER { &document } else { document.get(group)? };
        place.get(key).cloned()
    }

    /// The settings among `changes` that have no effect, given the others, each with the condition under which it has one.
    pub fn without_effect(&self, changes: &Changes) -> Vec<(String, String)> {
        if changes.is_empty() {
            return Vec::new();
        }
        let (table, document) = (Self::table(), serde_json::to_value(self).unwrap_or_default());
        let value = |info: &SettingInfo| info.value_in(&document).cloned().unwrap_or_default();
        let idle =
            table.iter().filter(|info| changes.contains_key(&info.key) && !info.has_effect(&table, &value));
        idle.filter_map(|info| Some((info.key.clone(), info.condition()?))).collect()
    }

    /// The settings that differ from the defaults, by name.
    pub fn changes(&self) -> Changes {
        self.changes_from(&Self::default())
    }

    /// The settings that differ from those of `before`, by name: the changes from `before` to `self`.
    pub fn changes_from(&self, before: &Self) -> Changes {
        if self == before {
            return Changes::new();
        }
        let [now, then] = [self, before].map(|settings| serde_json::to_value(settings).unwrap_or_default());
        let differing = Self::table().into_iter().filter_map(|info| {
            let value = info.value_in(&now)?;
            (Some(value) != info.value_in(&then)).then(|| (info.key.clone(), value.clone()))
        });
        differing.collect()
    }
}

impl SettingInfo {
    /// The setting's value in serialised settings.
    pub fn value_in<'a>(&self, settings: &'a Value) -> Option<&'a Value> {
        let place = if self.group == TRACKER { settings } else { settings.get(&self.group)? };
        place.get(&self.key)
    }
}

/// Parses `key=value`; the value is JSON if possible (numbers, `true`), otherwise a string.
///
/// # Errors
/// [`Error::Setting`] if there is no `=`.
pub fn parse_assignment(text: &str) -> Result<(String, Value)> {
    let (key, value) = text
        .split_once('=')
        .ok_or_else(|| Error::setting(text, "write it as key=value, for example ncc_min=0.6"))?;
    let value = value.trim();
    let parsed = serde_json::from_str(value).unwrap_or_else(|_| Value::String(value.to_owned()));
    Ok((key.trim().to_owned(), parsed))
}

fn join_keys(changes: &Changes) -> String {
    changes.keys().cloned().collect::<Vec<_>>().join(", ")
}

/// Returns every change with its normalised value and the description of its setting.
///
/// # Errors
/// [`Error::Setting`] naming the first unknown setting or invalid value.
pub fn checked<'a>(changes: &'a Changes, table: &'a [SettingInfo]) -> Result<Vec<(&'a SettingInfo, Value)>> {
    let check = |(key, value): (&'a String, &'a Value)| {
        let info = table.iter().find(|info| info.key == *key).ok_or_else(|| unknown(key, table))?;
        let value = info.normalised(value);
        match info.problem_with(&value) {
            Some(problem) => Err(Error::setting(key, problem)),
            None => Ok((info, value)),
        }
    };
    changes.iter().map(check).collect()
}

fn unknown(key: &str, table: &[SettingInfo]) -> Error {
    let nearest =
        table.iter().min_by_key(|info| strsim::levenshtein(key, &info.key)).map(|info| info.key.as_str());
    let hint = nearest.map(|n| format!("; did you mean {n}?")).unwrap_or_default();
    Error::setting(key, format!("there is no such setting{hint}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn change(key: &str, value: Value) -> Result<Settings> {
        Settings::default().with(&Changes::from([(key.to_owned(), value)]))
    }

    #[test]
    fn a_known_setting_changes_and_is_listed_as_changed() {
        let settings = change("ncc_min", json!(0.55)).unwrap();
        assert_eq!(settings.limits.ncc_min, 0.55);
        assert_eq!(settings.changes(), Changes::from([("ncc_min".to_owned(), json!(0.55))]));
    }

    #[test]
    fn a_whole_number_may_be_written_with_a_point() {
        assert_eq!(change("n_retry", json!(3.0)).unwrap().limits.n_retry, 3);
        assert_eq!(change("template_size_px", json!(21.0)).unwrap().template.template_size_px, 21);
        for wrong in [json!(2.5), json!(-1.0), json!(1e300)] {
            assert!(change("n_retry", wrong.clone()).is_err(), "{wrong}");
        }
        assert!(change("template_size_px", json!(22.0)).is_err());
    }

    #[test]
    fn changes_lead_from_settings_to_others_also_back_to_a_default() {
        let settings = |changes: &[(&str, Value)]| {
            let changes = changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone()));
            Settings::default().with(&changes.collect()).unwrap()
        };
        let from = settings(&[("ncc_min", json!(0.5)), ("scale", json!(false))]);
        let to = settings(&[("ncc_min", json!(0.8))]);
        let changes = to.changes_from(&from);
        assert_eq!(
            changes,
            Changes::from([("ncc_min".to_owned(), json!(0.8)), ("scale".to_owned(), json!(true))])
        );
        assert_eq!(from.with(&changes).unwrap(), to);
        assert!(to.changes_from(&to).is_empty());
    }

    #[test]
    fn an_unknown_setting_names_itself_and_its_nearest_neighbour() {
        let message = change("ncc_mim", json!(0.5)).unwrap_err().to_string();
        assert!(message.contains("ncc_mim") && message.contains("ncc_min"), "{message}");
    }

    #[test]
    fn a_value_out_of_range_is_refused_with_the_range() {
        let message = change("template_size_px", json!(20)).unwrap_err().to_string();
        assert!(message.contains("template_size_px") && message.contains("odd"), "{message}");
    }

    #[test]
    fn what_is_counted_is_not_halved() {
        let message = change("motion_draws", json!(200.5)).unwrap_err().to_string();
        assert!(message.contains("motion_draws") && message.contains("a whole number"), "{message}");
    }

    #[test]
    fn every_default_lies_in_its_own_domain_and_names_are_unique() {
        let table = Settings::table();
        for info in &table {
            assert_eq!(info.domain.problem_with(&info.default), None, "{}", info.key);
        }
        let mut keys: Vec<_> = table.iter().map(|i| i.key.clone()).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), table.len());
    }

    #[test]
    fn a_setting_of_a_method_that_is_off_has_no_effect() {
        let without_effect = |changes: &[(&str, Value)]| {
            let changes: Changes =
                changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
            Settings::default().with(&changes).unwrap().without_effect(&changes)
        };
        let idle = without_effect(&[("sdog_ratio", json!(2.0)), ("ncc_min", json!(0.6))]);
        assert_eq!(idle, [("sdog_ratio".to_owned(), "measure = sdog".to_owned())]);
        assert!(without_effect(&[("sdog_ratio", json!(2.0)), ("measure", json!("sdog"))]).is_empty());
        // The measure has no effect with a descent, so that its parameters have none.
        let changes =
            [("sdog_ratio", json!(2.0)), ("measure", json!("sdog")), ("first_stage", json!("klt_affine"))];
        let keys: Vec<_> = without_effect(&changes).into_iter().map(|(key, _)| key).collect();
        assert_eq!(keys, ["measure", "sdog_ratio"]);
        // One of several conditions is enough.
        assert!(without_effect(&[("descent_stop_px", json!(0.1)), ("refine", json!("affine"))]).is_empty());
        let idle = without_effect(&[("descent_stop_px", json!(0.1))]);
        assert_eq!(idle[0].1, "first_stage = klt_translation or klt_affine, or refine = affine");
        assert!(without_effect(&[("height_scale_m", json!(0.1)), ("height_weight", json!(0.2))]).is_empty());
        assert_eq!(without_effect(&[("height_scale_m", json!(0.1))])[0].1, "height_weight ≠ 0.0");
        // A setting of another tracker has no effect.
        let idle = without_effect(&[("bootstrap_sets", json!(50))]);
        assert_eq!(idle[0].1, "tracker = features or combined");
        assert!(without_effect(&[("bootstrap_sets", json!(50)), ("tracker", json!("combined"))]).is_empty());
        let idle = without_effect(&[("motion_inlier_sigma", json!(2.0)), ("tracker", json!("features"))]);
        assert_eq!(idle[0].1, "tracker = features or combined, and motion_gate = mahalanobis");
    }

    #[test]
    fn every_condition_names_a_setting_and_values_that_it_can_have() {
        let table = Settings::table();
        for info in &table {
            for condition in &info.only_if {
                let other = table.iter().find(|other| other.key == condition.key);
                let other = other.unwrap_or_else(|| panic!("{}: {condition}", info.key));
                for value in &condition.values {
                    assert_eq!(other.domain.problem_with(value), None, "{}: {condition}", info.key);
                }
            }
        }
    }

    #[test]
    fn an_assignment_reads_numbers_switches_and_words() {
        assert_eq!(parse_assignment("a=1.5").unwrap().1, json!(1.5));
        assert_eq!(parse_assignment("a = true").unwrap().1, json!(true));
        assert_eq!(parse_assignment("kernel=bicubic").unwrap().1, json!("bicubic"));
        assert!(parse_assignment("nonsense").unwrap_err().to_string().contains("key=value"));
    }
}
