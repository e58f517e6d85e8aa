//! The limits of the gates; the tolerances of criteria 3 and 4 term by term (`stages/judge.rs`, R86, R87).
//!
//! ```text
//! tol_dist = g √( ΔR(D_old)² + ΔR(D_new)² + (f L_step)² )
//! tol_pos  = g √( ΔR(D_0)²   + ΔR(D_new)² + (f L_total)² + (0.5 D_0/f_p)² )
//! ΔR(D)    = D² Δd / (f_p B)
//! ```

use super::node::{Draft, OriginKind};
use super::{Book, words};
use sightline_track::stages::judge::Gate;

impl Book<'_> {
    /// The limit of a gate.
    pub(super) fn gate_limit(&self, name: &str) -> Option<Draft> {
        let gate = self.find_gate(name)?;
        let label = format!("limit of {name}");
        let draft = Draft::number(self.judge_of(gate), &label, &gate.unit, gate.limit);
        if let Some(of_odometry) = self.odometry_limit(gate, draft.clone()) {
            return Some(of_odometry);
        }
        Some(match name {
            "distance_correction_m" => draft.exactly(
                "tolerance_factor · √(stereo_error_old_m² + stereo_error_new_m² + navigation_step_m²)",
                &["setting.tolerance_factor", "stereo_error_old_m", "stereo_error_new_m", "navigation_step_m"],
            ),
            "position_correction_m" => draft.exactly(
                "tolerance_factor · √(stereo_error_first_m² + stereo_error_new_m² + navigation_total_m² + designation_error_m²)",
                &[
                    "setting.tolerance_factor",
                    "stereo_error_first_m",
                    "stereo_error_new_m",
                    "navigation_total_m",
                    "designation_error_m",
                ],
            ),
            "shape_edge_distance_m" => draft.roughly("half the grid of the coarse search", &[]),
            _ => self.plain_limit(gate, draft)?,
        })
    }

    /// A limit that is a setting.
    fn plain_limit(&self, gate: &Gate, draft: Draft) -> Option<Draft> {
        let setting = gate.setting.as_deref()?;
        let input = format!("setting.{setting}");
        Some(draft.exactly(&format!("the setting {setting}"), &[&input]))
    }

    /// A setting of the run.
    pub(super) fn setting(&self, key: &str) -> Option<Draft> {
        let info = sightline_track::settings::Settings::table().into_iter().find(|info| info.key == key)?;
        let value = self.settings.value(&info.group, key)?;
        let default = if value == info.default { "the default" } else { "changed" };
        let help = format!("{} ({default}; source: {})", info.help, info.source);
        let draft = match value.as_f64() {
            Some(number) => Draft::number("settings", key, &info.unit, number),
            None => {
                Draft::text("settings", key, value.as_str().map_or_else(|| value.to_string(), str::to_owned))
            }
        };
        Some(draft.roughly(&help, &[]).from(OriginKind::Setting, key, None))
    }

    /// A term of the tolerances.
    pub(super) fn of_tolerance(&self, name: &str) -> Option<Draft> {
        let (predict, limits) = (self.trace.prediction()?, &self.settings.limits);
        let last = &self.before?.update.target;
        let (focal_px, baseline_m) = (self.focal_px()?, self.baseline_m()?);
        let stereo_m =
            |distance_m: f64| distance_m * distance_m * limits.disparity_error_px / (focal_px * baseline_m);
        let stereo = |label: &str, distance_m: f64, of: &str| {
            Draft::number("judge", label, "m", stereo_m(distance_m)).exactly(
                &format!("{of}² · disparity_error_px / (focal_px · baseline_m)  [Kim09 Eq. 1]"),
                &[of, "setting.disparity_error_px", "focal_px", "baseline_m"],
            )
        };
        let fraction = limits.navigation_error_fraction;
        Some(match name {
            "stereo_error_old_m" => {
                stereo("stereo error at the last accepted distance", last.last_distance_m, "last_distance_m")
            }
            "stereo_error_first_m" => {
                stereo("stereo error at the first distance", last.initial_distance_m, "initial_distance_m")
            }
            "stereo_error_new_m" => {
                let new_m = self.range_located_m().or(self.predicted_range_m())?;
                let of =
                    if self.range_located_m().is_some() { "range_located_m" } else { "predicted_range_m" };
                stereo("stereo error at the new distance", new_m, of)
            }
            "navigation_step_m" => Draft::number(
                "judge",
                "navigation error since the last accepted update",
                "m",
                fraction * predict.travelled_since_update_m,
            )
            .exactly(
                "navigation_error_fraction · travelled_since_update_m",
                &["setting.navigation_error_fraction", "travelled_since_update_m"],
            ),
            "navigation_total_m" => Draft::number(
                "judge",
                "navigation error since the designation",
                "m",
                fraction * predict.travelled_m,
            )
            .exactly(
                "navigation_error_fraction · travelled_m",
                &["setting.navigation_error_fraction", "travelled_m"],
            ),
            "designation_error_m" => Draft::number(
                "judge",
                "drift of half a pixel of the first image, at the current range [Kim09 §4.2]",
                "m",
                0.5 * last.initial_distance_m / focal_px,
            )
            .exactly("0.5 px · initial_distance_m / focal_px", &["initial_distance_m", "focal_px"]),
            _ => return None,
        })
    }

    /// Effective focal length at the prediction, as in `judge`, px.
    pub(super) fn focal_px(&self) -> Option<f64> {
        let left = &self.trace.point_mast.left;
        let at = self.predicted_left().unwrap_or_else(|| left.centre_pixel());
        Some(left.model.focal_length_px(at).unwrap_or(self.predicted_range_m()?.max(1.0)))
    }

    /// Distance of the camera centres, m.
    pub(super) fn baseline_m(&self) -> Option<f64> {
        let pointing = &self.trace.point_mast;
        Some((pointing.right.model.centre() - pointing.left.model.centre()).norm())
    }

    /// The origin of a camera model, in words.
    pub(super) fn camera_name(&self, eye: usize) -> String {
        let word = ["left", "right"][eye.min(1)];
        let used = self.trace.point_mast.used;
        used.map_or_else(
            || format!("{word} camera of stop {}", self.trace.step),
            |angles| {
                format!(
                    "{word} camera of stop {}, mast at azimuth {}°, elevation {}°",
                    self.trace.step,
                    words::number(angles.azimuth_rad.to_degrees()),
                    words::number(angles.elevation_rad.to_degrees())
                )
            },
        )
    }
}
