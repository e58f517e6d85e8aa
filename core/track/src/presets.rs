//! Named configurations of the tracker: the eight of the paper's comparison, and others (R129, R216–R225).
//!
//! A preset is a list of changes to the default settings; every other setting keeps its default. The changes back to
//! the published method are applied first, so that no default of ours enters a configuration named after the papers:
//! the presets named `ncc…` all begin with [`AS_PUBLISHED`].

use crate::settings::{Changes, Settings, TrackerKind, parse_assignment};
use sightline_geometry::error::{Error, Result};

/// A named configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// The name: words joined by hyphens.
    pub name: &'static str,
    /// One sentence on the method, with its source.
    pub description: &'static str,
    /// Changes shared with other presets, applied first.
    base: &'static [&'static str],
    /// Its own changes, as `key=value`.
    changes: &'static [&'static str],
}

/// Switches off the defaults that the paper does not have (K§4.3, K§4.4).
pub const AS_PUBLISHED: [&str; 5] = [
    "surface_warp=false",
    "focus_px=0",
    "template_update=every_update",
    "far_ncc_min=-1",
    "far_miss_factor=1",
];

const fn published(
    name: &'static str,
    description: &'static str,
    changes: &'static [&'static str],
) -> Preset {
    Preset { name, description, base: &AS_PUBLISHED, changes }
}

const fn ours(name: &'static str, description: &'static str, changes: &'static [&'static str]) -> Preset {
    Preset { name, description, base: &[], changes }
}

/// Features weighted by range, over the last three good stops.
const FEATURES: [&str; 6] = [
    "sift_contrast_min=0.015",
    "n_retry=100",
    "motion_gate=mahalanobis",
    "feature_sigma_px=0.15",
    "feature_sigma_per_scale=0.08",
    "feature_common_px=0.65",
];

/// Features as on the K9 rover (D§2).
const FEATURES_PAPER: [&str; 8] = [
    "sift_contrast_min=0.015",
    "n_retry=100",
    "stereo_along_curve=false",
    "ratio_max=1",
    "mutual_matches=false",
    "motion_weighting=none",
    "feature_memory=1",
    "noise_model=half_pixel",
];

const fn following(
    base: &'static [&'static str],
    name: &'static str,
    description: &'static str,
    changes: &'static [&'static str],
) -> Preset {
    Preset { name, description, base, changes }
}

