//! The error budget of stereo and drift, before a drive (K§4.2, K-Eq 1–5, K-Tab I, R34–R47).
//!
//! ```text
//! ΔR_stereo(R) = R² Δd / (f_p B)                                   K-Eq 1
//! f_p          = f / pixel size                                    K-Eq 2
//! ΔR_no        = √( ΔR_stereo(R_0)² + (ν (R_0 − R_1))² )           K-Eq 3: driven blind, R_0 → R_1
//! ΔR_drift     = R_1 n / f_p                                       K-Eq 4: n pixels of drift
//! ΔR_trk       = √( ΔR_stereo(R_1)² + ΔR_drift² )                  K-Eq 5: tracked
//! n_min        = 0.5 R_0 / R_1                                     R40: half a pixel of the first image, seen from R_1
//! ```
//! All are 3σ values, since Δd = 1 px is taken as a 3σ value (R35). The two cameras of the paper's Table I are the
//! test bed's, not those on Mars (R42, E35). The table was computed with the maker's pixel of 4.65 µm, not with the
//! 4.69 µm derived in the text (E3); the printed 42.0 and 2.3 cm result from rounded inputs (E4), and a field of view
//! of 49° × 37° does not follow from 6 mm (E2).
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | f_p, B | `focal_px`, `baseline_m` | px, m |
//! | R_0, R_1 | `start_m`, `end_m`: distance from the left camera | m |
//! | Δd | `disparity_error_px` | px, 3σ |
//! | ν | `navigation_fraction` | – |
//! | n | `drift_px` | px |

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::camera::Camera;
use crate::frames::Pixel;

/// Instrument placement needs an error below this, m (R46).
pub const PLACEMENT_NEED_M: f64 = 0.03;

/// Pixel size of the paper's example cameras by their maker, µm; Table I was computed with it (R42, E3).
pub const MAKER_PIXEL_UM: f64 = 4.65;

/// Pixel size derived in the paper's text, 4.8 mm over 1024 pixels, µm (R42).
pub const DERIVED_PIXEL_UM: f64 = 4.6875;

/// Image size of the example cameras, px (R42).
const EXAMPLE_SIZE_PX: [f64; 2] = [1024.0, 768.0];

/// Two cameras side by side, with the parameters that the budget needs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StereoPair {
    /// Focal length, px.
    pub focal_px: f64,
    /// Distance of the two camera centres, m.
    pub baseline_m: f64,
}

/// A drive towards a target, with its error sources.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Approach {
    /// Distance at designation, m.
    pub start_m: f64,
    /// Distance at the end, m.
    pub end_m: f64,
    /// Error of a disparity, px, 3σ.
    pub disparity_error_px: f64,
    /// Error of navigation as a fraction of the distance driven.
    pub navigation_fraction: f64,
    /// Drift of the tracking, px.
    pub drift_px: f64,
}

impl Default for Approach {
    /// The paper's values: 10 m to 2 m, one pixel, 2 %, and 10 pixels of drift (R35, R37, R38, R45).
    fn default() -> Self {
        Self { start_m: 10.0, end_m: 2.0, disparity_error_px: 1.0, navigation_fraction: 0.02, drift_px: 10.0 }
    }
}

/// The budget of an approach: 3σ errors, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ErrorBudget {
    /// Error of the designation along the line of sight: K-Eq 1 at the start.
    pub designation_m: f64,
    /// Error at the end without tracking: K-Eq 3.
    pub without_tracking_m: f64,
    /// Error of stereo at the end: K-Eq 1.
    pub stereo_m: f64,
    /// Error of one pixel of drift at the end: K-Eq 4.
    pub drift_per_px_m: f64,
    /// Error at the end with tracking: K-Eq 5.
    pub with_tracking_m: f64,
    /// Drift at the end by half a pixel of the first image, px (R40): the lower bound of tracking.
    pub least_drift_px: f64,
}

impl StereoPair {
    /// A pair from its lens and its detector: K-Eq 2.
    pub fn from_lens(focal_mm: f64, pixel_um: f64, baseline_m: f64) -> Self {
        Self { focal_px: focal_mm * 1000.0 / pixel_um, baseline_m }
    }

    /// A pair of real cameras, with the effective focal length at `pixel` of the left one; `None` if the model has no
    /// ray there.
    pub fn from_cameras(left: &Camera, right: &Camera, pixel: Pixel) -> Option<Self> {
        let baseline_m = (right.model.centre() - left.model.centre()).norm();
        Some(Self { focal_px: left.model.focal_length_px(pixel)?, baseline_m })
    }

