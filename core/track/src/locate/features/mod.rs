//! The feature locator: `detect` → `match_features` → `triangulate` → `fit_motion` → `bootstrap` (Deans et al. 2005, D§2).
//!
//! No feature needs to be on the target (R168): the features of the whole scene give the rigid motion between two
//! stops, and that moves the target,
//! ```text
//! x_now = T(θ*) x_then                                                                          D-Eq 3
//! (x, P_xx)_now = unscented transform of T(θ) x over (x, P_xx)_then and (θ*, P_θθ)               D-Eq 6
//! ```
//! The designation is the only measurement of the position, by point stereo (R172); after it, errors add up from
//! motion to motion (drift).
//!
//! Beyond the paper, the last good stops are remembered; the motion is measured from each of them, and the one with
//! the most certain target is used. The same memory re-acquires the target after an occlusion (R186).
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | x_then, x_now | `Carried::position_in_rover`, `Sighting::position_in_rover` | m, rover frame of either stop |
//! | θ*, T | `MotionFit::after_from_before` | m, rad |
//! | P_θθ | `Bootstrap::covariance` | m², m rad, rad² |
//! | P_xx | `Carried::covariance_in_rover` | m² |

pub mod anchor;
pub mod detect;
pub mod evidence;
pub mod failure;
pub(super) mod gates;
mod match_stereo;
pub mod motion;
pub mod rows;
pub mod settings;
mod tables;

pub use evidence::FeatureEvidence;
pub use settings::FeatureSettings;

use std::sync::Arc;

use self::anchor::{Anchor, Anchors, Carried};
use self::detect::StopFeatures;
use self::evidence::{AnchorTried, Bootstrapped, Detected, FittedMotion, MatchedFeatures};
use self::failure::FeatureFailure;
use self::motion::{Motion, MotionInput, motion};
use super::store::{self, Shared};
use super::template::TemplateTracker;
use super::tracker::{Accepted, DesignateInput, GateInput, LocateInput, Sighting, Tracker};
use crate::gate::{Gate, GateKind};
use sightline_geometry::estimate::confidence::confidence;
use sightline_geometry::estimate::motion_parameters::MotionParameters;
use sightline_geometry::frames::{Point3, Pose};

/// Number of stops whose features the store keeps: about a megabyte each.
const STOPS_KEPT: usize = 64;

/// Number of motions that the store keeps.
const MOTIONS_KEPT: usize = 256;

/// Tracks the target by the motion of the features of the whole scene (Deans et al. 2005).
#[derive(Clone, Copy, Debug)]
pub struct FeatureTracker;

impl Tracker for FeatureTracker {
    type Memory = Anchors;
    type Evidence = FeatureEvidence;

    const GATES: &'static [GateKind] = &[gates::CONFIDENCE];
    const STEPS: &'static [&'static str] =
        &["detect", "match_features", "triangulate", "fit_motion", "bootstrap"];

    fn designate(&self, input: &DesignateInput<'_>) -> (Sighting<FeatureEvidence>, Option<Anchors>) {
        let (by_template, _) = TemplateTracker.designate(input);
        let (mut found, designation) = by_template.replace(FeatureEvidence::default());
        let settings = &input.settings.features;
        let mut evidence = FeatureEvidence {
            designation: Some(Box::new(designation)),
            stop: input.shared.map(|shared| shared.stop),
            ..FeatureEvidence::default()
        };
        if let Some(missing) = settings.contradiction().map(FeatureFailure::Settings) {
            found = Sighting::nothing(missing, FeatureEvidence::default());
        } else if let Some((position, covariance)) = found.position_in_rover.zip(found.covariance_in_rover) {
            evidence.carried = Some(Carried::designated(position, covariance));
            let cameras = [input.left, input.right];
            let seen = store::shared(input.shared, settings, STOPS_KEPT, || {
                detect::detect(&input.capture.pair, cameras, settings, input.cancel)
            });
            match seen {
                Ok(seen) => note(&mut evidence, &seen),
                Err(_) => found = Sighting::nothing(FeatureFailure::Cancelled, FeatureEvidence::default()),
            }
        }
        let memory = found.position_in_rover.map(|_| {
            let anchor = anchor(&evidence, input.step, input.site_from_rover);
            anchor.map_or_else(Anchors::default, |anchor| Anchors::default().with(anchor, 1))
        });
        (Sighting { evidence, ..found }, memory)
    }

    fn locate(&self, input: &LocateInput<'_>, memory: &Anchors) -> Sighting<FeatureEvidence> {
        let settings = &input.settings.features;
        let mut evidence = FeatureEvidence::default();
        if let Some(missing) = settings.contradiction().map(FeatureFailure::Settings) {
            return Sighting::nothing(missing, evidence);
        }
        let cameras = [&input.pointing.left, &input.pointing.right];
        let seen = store::shared(input.shared, settings, STOPS_KEPT, || {
            detect::detect(&input.capture.pair, cameras, settings, input.cancel)
        });
        let Ok(now) = seen else { return Sighting::nothing(FeatureFailure::Cancelled, evidence) };
        note(&mut evidence, &now);
        let wanted = memory.newest().take_while(|_| !input.cancel.is_requested());
        let candidates: Vec<Candidate<'_>> =
            wanted.map(|anchor| Candidate::new(anchor, &now, input)).collect();
        let chosen = choose(&candidates, input.settings.limits.confidence_min);
        evidence.stop = input.shared.map(|shared| shared.stop);
        evidence.anchors = candidates.iter().enumerate().map(|(i, c)| c.tried(Some(i) == chosen)).collect();
        let found = match chosen.map(|index| &candidates[index]) {
            Some(candidate) => candidate.located(&now, input, &mut evidence),
            None => Sighting::nothing(missing(&candidates), FeatureEvidence::default()),
        };
        Sighting { evidence, ..found }
    }

    fn gates(&self, _: &FeatureEvidence, input: &GateInput<'_>) -> Vec<Gate> {
        vec![gates::confidence(input)]
    }

    fn remember(&self, memory: Anchors, evidence: &FeatureEvidence, update: &Accepted<'_>) -> Anchors {
        match anchor(evidence, update.step, update.site_from_rover) {
            Some(anchor) => memory.with(anchor, update.settings.features.feature_memory as usize),
            None => memory,
        }
    }
}

