//! The settings of the template locator, with unit, default and source.

pub use super::choices::{
    DisparityInterval, FirstStage, Measure, NoiseModel, Refine, RollReference, Search, StereoReference,
    TemplateUpdate, Transform, WarpModel,
};
use crate::limits::Domain;
use crate::settings_group;
use sightline_vision::correlate::Descent;
use sightline_vision::correlate::sdog::Sdog;
use sightline_vision::correlate::similarity::Similarity;
use sightline_vision::image::sample::Kernel;

/// Smallest side of a template at the coarsest level, px; a smaller one is not distinctive.
const COARSEST_MIN_PX: u32 = 5;

/// Largest number of pairs of scale and roll in a brute-force search.
const PAIRS_MAX: u64 = 2000;

settings_group! {
    /// The settings of the template locator (Kim et al. 2009).
    TemplateSettings as "template" {
        /// Side of the square template. Too small: ambiguous; too large: distorted by foreshortening and depth edges.
        template_size_px: u32 = 21, "px", Domain::OddBetween(5, 101), "Kim09 §4.1";
        /// Side of the square subframe that is displayed and sets the exposure.
        subframe_px: u32 = 161, "px", Domain::OddBetween(33, 1023), "Kim09 Fig. 3";
        /// Side of the square region in which the whole template must lie: 143 px allows shifts of ±61 px.
        search_window_px: u32 = 143, "px", Domain::OddBetween(21, 1023), "Kim09 §7.2";
        /// Growth factor of the search window per update while lost.
        lost_search_growth: f64 = 1.0, "", Domain::Between(1.0, 4.0), "ours";
        /// Scale the template by the ratio of distances.
        scale: bool = true, "", Domain::Switch, "Kim09 §4.3.1";
        /// Roll the template by the camera geometry.
        roll: bool = true, "", Domain::Switch, "Kim09 §4.3.1";
        /// Also tries the template warped by the slope of the target's surface, measured by stereo, and takes the better
        /// match; off: scaled and rolled only. Needs scale and roll on.
        surface_warp: bool = true, "", Domain::Switch, "ours";
        /// Largest deviation from a plane of the neighbours on either side of the target, as a disparity; above it the
        /// slope is not used (depth edge or curved surface).
        slope_bend_px: f64 = 1.0, "px", Domain::Between(0.0, 100.0), "ours";
        /// Warp model: first order, or the homography of the surface plane pixel by pixel.
        warp_model: WarpModel = WarpModel::Slope, "", Domain::choice(&["slope", "homography"]), "ours", if surface_warp = true;
        /// First stage of the match. Gradient descent (klt) starts from the prediction and tolerates only small errors of
        /// it.
        first_stage: FirstStage = FirstStage::Correlation, "", Domain::choice(&["correlation", "klt_translation", "klt_affine"]), "Kim09 §2";
        /// Similarity measure. Differences (sad, ssd) are sensitive to changes of illumination.
        measure: Measure = Measure::Ncc, "", Domain::choice(&["ncc", "sad", "ssd", "sdog"]), "Kim09 §4.3.2", if first_stage = "correlation";
        /// sdog: 1σ of the narrower Gaussian.
        sdog_sigma_px: f64 = 1.5, "px", Domain::Between(0.3, 10.0), "ours", if measure = "sdog";
        /// sdog: ratio of the wider σ to the narrower one.
        sdog_ratio: f64 = 1.6, "", Domain::Between(1.1, 4.0), "ours", if measure = "sdog";
        /// Search strategy in the search window.
        search: Search = Search::Exhaustive, "", Domain::choice(&["exhaustive", "coarse_to_fine"]), "Kim09 §4.3.2", if first_stage = "correlation";
        /// Coarse to fine: number of halvings of template and image.
        coarse_levels: u32 = 2, "", Domain::Between(1.0, 4.0), "ours", if search = "coarse_to_fine";
        /// Coarse to fine: number of maxima of the coarsest level that are refined.
        coarse_candidates: u32 = 5, "", Domain::Between(1.0, 100.0), "ours", if search = "coarse_to_fine";
        /// Coarse to fine: search radius around each candidate at a finer level, in pixels of that level.
        coarse_reach_px: u32 = 2, "px", Domain::Between(1.0, 10.0), "ours", if search = "coarse_to_fine";
        /// Second stage after the match: affine registration by gradient descent over gain, offset and six parameters.
        refine: Refine = Refine::None, "", Domain::choice(&["none", "affine"]), "Kim09 §2";
        /// Second stage: number of pyramid levels, including the finest.
        refine_levels: u32 = 2, "", Domain::Between(1.0, 4.0), "ours", if refine = "affine";
        /// Second stage: largest shift of the match; a larger one is rejected.
        refine_max_shift_px: f64 = 5.0, "px", Domain::Between(0.0, 100.0), "ours", if refine = "affine";
        /// Second stage: largest relative change of the window's area; a larger one is rejected.
        refine_max_area_change: f64 = 0.2, "", Domain::Between(0.0, 10.0), "ours", if refine = "affine";
        /// Gradient descent (klt and second stage): maximum number of iterations per level.
        descent_iterations: u32 = 30, "", Domain::Between(1.0, 1000.0), "ours", if first_stage = "klt_translation" | "klt_affine", if refine = "affine";
        /// Gradient descent: step length below which a level has converged.
        descent_stop_px: f64 = 0.01, "px", Domain::Between(1e-6, 1.0), "ours", if first_stage = "klt_translation" | "klt_affine", if refine = "affine";
        /// klt: number of pyramid levels, including the finest.
        klt_levels: u32 = 3, "", Domain::Between(1.0, 6.0), "ours", if first_stage = "klt_translation" | "klt_affine";
        /// Source of scale and roll: the camera geometry, or a brute-force grid search.
        transform: Transform = Transform::Geometry, "", Domain::choice(&["geometry", "search"]), "Kim09 §2";
        /// Brute force: largest scale; the smallest is its inverse.
        search_scale_max: f64 = 1.25, "", Domain::Between(1.0, 4.0), "ours", if transform = "search";
        /// Brute force: ratio of consecutive scales.
        search_scale_ratio: f64 = 1.05, "", Domain::Between(1.005, 2.0), "ours", if transform = "search";
        /// Brute force: largest roll in either direction.
        search_roll_deg: f64 = 10.0, "deg", Domain::Between(0.0, 180.0), "ours", if transform = "search";
        /// Brute force: step of the roll.
        search_roll_step_deg: f64 = 2.5, "deg", Domain::Between(0.1, 90.0), "ours", if transform = "search";
        /// Weight of the height term, which compares the relief around candidate maxima, measured by stereo; 0: off.
        height_weight: f64 = 0.0, "", Domain::Between(0.0, 1.0), "Kim09 §2; off";
        /// Height term: difference of relief at which the term is zero.
        height_scale_m: f64 = 0.05, "m", Domain::Between(0.001, 10.0), "ours", unless height_weight = 0.0;
        /// Factor on 1 − score of a match far from the prediction (see far_sigma) where it is compared with one near it; 1: off.
        far_miss_factor: f64 = 2.0, "", Domain::Between(1.0, 1000.0), "ours; docs/tracking.md", if measure = "ncc";
        /// Number of templates that are matched: the current one and those it replaced, newest first; the best score wins.
        reference_templates: u32 = 1, "", Domain::Between(1.0, 20.0), "ours";
        /// 1σ of the Gaussian window with which a match is refined; 0: uniform weights, as in the paper.
        focus_px: f64 = 4.0, "px", Domain::Between(0.0, 100.0), "ours";
        /// Condition on which an accepted update renews the template.
        template_update: TemplateUpdate = TemplateUpdate::OnCondition, "", Domain::choice(&["every_update", "on_condition", "never", "drift_corrected"]), "Kim09 §4.3.3; ours";
        /// Drift corrected: largest distance of the match of the designated window from the match of the current template.
        drift_reach_px: f64 = 3.0, "px", Domain::Between(0.0, 50.0), "ours", if template_update = "drift_corrected";
        /// Drift corrected: largest magnification of the designated window, and its inverse the smallest; beyond it too few
        /// of its pixels remain for a unique match.
        drift_scale_max: f64 = 2.0, "", Domain::Between(1.0, 100.0), "ours", if template_update = "drift_corrected";
        /// Drift corrected: lowest score of the match of the designated window.
        drift_ncc_min: f64 = 0.7, "", Domain::Between(-1.0, 1.0), "ours", if template_update = "drift_corrected";
        /// On condition: scale factor, or its inverse, at which the template is renewed.
        renew_scale: f64 = 1.3, "", Domain::Between(1.0, 100.0), "ours", if template_update = "on_condition";
        /// On condition: score below which the template is renewed.
        renew_ncc: f64 = 0.95, "", Domain::Between(-1.0, 1.0), "ours";
        /// Reference of the roll angle.
        roll_reference: RollReference = RollReference::Horizontal, "", Domain::choice(&["horizontal", "old_image"]), "Kim09 §4.3.1; option ours", if roll = true;
        /// Interpolation kernel of the template.
        kernel: Kernel = Kernel::Bicubic, "", Domain::choice(&["bilinear", "bicubic"]), "ours";
        /// Refines the match below one pixel; off: whole pixels, whose rounding errors accumulate as a random walk.
        sub_pixel: bool = true, "", Domain::Switch, "ours", if first_stage = "correlation";
        /// Largest distance of a point-stereo match from the reference (see stereo_reference).
        epipolar_tolerance_px: f64 = 2.0, "px", Domain::Between(0.0, 30.0), "Kim09 §4.4";
        /// Reference of that tolerance: the epipolar curve, or the image row.
        stereo_reference: StereoReference = StereoReference::EpipolarCurve, "", Domain::choice(&["epipolar_curve", "image_row"]), "ours";
        /// Width of the disparity interval.
        disparity_range_px: f64 = 80.0, "px", Domain::Between(2.0, 1024.0), "Kim09 §4.4";
        /// Position of the disparity interval.
        disparity_interval: DisparityInterval = DisparityInterval::Centred, "", Domain::choice(&["centred", "from_zero"]), "Kim09 §4.4, corrected";
        /// Smallest range that point stereo searches.
        range_min_m: f64 = 0.5, "m", Domain::Between(0.05, 1000.0), "ours";
        /// Largest range that point stereo searches.
        range_max_m: f64 = 200.0, "m", Domain::Between(0.1, 100_000.0), "ours";
        /// Source of the pixel noise in the covariance: measured on each match, or the papers' half pixel.
        noise_model: NoiseModel = NoiseModel::Measured, "", Domain::choice(&["measured", "half_pixel"]), "ours; half a pixel: Deans05 Eq. 4";
        /// Correlation ρ of the errors of consecutive matches (used with `noise_model = measured`).
        match_correlation: f64 = 0.4, "", Domain::Between(0.0, 0.99), "ours; ARCHITECTURE.md", if noise_model = "measured";
    }
}