    /// Error of a stereo range, m: K-Eq 1.
    pub fn stereo_m(&self, range_m: f64, disparity_error_px: f64) -> f64 {
        range_m * range_m * disparity_error_px / (self.focal_px * self.baseline_m)
    }

    /// Error across the line of sight of a drift in the image, m: K-Eq 4.
    pub fn drift_m(&self, range_m: f64, drift_px: f64) -> f64 {
        range_m * drift_px / self.focal_px
    }

    /// Disparity of a point at `range_m`, px.
    pub fn disparity_px(&self, range_m: f64) -> f64 {
        self.focal_px * self.baseline_m / range_m
    }

    /// Field of view of a pinhole with `size_px` pixels across, rad.
    pub fn field_of_view_rad(&self, size_px: f64) -> f64 {
        2.0 * (size_px / (2.0 * self.focal_px)).atan()
    }

    /// The budget of an approach.
    pub fn budget(&self, approach: &Approach) -> ErrorBudget {
        let Approach { start_m, end_m, disparity_error_px, navigation_fraction, drift_px } = *approach;
        let designation_m = self.stereo_m(start_m, disparity_error_px);
        let stereo_m = self.stereo_m(end_m, disparity_error_px);
        let navigation_m = navigation_fraction * (start_m - end_m).abs();
        ErrorBudget {
            designation_m,
            without_tracking_m: designation_m.hypot(navigation_m),
            stereo_m,
            drift_per_px_m: self.drift_m(end_m, 1.0),
            with_tracking_m: stereo_m.hypot(self.drift_m(end_m, drift_px)),
            least_drift_px: 0.5 * start_m / end_m,
        }
    }
}

/// One camera pair of the paper's Table I with its printed values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableOneRow {
    /// The paper's name of the pair.
    pub name: &'static str,
    /// Focal length of the lens, mm.
    pub focal_mm: f64,
    /// Distance of the camera centres, m.
    pub baseline_m: f64,
    /// Printed error of the designation at 10 m, cm.
    pub printed_designation_cm: f64,
    /// Printed error at 2 m without tracking, cm.
    pub printed_without_cm: f64,
    /// Printed error of stereo at 2 m, cm.
    pub printed_stereo_cm: f64,
    /// Printed error of one pixel of drift at 2 m, cm.
    pub printed_drift_per_px_cm: f64,
    /// Error at 2 m after ten pixels of drift, in the text, cm (R45).
    pub printed_ten_px_cm: f64,
    /// Printed field of view, deg.
    pub printed_view_deg: [f64; 2],
}

/// Table I as printed (R43, R45).
pub const TABLE_ONE: [TableOneRow; 2] = [
    TableOneRow {
        name: "Pancam (test bed)",
        focal_mm: 16.0,
        baseline_m: 0.30,
        printed_designation_cm: 9.7,
        printed_without_cm: 18.7,
        printed_stereo_cm: 0.4,
        printed_drift_per_px_cm: 0.06,
        printed_ten_px_cm: 0.7,
        printed_view_deg: [17.0, 13.0],
    },
    TableOneRow {
        name: "Navcam (test bed)",
        focal_mm: 6.0,
        baseline_m: 0.20,
        printed_designation_cm: 38.8,
        printed_without_cm: 42.0,
        printed_stereo_cm: 1.6,
        printed_drift_per_px_cm: 0.16,
        printed_ten_px_cm: 2.3,
        printed_view_deg: [49.0, 37.0],
    },
];

impl TableOneRow {
    /// The pair with pixels of `pixel_um` micrometres.
    pub fn pair(&self, pixel_um: f64) -> StereoPair {
        StereoPair::from_lens(self.focal_mm, pixel_um, self.baseline_m)
    }

    /// The field of view of the pinhole with this lens, width and height, deg.
    pub fn view_deg(&self, pixel_um: f64) -> [f64; 2] {
        EXAMPLE_SIZE_PX.map(|size_px| self.pair(pixel_um).field_of_view_rad(size_px).to_degrees())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Cahv, CameraModel};
    use crate::frames::{Point3, Vector3};

    fn budget(row: usize, pixel_um: f64, drift_px: f64) -> ErrorBudget {
        TABLE_ONE[row].pair(pixel_um).budget(&Approach { drift_px, ..Approach::default() })
    }