/// Returns a stop with its features and the target's position, for measuring later motions.
fn anchor(evidence: &FeatureEvidence, step: usize, site_from_rover: &Pose) -> Option<Anchor> {
    Some(Anchor {
        step,
        stop: evidence.stop,
        features: Arc::clone(evidence.features.as_ref()?),
        site_from_rover: *site_from_rover,
        carried: evidence.carried?,
    })
}

/// Returns the motion from an earlier stop of the recording to this one. The store keeps it unless it uses the pose
/// estimates, which a study may disturb.
fn kept_motion(
    shared: Option<Shared<'_>>,
    earlier: Option<usize>,
    settings: &FeatureSettings,
    find: impl FnOnce() -> Motion,
) -> Arc<Motion> {
    match (shared, earlier) {
        (Some(Shared { store, stop }), Some(earlier)) if settings.prior_radius_px <= 0.0 => {
            store.get([earlier, stop], settings, MOTIONS_KEPT, find)
        }
        _ => Arc::new(find()),
    }
}

/// Records the features of a stop in its evidence.
fn note(evidence: &mut FeatureEvidence, features: &Arc<StopFeatures>) {
    let mut ranges: Vec<f64> = features.points.iter().map(|point| point.range_m).collect();
    ranges.sort_by(f64::total_cmp);
    evidence.detect = Some(Detected {
        left: features.left.keypoints.len(),
        right: features.right.keypoints.len(),
        stereo_matches: features.points.len() + features.out_of_range,
        points: features.points.len(),
        median_range_m: ranges.get(ranges.len() / 2).copied(),
    });
    evidence.table = tables::features(features).into();
    evidence.features = Some(Arc::clone(features));
}

/// The motion from one remembered stop, and the target moved by it.
struct Candidate<'a> {
    anchor: &'a Anchor,
    motion: Arc<Motion>,
    confidence: f64,
    /// The target in the current rover frame; `None` without a motion.
    target: Option<Carried>,
}

impl<'a> Candidate<'a> {
    fn new(anchor: &'a Anchor, now: &StopFeatures, input: &LocateInput<'_>) -> Self {
        let settings = &input.settings.features;
        let expected = input.site_from_rover.inverse() * anchor.site_from_rover;
        let motion = kept_motion(input.shared, anchor.stop, settings, || {
            let (then, left) = (anchor.features.as_ref(), &input.pointing.left);
            motion(&MotionInput { then, now, expected_now_from_then: &expected, left, settings })
        });
        let target = motion
            .bootstrap
            .as_ref()
            .and_then(|bootstrap| anchor.carried.after(bootstrap, motion.by_shared_error));
        let confidence = confidence(motion.fit.inliers.len(), settings.confidence());
        Self { anchor, confidence, motion, target }
    }

