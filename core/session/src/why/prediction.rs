//! Explanations of the prediction (`stages/predict.rs`, `stages/point_mast.rs`).

use super::Book;
use super::node::{Draft, OriginKind};
use super::position::{of_pixel, of_point};

impl Book<'_> {
    /// The prediction in the rover frame.
    pub(super) fn of_prediction(&self, name: &str) -> Option<Draft> {
        let predict = self.trace.prediction()?;
        let stage = "predict";
        Some(match name {
            "predicted_position" => {
                let draft = Draft::numbers(
                    stage,
                    "predicted position, rover frame",
                    "m",
                    of_point(&predict.position_in_rover),
                );
                match self.prediction_px {
                    Some(_) => draft.roughly(
                        "on the line of sight of the pixel that the user chose, at the distance of dead reckoning",
                        &["displaced_to", "last_position", "pose_before", "pose"],
                    ),
                    None => draft.exactly(
                        "site_from_rover(now)⁻¹ · site_from_rover(before) · last_position",
                        &["last_position", "pose_before", "pose"],
                    ),
                }
            }
            "displaced_to" => {
                Draft::numbers(stage, "prediction placed by the user", "px", of_pixel(self.prediction_px?))
                    .from(OriginKind::Person, "displaced prediction", Some(self.trace.step))
            }
            "predicted_covariance_m2" => Draft::numbers(
                stage,
                "covariance of the prediction, rover frame",
                "m²",
                predict.covariance_in_rover.transpose().iter().copied(),
            )
            .roughly(
                "R Σ Rᵀ of the last position, plus the error of the pose change",
                &["last_position", "pose_change", "pose_change_sigma"],
            ),
            "travelled_m" => Draft::number(stage, "driven since the designation", "m", predict.travelled_m)
                .roughly("the sum of the steps' lengths", &["pose_before", "pose"]),
            "travelled_since_update_m" => Draft::number(
                stage,
                "driven since the last accepted update",
                "m",
                predict.travelled_since_update_m,
            )
            .roughly("the sum of the steps' lengths since then", &["pose_before", "pose"]),
            _ => return None,
        })
    }

    /// The prediction in the left image, and its distance.
    pub(super) fn of_projection(&self, name: &str) -> Option<Draft> {
        self.trace.prediction()?;
        Some(match name {
            "predicted_left" => Draft::numbers(
                "point_mast",
                "prediction in the left image",
                "px",
                of_pixel(self.predicted_left()?),
            )
            .roughly("the predicted position through the left camera", &["predicted_position"])
            .from(OriginKind::Camera, self.camera_name(0), Some(self.trace.step)),
            "predicted_covariance_px2" => Draft::numbers(
                "point_mast",
                "covariance of the prediction in the left image",
                "px²",
                self.trace.point_mast.predicted_covariance_px2?.transpose().iter().copied(),
            )
            .roughly(
                "J (Σ + Σ_m) Jᵀ, J = ∂pixel/∂point, Σ_m of the mast angles",
                &["predicted_covariance_m2", "predicted_left"],
            ),
            "predicted_sigma_px" => {
                let covariance = self.trace.point_mast.predicted_covariance_px2?;
                let sigma_px = covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
                Draft::number("point_mast", "1σ of the prediction along its worst direction", "px", sigma_px)
                    .exactly(
                        "√ of the largest eigenvalue of predicted_covariance_px2",
                        &["predicted_covariance_px2"],
                    )
            }
            "predicted_range_m" => Draft::number(
                "judge",
                "predicted distance from the left camera",
                "m",
                self.predicted_range_m()?,
            )
            .exactly("│predicted_position − camera_centre│", &["predicted_position", "camera_centre"]),
            _ => return None,
        })
    }
}
