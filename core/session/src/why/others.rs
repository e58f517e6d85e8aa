//! Explanations of features, shape, confidence, state and error budget.

use super::Book;
use super::node::{Draft, OriginKind};
use sightline_track::locate::Evidence;
use sightline_track::target::TrackingState;

impl Book<'_> {
    /// A value of another tracker, of the state machine or of the error budget.
    pub(super) fn of_others(&self, name: &str) -> Option<Draft> {
        self.of_features(name)
            .or_else(|| self.of_detection(name))
            .or_else(|| self.of_shape(name))
            .or_else(|| self.of_state(name))
            .or_else(|| self.of_budget(name))
    }

    fn of_features(&self, name: &str) -> Option<Draft> {
        let evidence = self.trace.features()?;
        Some(match name {
            "inliers" => Draft::number(
                "fit_motion",
                "inliers of the transform",
                "",
                evidence.fit_motion.as_ref()?.inliers as f64,
            )
            .roughly(
                "largest set of inliers of one rigid transform (RANSAC) [Deans05 Eq. 2]",
                &["matches", "setting.motion_gate", "setting.motion_inlier_m", "setting.motion_draws"],
            ),
            "matches" => {
                let matched = evidence.match_features.as_ref()?;
                Draft::number("match_features", "matches with the earlier stop", "", matched.matches as f64)
                    .roughly(
                        "nearest descriptors that pass the ratio test",
                        &["points", "points_then", "setting.ratio_max"],
                    )
                    .from(
                        OriginKind::Step,
                        format!("features of step {}", matched.from_step),
                        Some(matched.from_step),
                    )
            }
            "feature_covariance" => Draft::numbers(
                "bootstrap",
                "covariance of the transform: translation (m), roll, pitch, yaw (rad)",
                "",
                evidence.bootstrap.as_ref()?.covariance.transpose().iter().copied(),
            )
            .roughly(
                "covariance of the transforms fitted to the bootstrap sets [Deans05 §2]",
                &["inliers", "setting.bootstrap_sets"],
            ),
            "feature_sigma_m" => {
                let covariance = &evidence.bootstrap.as_ref()?.covariance;
                let largest = (0..3).map(|k| covariance[(k, k)].max(0.0).sqrt()).fold(0.0, f64::max);
                Draft::number("bootstrap", "largest 1σ of the translation's coordinates", "m", largest)
                    .exactly("√ of the largest of the first three diagonal elements", &["feature_covariance"])
            }
            _ => return None,
        })
    }

    fn of_detection(&self, name: &str) -> Option<Draft> {
        let evidence = self.trace.features()?;
        let step = self.trace.step;
        Some(match name {
            "points_then" => {
                let matched = evidence.match_features.as_ref()?;
                Draft::number("detect", "triangulated features of the earlier stop", "", matched.then as f64)
                    .at_step(matched.from_step)
            }
            "points" => {
                Draft::number("detect", "triangulated features", "", evidence.detect.as_ref()?.points as f64)
                    .roughly(
                        "features matched in the right image, triangulated",
                        &["features_left", "setting.curve_tolerance_px"],
                    )
            }
            "features_left" => {
                let found = evidence.detect.as_ref()?;
                let file = self.sources.image_file(step, 0);
                Draft::number("detect", "features of the left image", "", found.left as f64)
                    .roughly("maxima of the difference of Gaussians (SIFT)", &["setting.sift_contrast_min"])
                    .from(
                        OriginKind::Image,
                        file.unwrap_or_else(|| format!("left image of stop {step}")),
                        Some(step),
                    )
            }
            _ => return None,
        })
    }

    fn of_shape(&self, name: &str) -> Option<Draft> {
        let found = self.trace.shape()?.registration.as_ref()?;
        match name {
            "shape_correction_m" => Some(
                Draft::number(
                    "refine_register",
                    "distance from the start to the registered target",
                    "m",
                    found.correction_m?,
                )
                .roughly(
                    "coarse search over all shifts, then refinement of rotation and translation",
                    &["predicted_position", "setting.shape_method"],
                )
                .from(
                    OriginKind::Step,
                    format!("view of step {}", found.to_step),
                    Some(found.to_step),
                ),
            ),
            _ => self.of_check(name),
        }
    }

    /// A value of a registration that a gate judges.
    pub(super) fn of_check(&self, name: &str) -> Option<Draft> {
        let found = self.trace.shape()?.registration.as_ref()?;
        let check = found.checks.iter().find(|check| check.name == name)?;
        let (stage, formula): (&str, &str) = match name {
            "shape_overlap" => ("refine_register", "share of the target's pixels that both surfaces cover"),
            "shape_misfit" => {
                ("refine_register", "RMS residual over its predicted σ (1 = consistent with the noise model)")
            }
            "shape_sigma_m" => ("refine_register", "1σ of the registered target in its weakest direction"),
            "shape_turn_deg" => {
                ("refine_register", "rotation between the registration and the pose estimates")
            }
            "shape_other_minimum" => (
                "coarse_register",
                "mean difference at the next minimum over that at the best one; 99 without a next one",
            ),
            "shape_edge_distance_m" => {
                ("coarse_register", "distance from the best shift to the border of the coarse search")
            }
            "picture_ncc" => (
                "refine_register",
                "score of the earlier image, draped over the surface and matched in the current one",
            ),
            _ => ("refine_register", "a number of the registration"),
        };
        Some(
            Draft::numbers(stage, name, &check.unit, check.value)
                .roughly(formula, &["shape_correction_m"])
                .from(OriginKind::Step, format!("view of step {}", found.to_step), Some(found.to_step)),
        )
    }

    fn of_state(&self, name: &str) -> Option<Draft> {
        let trace = self.trace;
        Some(match name {
            "state" => {
                let draft = Draft::text("judge", "tracking state", state_words(trace.update.state));
                let Some(verdict) = trace.verdict() else {
                    let why = trace.why_incomplete();
                    let why = why.unwrap_or_else(|| "the target was designated here".to_owned());
                    return Some(draft.roughly(&why, &["state_before"]));
                };
                let gates: Vec<String> =
                    verdict.gates.iter().map(|gate| format!("gate.{}", gate.name)).collect();
                let mut inputs = vec!["state_before"];
                inputs.extend(gates.iter().map(String::as_str));
                inputs.extend(["setting.n_retry", "setting.count_detecting_update"]);
                draft.roughly(
                    "all gates passed: tracking; otherwise lost, then failed after n_retry further bad updates; failed is final [Kim09 §4.6]",
                    &inputs,
                )
            }
            "state_before" => {
                let before = trace.verdict().map(|verdict| verdict.state_before);
                let before = before.or_else(|| Some(self.before?.update.state))?;
                Draft::text("judge", "state before this update", state_words(before)).from(
                    OriginKind::Step,
                    "state after the previous step",
                    trace.step.checked_sub(1),
                )
            }
            "confidence" => {
                let located = trace.located()?;
                let draft = Draft::number("locate", "confidence", "", located.confidence);
                let is_matched = trace.template().is_some_and(|e| e.match_template.is_some());
                let has_motion = trace.features().is_some_and(|e| e.fit_motion.is_some());
                match &located.evidence {
                    _ if trace.prediction().is_none() => draft.exactly("1: designated by the user", &[]),
                    Evidence::Template(_) if is_matched => draft.exactly("ncc, clamped to 0 … 1", &["ncc"]),
                    Evidence::Shape(evidence) | Evidence::Combined(evidence)
                        if evidence.is_judged_by_shape =>
                    {
                        draft.roughly(
                            "the share of the target's pixels that both surfaces cover",
                            &["shape_overlap"],
                        )
                    }
                    _ if has_motion => draft.exactly(
                        "1 / (1 + exp(confidence_slope · (confidence_matches − inliers)))  [Deans05 Eq. 7]",
                        &["inliers", "setting.confidence_matches", "setting.confidence_slope"],
                    ),
                    _ => draft.roughly("0: the target was not located", &["predicted_position"]),
                }
            }
            _ => return None,
        })
    }

    fn of_budget(&self, name: &str) -> Option<Draft> {
        let budget = match name {
            "budget_without_m" | "budget_with_m" => self.trace.budget()?,
            _ => return None,
        };
        let inputs = ["range_m", "initial_distance_m", "focal_px", "baseline_m"];
        Some(match name {
            "budget_without_m" => Draft::number(
                "budget",
                "the paper's error budget without tracking, 3σ",
                "m",
                budget.without_tracking_m,
            )
            .roughly(
                "root sum of squares of the stereo, navigation and pointing errors  [Kim09 Eq. 3]",
                &inputs,
            ),
            _ => Draft::number(
                "budget",
                "the paper's error budget with a drift of half a pixel of the first image, 3σ",
                "m",
                budget.with_tracking_m,
            )
            .roughly("root sum of squares of the stereo error and the drift  [Kim09 Eq. 5]", &inputs),
        })
    }
}

/// A state in words, with its count.
pub(super) fn state_words(state: TrackingState) -> String {
    match state {
        TrackingState::Lost { count } => format!("lost ({count} bad in a row)"),
        other => other.word().to_owned(),
    }
}