/// Every preset, in the order in which they are listed.
pub const PRESETS: &[Preset] = &[
    ours(
        "sightline",
        "The defaults: scale, roll and surface slope, centre-weighted refinement, renewal on condition.",
        &[],
    ),
    published("ncc", "Correlation of the unchanged window [Kim09 §5.1].", &["scale=false", "roll=false"]),
    published("ncc-scale", "Correlation of the scaled window, the paper's best [Kim09 §5].", &["roll=false"]),
    published("ncc-roll", "Correlation of the rolled window.", &["scale=false"]),
    published("ncc-scale-roll", "Correlation of the scaled and rolled window, as flown [Kim09 §4.3.1].", &[]),
    published(
        "ncc-affine",
        "Correlation of the unchanged window, then the affine second stage [Kim09 §2].",
        &["scale=false", "roll=false", "refine=affine"],
    ),
    published(
        "ncc-scale-affine",
        "Correlation of the scaled window, then the affine second stage [Kim09 §2].",
        &["roll=false", "refine=affine"],
    ),
    published(
        "ncc-roll-affine",
        "Correlation of the rolled window, then the affine second stage [Kim09 §2].",
        &["scale=false", "refine=affine"],
    ),
    published(
        "ncc-scale-roll-affine",
        "Correlation of the scaled and rolled window, then the affine second stage [Kim09 §2].",
        &["refine=affine"],
    ),
    published(
        "coarse-to-fine",
        "As flown, with coarse-to-fine search over two halvings [Kim09 §4.3.2].",
        &["search=coarse_to_fine"],
    ),
    published("sad", "As flown, with the sum of absolute differences [Kim09 §2].", &["measure=sad"]),
    published("ssd", "As flown, with the sum of squared differences [Kim09 §2].", &["measure=ssd"]),
    published(
        "sdog",
        "As flown, with the sign of the difference of Gaussians, as on Marsokhod [Kim09 §2].",
        &["measure=sdog"],
    ),
    published(
        "klt-translation",
        "Pyramidal Lucas–Kanade from the prediction: translation of the unchanged window [Kim09 §2].",
        &["scale=false", "roll=false", "first_stage=klt_translation"],
    ),
    published(
        "klt-affine",
        "Pyramidal Lucas–Kanade from the prediction: affine map of the unchanged window [Kim09 §2].",
        &["scale=false", "roll=false", "first_stage=klt_affine"],
    ),
    published(
        "scale-roll-search",
        "Correlation over a brute-force grid of scales and rolls, without the camera geometry [Kim09 §2].",
        &["transform=search"],
    ),
    published(
        "drift-correction",
        "As flown, with every match corrected against the first window [Kim09 §4.3.3].",
        &["template_update=drift_corrected"],
    ),
    published(
        "integer-peak",
        "As flown, with whole-pixel peaks: shows the random walk of the rounding errors.",
        &["sub_pixel=false"],
    ),
    published(
        "never-update",
        "As flown, but the template is never renewed [Kim09 §4.3.3].",
        &["template_update=never"],
    ),
    ours("sightline-affine", "The defaults, then the affine second stage.", &["refine=affine"]),
    ours(
        "homography",
        "The defaults, with the template warped by the homography of the surface plane.",
        &["warp_model=homography"],
    ),
    ours(
        "three-templates",
        "The defaults, with the best score of the current template and the two before it.",
        &["reference_templates=3"],
    ),
    following(
        &FEATURES,
        "features",
        "The rigid transform of the whole scene from its features, weighted by range, over the last three good stops.",
        &["tracker=features"],
    ),
    following(
        &FEATURES_PAPER,
        "features-paper",
        "Features as on the K9 rover: no match constraints, 3 cm inlier gate, half a pixel of noise, one stop [Deans05 §2].",
        &["tracker=features"],
    ),
    ours(
        "shape",
        "The shape of the target's surroundings, registered to the first view at every stop [Deans05 §2].",
        &["tracker=shape"],
    ),
    following(
        &FEATURES,
        "combined",
        "Features during the drive, shape registration at the end; the target is the intersection of the first line of sight with the near surface.",
        &["tracker=combined"],
    ),
    following(
        &FEATURES_PAPER,
        "combined-paper",
        "The combined tracker as on the K9 rover: its features, simplex over absolute differences, no propagated ray, no draped image [Deans05 §2, §4].",
        &[
            "tracker=combined",
            "shape_method=simplex_l1",
            "shape_prior=false",
            "carried_ray=false",
            "hand_off_picture=false",
        ],
    ),
    ours(
        "half-pixel",
        "The defaults with the papers' half pixel of noise [Deans05 Eq. 4].",
        &["noise_model=half_pixel"],
    ),
];

impl Preset {
    /// Returns the changes, by setting.
    ///
    /// # Errors
    /// None for a preset of [`PRESETS`]; a test checks that.
    pub fn changes(&self) -> Result<Changes> {
        self.base.iter().chain(self.changes).map(|text| parse_assignment(text)).collect()
    }

    /// Returns the settings of the preset.
    ///
    /// # Errors
    /// As [`Preset::changes`].
    pub fn settings(&self) -> Result<Settings> {
        Settings::default().with(&self.changes()?)
    }
}

/// Returns the preset with this name.
///
/// # Errors
/// If the name is not listed; the message lists the known names.
pub fn preset(name: &str) -> Result<&'static Preset> {
    PRESETS.iter().find(|preset| preset.name == name).ok_or_else(|| {
        let known = PRESETS.iter().map(|preset| preset.name).collect::<Vec<_>>().join(", ");
        Error::setting("preset", format!("there is no configuration {name}; known are {known}"))
    })
}

/// The validated preset of a tracker: the configuration that the studies of docs/ recommend for it.
///
/// # Errors
/// None; a test checks every tracker.
pub fn validated(tracker: TrackerKind) -> Result<&'static Preset> {
    preset(tracker.preset())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_makes_settings_and_has_a_name_of_its_own() {
        for preset in PRESETS {
            assert!(preset.settings().is_ok(), "{}", preset.name);
            assert_eq!(
                PRESETS.iter().filter(|other| other.name == preset.name).count(),
                1,
                "{}",
                preset.name
            );
        }
        let all: Vec<Settings> = PRESETS.iter().map(|preset| preset.settings().unwrap()).collect();
        for (index, settings) in all.iter().enumerate() {
            assert!(!all[..index].contains(settings), "{} repeats another", PRESETS[index].name);
        }
    }

    #[test]
    fn the_validated_preset_of_a_tracker_uses_that_tracker() {
        for tracker in TrackerKind::ALL {
            assert_eq!(validated(tracker).unwrap().settings().unwrap().tracker, tracker);
        }
    }

    #[test]
    fn an_unknown_preset_is_refused_with_the_known_ones() {
        let message = preset("ncc-scalee").unwrap_err().to_string();
        assert!(message.contains("ncc-scalee") && message.contains("ncc-scale-roll"), "{message}");
    }
}