impl TemplateSettings {
    /// The measure with its parameters.
    pub fn similarity(&self) -> Similarity {
        match self.measure {
            Measure::Ncc => Similarity::Ncc,
            Measure::Sad => Similarity::Sad,
            Measure::Ssd => Similarity::Ssd,
            Measure::Sdog => Similarity::Sdog(Sdog { sigma_px: self.sdog_sigma_px, ratio: self.sdog_ratio }),
        }
    }

    /// The settings of a coarse-to-fine search.
    pub fn descent(&self) -> Descent {
        Descent {
            levels: self.coarse_levels,
            candidates: self.coarse_candidates as usize,
            reach_px: self.coarse_reach_px,
        }
    }

    /// Number of scales and of rolls that a brute-force search tries to either side of the identity.
    pub fn search_steps(&self) -> [i32; 2] {
        // The margin keeps the last step of a range that is a whole number of steps.
        let count = |range: f64, step: f64| (range / step + 1e-9).floor() as i32;
        [
            count(self.search_scale_max.ln(), self.search_scale_ratio.ln()),
            count(self.search_roll_deg, self.search_roll_step_deg),
        ]
    }

    /// Number of pairs of scale and roll in that search.
    fn pairs(&self) -> u64 {
        self.search_steps().iter().map(|steps| 2 * u64::from(steps.unsigned_abs()) + 1).product()
    }

