//! Explanations of the comparison with the truth (`sightline_world::target_truth`).

use super::Book;
use super::node::{Draft, OriginKind};
use super::position::{of_pixel, of_point};

impl Book<'_> {
    /// A value of the comparison with the truth.
    pub(super) fn of_truth(&self, name: &str) -> Option<Draft> {
        let truth = self.trace.truth.as_ref()?;
        let stage = "truth";
        let known =
            |draft: Draft| draft.from(OriginKind::Truth, "truth of the traverse", Some(self.trace.step));
        Some(match name {
            "true_px" => {
                known(Draft::numbers(stage, "the truth in the left image", "px", of_pixel(truth.left_pixel?)))
            }
            "true_position" => known(Draft::numbers(
                stage,
                "the true position, true rover frame",
                "m",
                of_point(&truth.position_in_rover),
            )),
            "magnification" => {
                known(Draft::number(stage, "magnification since the designation", "", truth.magnification))
            }
            "err_px" => Draft::number(stage, "error in the left image", "px", truth.err_px?)
                .exactly("│left_px − true_px│", &["left_px", "true_px"]),
            "err_m" => {
                Draft::number(stage, "error of the position in the present rover frame", "m", truth.err_m)
                    .exactly("│position − true_position│", &["position", "true_position"])
            }
            "nees" => Draft::number(stage, "squared Mahalanobis distance of the error", "", truth.nees?)
                .exactly(
                    "eᵀ Σ⁻¹ e, e = position − true_position",
                    &["position", "true_position", "position_covariance_m2"],
                ),
            "tolerance_px" => {
                Draft::number(stage, "error up to which it counts as tracked", "px", truth.tolerance_px)
                    .exactly("max(5 px, 0.5 px · magnification)", &["magnification"])
            }
            "tracked" => {
                let word = match truth.tracked {
                    Some(true) => "tracked",
                    Some(false) => "not tracked",
                    None => "the truth is hidden",
                };
                Draft::text(stage, "whether the target is tracked", word).roughly(
                    "state tracking, and err_px ≤ tolerance_px",
                    &["state", "err_px", "tolerance_px"],
                )
            }
            _ => return None,
        })
    }
}
