//! Explanations of position and covariance, and of the underlying geometry.

use nalgebra::Matrix3;

use super::Book;
use super::node::{Draft, OriginKind};
use super::pose_change::PoseChange;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_track::locate::Evidence;

pub(super) fn of_point(point: &Point3) -> [f64; 3] {
    [point.x, point.y, point.z]
}

pub(super) fn of_pixel(pixel: Pixel) -> [f64; 2] {
    [pixel.x, pixel.y]
}

/// Position, then the quaternion, scalar first.
fn of_pose(pose: &Pose) -> [f64; 7] {
    let (t, q) = (pose.translation.vector, pose.rotation.into_inner());
    [t.x, t.y, t.z, q.w, q.i, q.j, q.k]
}

fn sigma(covariance: &Matrix3<f64>) -> f64 {
    covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
}

impl Book<'_> {
    pub(super) fn predicted_left(&self) -> Option<Pixel> {
        self.trace.prediction()?;
        self.trace.point_mast.predicted_left
    }

    fn centre(&self) -> Point3 {
        self.trace.point_mast.left.model.centre()
    }

    /// Distance of the prediction from the left camera, m.
    pub(super) fn predicted_range_m(&self) -> Option<f64> {
        Some((self.trace.prediction()?.position_in_rover - self.centre()).norm())
    }

    fn located(&self) -> Option<Point3> {
        self.trace.located()?.position_in_rover
    }

    /// Distance of the located position from the left camera, m.
    pub(super) fn range_located_m(&self) -> Option<f64> {
        Some((self.located()? - self.centre()).norm())
    }

    /// A value of the prediction, location or update.
    pub(super) fn of_position(&self, name: &str) -> Option<Draft> {
        self.of_prediction(name)
            .or_else(|| self.of_projection(name))
            .or_else(|| self.of_pose_change(name))
            .or_else(|| self.of_geometry(name))
            .or_else(|| self.of_location(name))
            .or_else(|| self.of_correction(name))
            .or_else(|| self.of_update(name))
            .or_else(|| self.of_covariance(name))
    }

    /// The change of the estimated pose since the previous stop.
    fn pose_change(&self) -> Option<PoseChange> {
        let [before, now] =
            [self.before?.step, self.trace.step].map(|step| self.sources.site_from_rover(step));
        let measured = self.trace.odometry.as_deref();
        Some(PoseChange::between(&before, &now, &self.sources.pose_error(), measured))
    }

    fn of_pose_change(&self, name: &str) -> Option<Draft> {
        let step = self.trace.step;
        Some(match name {
            "pose_change" => {
                let label = "pose change: Δx, Δy, Δz in m, Δroll, Δpitch, Δyaw in deg; rover frame before";
                Draft::numbers("predict", label, "m, deg", self.pose_change()?.change)
                    .exactly("pose_before⁻¹ · pose", &["pose_before", "pose", "pose_change_sigma"])
            }
            "pose_change_sigma" => {
                let draft =
                    Draft::numbers("predict", "1σ of the pose change", "m, deg", self.pose_change()?.sigma);
                draft
                    .roughly(
                        "the error model of the pose estimates; of visual odometry where it corrects them",
                        &[],
                    )
                    .from(OriginKind::Pose, format!("pose estimate of stop {step}"), Some(step))
            }
            _ => return None,
        })
    }

    fn of_geometry(&self, name: &str) -> Option<Draft> {
        let step = self.trace.step;
        let last = || Some(&self.before?.update.target);
        let pose = |label: &str, of: usize| {
            Draft::numbers("predict", label, "m, quaternion", of_pose(&self.sources.site_from_rover(of)))
                .from(OriginKind::Pose, format!("pose estimate of stop {of}"), Some(of))
        };
        let left_by = |draft: Draft| {
            let before = self.before.map(|before| before.step);
            draft.from(OriginKind::Step, "pose after the previous step", before)
        };
        Some(match name {
            "pose" => pose("site_from_rover now", step),
            "pose_before" => pose("site_from_rover at the step before", self.before?.step),
            "camera_centre" => Draft::numbers(
                "point_mast",
                "centre of the left camera, rover frame",
                "m",
                of_point(&self.centre()),
            )
            .from(OriginKind::Camera, self.camera_name(0), Some(step)),
            "last_position" => left_by(Draft::numbers(
                "update",
                "position after the previous step",
                "m",
                of_point(&last()?.position_in_rover),
            )),
            "last_distance_m" => left_by(Draft::number(
                "update",
                "distance at the last accepted update",
                "m",
                last()?.last_distance_m,
            )),
            "initial_distance_m" => {
                let target = &self.trace.update.target;
                Draft::number("designate", "distance at the designation", "m", target.initial_distance_m)
                    .from(OriginKind::Step, "the designation", Some(target.designation.step))
            }
            "initial_position_in_site" => {
                let target = &self.trace.update.target;
                Draft::numbers(
                    "designate",
                    "position at the designation, site frame",
                    "m",
                    of_point(&target.initial_position_in_site),
                )
                .from(OriginKind::Step, "the designation", Some(target.designation.step))
            }
            "focal_px" => {
                Draft::number("judge", "effective focal length at the prediction", "px", self.focal_px()?)
                    .from(OriginKind::Camera, self.camera_name(0), Some(step))
            }
            "baseline_m" => Draft::number("judge", "distance of the camera centres", "m", self.baseline_m()?)
                .from(OriginKind::Camera, self.camera_name(1), Some(step)),
            _ => return None,
        })
    }

    fn of_location(&self, name: &str) -> Option<Draft> {
        let step = self.trace.step;
        Some(match name {
            "left_px" => {
                let pixel = self.trace.located()?.left_pixel?;
                let draft = Draft::numbers("locate", "the target in the left image", "px", of_pixel(pixel));
                match (self.trace.prediction().is_some(), &self.trace.located()?.evidence) {
                    (false, _) => draft.from(OriginKind::Person, "the designated pixel", Some(step)),
                    (true, Evidence::Template(_)) => {
                        draft.roughly("where the template matched", &["match_px"])
                    }
                    (true, _) => {
                        draft.roughly("the located position through the left camera", &["located_position"])
                    }
                }
            }
            "located_position" => {
                let draft = Draft::numbers(
                    "locate",
                    "located position, rover frame",
                    "m",
                    of_point(&self.located()?),
                );
                match &self.trace.located()?.evidence {
                    Evidence::Template(_) => draft.roughly(
                        "the midpoint of the shortest segment between the two rays",
                        &["left_px", "right_px", "gap_px"],
                    ),
                    Evidence::Features(_) => draft.roughly(
                        "the rigid motion of the scene applied to the position at the remembered stop",
                        &["inliers", "matches"],
                    ),
                    _ => draft.roughly(
                        "the registration of this stop's surface to the earlier view, or the features where no registration ran",
                        &["shape_correction_m", "inliers", "predicted_position"],
                    ),
                }
            }
            "range_located_m" => {
                Draft::number("judge", "located distance from the left camera", "m", self.range_located_m()?)
                    .exactly("│located_position − camera_centre│", &["located_position", "camera_centre"])
            }
            "position_in_site" => {
                let in_site = self.sources.site_from_rover(step) * self.located()?;
                Draft::numbers("judge", "located position, site frame", "m", of_point(&in_site))
                    .exactly("site_from_rover(now) · located_position", &["located_position", "pose"])
            }
            _ => return None,
        })
    }

    /// The distances between located and expected position.
    fn of_correction(&self, name: &str) -> Option<Draft> {
        Some(match name {
            "distance_correction_m" => {
                let correction = (self.range_located_m()? - self.predicted_range_m()?).abs();
                Draft::number("judge", "correction of the distance", "m", correction).exactly(
                    "│range_located_m − predicted_range_m│  [Kim09 §4.6]",
                    &["range_located_m", "predicted_range_m"],
                )
            }
            "position_correction_m" => {
                let in_site = self.sources.site_from_rover(self.trace.step) * self.located()?;
                let moved = (in_site - self.trace.update.target.initial_position_in_site).norm();
                Draft::number("judge", "correction of the position since the designation", "m", moved)
                    .exactly(
                        "│position_in_site − initial_position_in_site│  [Kim09 §4.6]",
                        &["position_in_site", "initial_position_in_site"],
                    )
            }
            "correction_m" => Draft::number(
                "update",
                "distance from the prediction to the located position",
                "m",
                self.trace.update.correction_m?,
            )
            .exactly("│located_position − predicted_position│", &["located_position", "predicted_position"]),
            "correction_px" => Draft::number(
                "update",
                "distance from the prediction to the match",
                "px",
                self.trace.update.correction_px?,
            )
            .exactly("│left_px − predicted_left│", &["left_px", "predicted_left"]),
            _ => return None,
        })
    }

    /// Whether a position was located and accepted.
    fn is_found(&self) -> bool {
        self.trace.verdict().is_none_or(|verdict| verdict.accepted)
            && self.trace.located().is_some_and(|l| l.position_in_rover.is_some())
    }

    fn of_update(&self, name: &str) -> Option<Draft> {
        let (target, stage) = (&self.trace.update.target, "update");
        Some(match name {
            "position" => {
                let draft =
                    Draft::numbers(stage, "position, rover frame", "m", of_point(&target.position_in_rover));
                if self.is_found() {
                    draft.exactly("the located position, since it was accepted", &["located_position"])
                } else {
                    draft.exactly("the prediction, since nothing was accepted", &["predicted_position"])
                }
            }
            "sigma_m" => Draft::number(
                stage,
                "largest 1σ axis of the position",
                "m",
                sigma(&target.covariance_in_rover),
            )
            .exactly("√ of the largest eigenvalue of position_covariance_m2", &["position_covariance_m2"]),
            "range_m" => Draft::number(stage, "distance from the left camera", "m", self.trace.range_m())
                .exactly("│position − camera_centre│", &["position", "camera_centre"]),
            _ => return None,
        })
    }

    fn of_covariance(&self, name: &str) -> Option<Draft> {
        let (target, stage) = (&self.trace.update.target, "update");
        Some(match name {
            "position_covariance_m2" => {
                let draft = Draft::numbers(
                    stage,
                    "covariance of the position, rover frame",
                    "m²",
                    target.covariance_in_rover.transpose().iter().copied(),
                );
                match (self.is_found(), self.trace.features().is_some()) {
                    (false, _) => draft.exactly(
                        "covariance of the prediction, since nothing was accepted",
                        &["predicted_covariance_m2"],
                    ),
                    (true, true) => draft.roughly(
                        "covariance of the earlier position moved by the transform, plus those of the transform and of the mast angles",
                        &["feature_covariance"],
                    ),
                    (true, false) => draft.roughly(
                        "the unscented transform of both pixels' covariance through the triangulation, plus the covariance from the mast angles",
                        &[
                            "left_error_px2",
                            "match_covariance_px2",
                            "left_px",
                            "right_px",
                            "setting.noise_model",
                        ],
                    ),
                }
            }
            "left_error_px2" => {
                let error = self.trace.located()?.left_error;
                Draft::numbers(
                    "locate",
                    "mean square error of the left pixel, template drift included",
                    "px²",
                    error.mean_square_px2().transpose().iter().copied(),
                )
                .roughly(
                    "the propagated drift of the template, plus the covariance and the bias of this match (estimate/drift)",
                    &["match_covariance_px2", "setting.match_correlation"],
                )
            }
            _ => return None,
        })
    }
}