    /// Returns why these settings can find nothing, as one sentence that names the fields and the remedy.
    pub fn contradiction(&self) -> Option<String> {
        let (template, window) = (self.template_size_px, self.search_window_px);
        if template.is_multiple_of(2) || window.is_multiple_of(2) {
            return Some(format!(
                "template_size_px and search_window_px must be odd, not {template} and {window}: an even window has \
                 no middle pixel"
            ));
        }
        if template > window {
            return Some(format!(
                "template_size_px {template} is larger than search_window_px {window}, in which the whole template \
                 must lie: make the window larger or the template smaller"
            ));
        }
        let coarsest = ((template / 2) >> self.coarse_levels) * 2 + 1;
        if self.search == Search::CoarseToFine && coarsest < COARSEST_MIN_PX {
            return Some(format!(
                "coarse_levels {} leaves {coarsest} px of template_size_px {template} at the coarsest level, at least \
                 {COARSEST_MIN_PX} are needed: take fewer levels or a larger template",
                self.coarse_levels
            ));
        }
        let pairs = self.pairs();
        if self.transform == Transform::Search && pairs > PAIRS_MAX {
            return Some(format!(
                "search_scale_max, search_scale_ratio, search_roll_deg and search_roll_step_deg make {pairs} pairs of \
                 scale and roll, at most {PAIRS_MAX} are tried: narrow a range or widen a step"
            ));
        }
        if self.range_min_m >= self.range_max_m {
            return Some(format!(
                "range_min_m {} must be less than range_max_m {}",
                self.range_min_m, self.range_max_m
            ));
        }
        None
    }
}
