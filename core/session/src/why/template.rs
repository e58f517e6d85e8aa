//! Explanations of template match and point stereo (`locate/template`).

use super::Book;
use super::node::{Draft, OriginKind};
use sightline_track::locate::Evidence;
use sightline_track::locate::template::TemplateEvidence;
use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_track::locate::template::settings::{FirstStage, Measure};
use sightline_track::target::TrackingState;
use sightline_vision::image::PixelRect;

impl<'a> Book<'a> {
    fn template(&self) -> Option<&'a TemplateEvidence> {
        match &self.trace.located()?.evidence {
            Evidence::Template(evidence) => Some(evidence),
            _ => None,
        }
    }

    fn matched(&self) -> Option<&'a TemplateMatch> {
        self.template()?.match_template.as_ref()
    }

    /// The name of an image file, or a description if it is unknown.
    fn image_name(&self, step: usize, eye: usize) -> String {
        let word = ["left", "right"][eye.min(1)];
        self.sources.image_file(step, eye).unwrap_or_else(|| format!("{word} image of stop {step}"))
    }

    fn image(&self, eye: usize) -> String {
        self.image_name(self.trace.step, eye)
    }

    /// A value of `scale_roll` or `match_template`.
    pub(super) fn of_template(&self, name: &str) -> Option<Draft> {
        self.of_scale(name).or_else(|| self.of_search(name)).or_else(|| self.of_match(name))
    }

    fn of_scale(&self, name: &str) -> Option<Draft> {
        let prepared = self.template()?.scale_roll.as_ref()?;
        let stage = "scale_roll";
        let left = || self.camera_name(0);
        Some(match name {
            "scale" => Draft::number(stage, "scale by the ratio of distances", "", prepared.scale)
                .exactly("old_distance_m / new_distance_m  [Kim09 Eq. 6]", &["old_distance_m", "new_distance_m"]),
            "roll_deg" => Draft::number(stage, "roll", "deg", prepared.roll_rad.to_degrees()).roughly(
                "angle in the new left image of a 5 cm segment that was level in the old one  [Kim09 Eq. 7–10]",
                &["setting.roll_reference", "predicted_left"],
            ),
            "old_distance_m" => {
                Draft::number(stage, "distance when the template was taken", "m", prepared.old_distance_m)
                    .roughly("│p_old − C_old│ of the template's stop", &[])
                    .from(
                        OriginKind::Step,
                        format!("position after step {}", prepared.template_step),
                        Some(prepared.template_step),
                    )
                    .at_step(prepared.template_step)
            }
            "new_distance_m" => {
                Draft::number(stage, "distance now, by dead reckoning", "m", prepared.new_distance_m)
                    .roughly("│now_from_template · p_old − C_new│", &["old_distance_m"])
                    .from(OriginKind::Camera, left(), Some(self.trace.step))
            }
            "template" => Draft::text(
                stage,
                "the compared template",
                format!("taken at step {}", prepared.template_step),
            )
            .roughly(
                if prepared.warped {
                    "the window around the target, warped by the slope of its surface"
                } else {
                    "the window around the target, scaled and rolled"
                },
                &["template_size_px", "scale", "roll_deg"],
            )
            .from(
                OriginKind::Image,
                self.image_name(prepared.template_step, 0),
                Some(prepared.template_step),
            ),
            _ => return None,
        })
    }

    fn of_search(&self, name: &str) -> Option<Draft> {
        let stage = "match_template";
        let own = &self.settings.template;
        let rect = |r: PixelRect| [f64::from(r.x), f64::from(r.y), f64::from(r.width), f64::from(r.height)];
        Some(match name {
            "template_size_px" => {
                self.template()?.scale_roll.as_ref()?;
                Draft::number(stage, "side of the template", "px", f64::from(own.template_size_px))
                    .exactly("the setting template_size_px", &["setting.template_size_px"])
            }
            "search_window_px" => {
                self.template()?.scale_roll.as_ref()?;
                let growth = own.lost_search_growth.powi(self.lost_count()? as i32);
                let side = (f64::from(own.search_window_px) * growth).round() as u32 | 1;
                Draft::number(stage, "side of the search window", "px", f64::from(side)).exactly(
                    "search_window_px · lost_search_growth ^ lost_count, rounded, made odd",
                    &["setting.search_window_px", "setting.lost_search_growth", "lost_count"],
                )
            }
            "lost_count" => {
                Draft::number("judge", "bad updates in a row before", "", f64::from(self.lost_count()?)).from(
                    OriginKind::Step,
                    "state after the previous step",
                    self.trace.step.checked_sub(1),
                )
            }
            "search_window" => {
                let window = self.matched()?.search_window;
                Draft::numbers(stage, "search window: column, row, width, height", "px", rect(window))
                    .roughly(
                        "the square of search_window_px about the prediction, cut to the image",
                        &["search_window_px", "predicted_left"],
                    )
            }
            "peak" => {
                let [x, y] = self.matched()?.peak.integer.map(f64::from);
                Draft::numbers(stage, "whole pixel with the best score", "px", [x, y])
                    .roughly(
                        "the highest score of all positions in the search window",
                        &["search_window", "template"],
                    )
                    .from(OriginKind::Image, self.image(0), Some(self.trace.step))
            }
            "edge_distance_px" => {
                let matched = self.matched().filter(|matched| matched.descent.is_none())?;
                Draft::number(
                    stage,
                    "distance of the peak from the border of the compared positions",
                    "px",
                    edge_distance_px(matched, own.template_size_px),
                )
                .exactly(
                    "the least of peak − first position and last position − peak, in columns and rows; positions lie half a template inside the window",
                    &["peak", "search_window", "template_size_px"],
                )
            }
            _ => return None,
        })
    }

    fn of_match(&self, name: &str) -> Option<Draft> {
        let (matched, own) = (self.matched()?, &self.settings.template);
        let stage = "match_template";
        let from_image = |draft: Draft| draft.from(OriginKind::Image, self.image(0), Some(self.trace.step));
        let is_peak = own.first_stage == FirstStage::Correlation
            && own.measure == Measure::Ncc
            && matched.affine.as_ref().is_none_or(|affine| !affine.accepted);
        Some(match name {
            "ncc" if is_peak => Draft::number(stage, "match score", "", matched.score)
                .exactly("the score of the peak", &["peak_score", "match_px", "template"]),
            "ncc" => from_image(Draft::number(stage, "match score", "", matched.score).roughly(
                "normalised correlation of the template and the image's window at match_px",
                &["match_px", "template"],
            )),
            "peak_score" => from_image(
                Draft::number(stage, "score at the peak", "", matched.peak.score).roughly(
                    "Σ (T − T̄)(I − Ī) / √(Σ (T − T̄)² Σ (I − Ī)²), refined to sub-pixel by a quadratic fit [Kim09 §4.3.2]",
                    &["peak", "template", "setting.sub_pixel"],
                ),
            ),
            "match_px" => from_image(
                Draft::numbers(stage, "where the template matched", "px", [matched.pixel.x, matched.pixel.y]).roughly(
                    "the peak, refined to the nearest maximum of the centre-weighted score",
                    &["peak", "setting.focus_px", "setting.refine"],
                ),
            ),
            "second_peak_score" => {
                let second = matched.second_peak.as_ref()?;
                from_image(Draft::number(stage, "score of the second peak", "", second.score).roughly(
                    "the highest local maximum at least half a template from the match",
                    &["search_window", "template_size_px"],
                ))
            }
            "second_peak_ratio" => {
                let ratio = matched.second_peak.as_ref().map_or(0.0, |second| second.ratio);
                Draft::number(stage, "second peak over the best", "", ratio)
                    .roughly("second_peak_score / best whole-pixel score; 0 without one", &["second_peak_score", "peak"])
            }
            "match_covariance_px2" => Draft::numbers(
                stage,
                "covariance of this match alone",
                "px²",
                matched.covariance_px2.transpose().iter().copied(),
            )
            .roughly("n/(n − 4) A⁻¹ B A⁻¹ of the residual and its gradients, plus the floor of the fit (match_noise)", &["match_px", "template"]),
            "match_sigma_px" => {
                let sigma_px = matched.covariance_px2.symmetric_eigenvalues().max().max(0.0).sqrt();
                Draft::number(stage, "1σ of the match along its worst direction", "px", sigma_px)
                    .exactly("√ of the largest eigenvalue of match_covariance_px2", &["match_covariance_px2"])
            }
            "innovation_sigma" => {
                let (predicted, covariance) = (self.predicted_left()?, self.trace.point_mast.predicted_covariance_px2?);
                let away = nalgebra::Vector2::new(matched.pixel.x - predicted.x, matched.pixel.y - predicted.y);
                let inverse = (covariance + matched.covariance_px2).try_inverse()?;
                Draft::number("judge", "distance from the prediction to the match, in standard deviations of both", "σ", away.dot(&(inverse * away)).max(0.0).sqrt())
                    .exactly("√(νᵀ (Σ_predicted + Σ_match)⁻¹ ν), ν = match_px − predicted_left", &["match_px", "predicted_left", "predicted_covariance_px2", "match_covariance_px2"])
            }
            _ => return None,
        })
    }

    /// A value of `point_stereo`.
    pub(super) fn of_stereo(&self, name: &str) -> Option<Draft> {
        let evidence = self.trace.template()?;
        let stereo = evidence.point_stereo.as_ref()?;
        let stage = "point_stereo";
        let from_image = |draft: Draft| draft.from(OriginKind::Image, self.image(1), Some(self.trace.step));
        Some(match name {
            "stereo_score" => from_image(Draft::number(stage, "stereo score", "", stereo.score).roughly(
                "the best normalised correlation of the left window along the epipolar curve [Kim09 §4.4]",
                &["left_px", "right_px", "setting.epipolar_tolerance_px", "setting.disparity_range_px"],
            )),
            "right_px" => from_image(
                Draft::numbers(
                    stage,
                    "the point in the right image",
                    "px",
                    [stereo.right_pixel.x, stereo.right_pixel.y],
                )
                .roughly(
                    "the best position along and across the epipolar curve of left_px, followed in focus",
                    &["left_px", "predicted_range_m"],
                ),
            ),
            "disparity_px" => Draft::number(stage, "disparity", "px", stereo.disparity_px?).roughly(
                "distance along the epipolar curve from the image of a point at infinity",
                &["right_px", "left_px"],
            ),
            "left_right_px" => Draft::number(
                stage,
                "distance between the left pixel and the match of the right one in the left image",
                "px",
                stereo.left_right_px?,
            )
            .roughly("the right pixel, matched back in the left image", &["left_px", "right_px"]),
            "gap_px" => Draft::number(
                "triangulate",
                "smallest distance between the two rays",
                "px",
                evidence.triangulate.as_ref()?.gap_px,
            )
            .roughly(
                "length of the shortest segment between the rays · focal length / range",
                &["left_px", "right_px"],
            ),
            _ => return None,
        })
    }

    fn lost_count(&self) -> Option<u32> {
        Some(match self.trace.verdict()?.state_before {
            TrackingState::Lost { count } => count,
            _ => 0,
        })
    }
}

/// Distance from the best whole pixel to the edge of the compared positions, px: as `TemplateMatch::edge_distance_px`, from
/// the recorded numbers alone.
pub(super) fn edge_distance_px(matched: &TemplateMatch, template_size_px: u32) -> f64 {
    let (window, half) = (matched.search_window, (template_size_px / 2) as i32);
    let along = |peak: i32, start: i32, length: u32| {
        let (first, last) = (start + half, start + length as i32 - 1 - half);
        (peak - first).min(last - peak)
    };
    let [x, y] = matched.peak.integer;
    f64::from(along(x, window.x, window.width).min(along(y, window.y, window.height)))
}