    /// Largest 1σ axis of the target's position, m.
    fn sigma_m(&self) -> Option<f64> {
        let covariance = self.target.as_ref()?.covariance_in_rover();
        Some(covariance.symmetric_eigenvalues().max().max(0.0).sqrt())
    }

    fn tried(&self, chosen: bool) -> AnchorTried {
        AnchorTried {
            step: self.anchor.step,
            matches: self.motion.matches.len(),
            inliers: self.motion.fit.inliers.len(),
            confidence: self.confidence,
            sigma_m: self.sigma_m(),
            missing: self.motion.fit.missing.clone(),
            chosen,
        }
    }

    /// Locates the target by this motion and adds its steps to `evidence`.
    fn located(
        &self,
        now: &StopFeatures,
        input: &LocateInput<'_>,
        evidence: &mut FeatureEvidence,
    ) -> Sighting<FeatureEvidence> {
        let (anchor, motion, left) = (self.anchor, &self.motion, &input.pointing.left);
        evidence.match_features = Some(MatchedFeatures {
            from_step: anchor.step,
            then: anchor.features.points.len(),
            now: now.points.len(),
            matches: motion.matches.len(),
            prior_given_up: motion.prior_given_up,
        });
        tables::add_motion(evidence.table.get_or_default(), motion, &anchor.features, now, left);
        let Some(carried) = self.target else { return Sighting::default() };
        let position = carried.position_in_rover;
        evidence.carried = Some(carried);
        evidence.fit_motion = self.fitted(&position, input);
        if let Some(bootstrap) = &motion.bootstrap {
            evidence.bootstrap = Some(bootstrapped(bootstrap));
            let poses = bootstrap
                .samples
                .iter()
                .map(|theta| MotionParameters::from_vector(&(*theta).into()).to_pose());
            evidence.cloud = tables::cloud(poses, &anchor.carried.position_in_rover, left).into();
        }
        Sighting {
            left_pixel: left.project(&position),
            right_pixel: input.pointing.right.project(&position),
            position_in_rover: Some(position),
            covariance_in_rover: Some(carried.covariance_in_rover()),
            confidence: self.confidence,
            ..Sighting::default()
        }
    }

    fn fitted(&self, position: &Point3, input: &LocateInput<'_>) -> Option<FittedMotion> {
        let fit = &self.motion.fit;
        let theta = MotionParameters::from(&fit.motion()?);
        Some(FittedMotion {
            translation_m: theta.translation_m,
            roll_pitch_yaw_deg: [theta.roll_rad, theta.pitch_rad, theta.yaw_rad].map(f64::to_degrees),
            inliers: fit.inliers.len(),
            rms_m: fit.rms_m?,
            median_m: fit.median_m?,
            consensus_by_draw: fit.consensus_by_draw.clone(),
            refits: fit.refits.clone(),
            correction_m: (position - input.prediction.position_in_rover).norm(),
        })
    }
}

/// Returns the motion with the most certain target among those of sufficient confidence, or else the motion with the
/// most inliers.
fn choose(candidates: &[Candidate<'_>], confidence_min: f64) -> Option<usize> {
    let with_target = || candidates.iter().enumerate().filter(|(_, c)| c.target.is_some());
    let trusted = with_target()
        .filter(|(_, c)| c.confidence >= confidence_min)
        .filter_map(|(index, c)| Some((index, c.sigma_m()?)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let most = || with_target().max_by_key(|(index, c)| (c.motion.fit.inliers.len(), usize::MAX - index));
    trusted.map(|(index, _)| index).or_else(|| most().map(|(index, _)| index))
}

/// Returns why there is no motion.
fn missing(candidates: &[Candidate<'_>]) -> FeatureFailure {
    let why = candidates.iter().find_map(|c| Some((c.anchor.step, c.motion.fit.missing.clone()?)));
    why.map_or(FeatureFailure::NoAnchor, |(step, reason)| FeatureFailure::NoMotion { step, reason })
}

fn bootstrapped(bootstrap: &sightline_geometry::estimate::bootstrap::Bootstrap) -> Bootstrapped {
    let sigma = |i: usize| bootstrap.covariance[(i, i)].max(0.0).sqrt();
    Bootstrapped {
        sets: bootstrap.samples.len(),
        covariance: bootstrap.covariance,
        sigma_translation_m: [sigma(0), sigma(1), sigma(2)],
        sigma_rotation_deg: [sigma(3), sigma(4), sigma(5)].map(f64::to_degrees),
    }
}