    #[test]
    fn table_one_comes_out_as_printed_within_a_millimetre_with_the_makers_pixel() {
        for (row, printed) in TABLE_ONE.iter().enumerate() {
            let ours = budget(row, MAKER_PIXEL_UM, 10.0);
            for (ours_m, printed_cm) in [
                (ours.designation_m, printed.printed_designation_cm),
                (ours.without_tracking_m, printed.printed_without_cm),
                (ours.stereo_m, printed.printed_stereo_cm),
                (ours.with_tracking_m, printed.printed_ten_px_cm),
            ] {
                let close = (100.0 * ours_m - printed_cm).abs() <= 0.11;
                assert!(close, "{}: {ours_m} m for {printed_cm} cm", printed.name);
            }
            assert!((100.0 * ours.drift_per_px_m - printed.printed_drift_per_px_cm).abs() <= 0.006);
        }
    }

    #[test]
    fn the_recomputed_values_agree_to_their_last_digit_with_both_pixels() {
        // R44: ΔR(10 m), ΔR_no, ΔR(2 m), drift per px, ΔR_trk for 2.5 and 10 px, cm.
        let table = [
            (0, MAKER_PIXEL_UM, [9.688, 18.704, 0.3875, 0.0581, 0.414, 0.699]),
            (1, MAKER_PIXEL_UM, [38.750, 41.923, 1.5500, 0.1550, 1.598, 2.192]),
            (0, DERIVED_PIXEL_UM, [9.766, 18.745, 0.3906, 0.0586, 0.417, 0.704]),
            (1, DERIVED_PIXEL_UM, [39.062, 42.212, 1.5625, 0.1562, 1.611, 2.210]),
        ];
        for (row, pixel_um, expected) in table {
            let (least, ten) = (budget(row, pixel_um, 2.5), budget(row, pixel_um, 10.0));
            let ours = [
                ten.designation_m,
                ten.without_tracking_m,
                ten.stereo_m,
                ten.drift_per_px_m,
                least.with_tracking_m,
                ten.with_tracking_m,
            ];
            for (ours_m, expected_cm) in ours.into_iter().zip(expected) {
                assert!((100.0 * ours_m - expected_cm).abs() <= 5.1e-4, "{ours_m} m, {expected_cm} cm");
            }
            assert_eq!(ten.least_drift_px, 2.5);
        }
        let views = [(0, [16.93, 12.74]), (1, [43.29, 33.15])];
        for (row, expected) in views {
            let view = TABLE_ONE[row].view_deg(MAKER_PIXEL_UM);
            assert!((view[0] - expected[0]).abs() < 5e-3 && (view[1] - expected[1]).abs() < 5e-3, "{view:?}");
        }
    }

    #[test]
    fn golden_numbers_of_the_mer_navcam_come_out() {
        // R226.
        let navcam = StereoPair { focal_px: 1223.28, baseline_m: 0.20 };
        assert!((navcam.stereo_m(9.65, 1.0) - 0.3806).abs() < 5e-5);
        for (range_m, disparity_px) in [(2.0, 122.3), (3.05, 80.2), (4.0, 61.2), (10.0, 24.5)] {
            assert!((navcam.disparity_px(range_m) - disparity_px).abs() < 0.05);
        }
        let example = TABLE_ONE[1].pair(MAKER_PIXEL_UM);
        let approach = example.budget(&Approach::default());
        assert!((approach.designation_m - 0.3875).abs() < 5e-7);
        // R226 gives 0.419226 m; √(0.3875² + 0.16²) is 0.419233 m.
        assert!((approach.without_tracking_m - 0.419_233).abs() < 5e-7);
        assert!((approach.with_tracking_m - 0.021_920).abs() < 5e-7);
        let pancam = TABLE_ONE[0].pair(MAKER_PIXEL_UM);
        assert!((pancam.stereo_m(10.0, 1.0) - 0.096_875).abs() < 5e-7);
    }

    #[test]
    fn a_real_pair_has_the_budget_of_its_effective_focal_length() {
        // Two pinholes of 600 px, 0.2 m apart: at 5 m one pixel of disparity is 25 / 120 m.
        let eye = |y: f64| {
            let axis = Vector3::x();
            let (h, v) = (Vector3::y() * 600.0 + axis * 127.5, Vector3::z() * 600.0 + axis * 127.5);
            Camera::new(CameraModel::Cahv(Cahv::as_printed(Point3::new(0.3, y, -1.2), axis, h, v)), 256, 256)
        };
        let (left, right) = (eye(-0.1), eye(0.1));
        let pair = StereoPair::from_cameras(&left, &right, left.centre_pixel()).unwrap();
        assert!((pair.stereo_m(5.0, 1.0) - 25.0 / 120.0).abs() < 1e-6, "{pair:?}");
    }
}
