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

/// Side below which a template at the coarsest level tells nothing apart, px.
const COARSEST_MIN_PX: u32 = 5;

/// Most pairs of a scale and a roll that a brute-force search tries.
const PAIRS_MAX: u64 = 2000;

settings_group! {
    /// The settings of the template locator (Kim et al. 2009).
    TemplateSettings as "template" {
        /// Side of the square template. Small: ambiguous; large: foreshortening and depth edges spoil it.
        template_size_px: u32 = 21, "px", Domain::OddBetween(5, 101), "K§4.1, R23";
        /// Side of the square subframe shown and exposed for.
        subframe_px: u32 = 161, "px", Domain::OddBetween(33, 1023), "K-Fig 3, R31";
        /// Side of the square region in which the whole template must lie: 143 searches ±61 positions.
        search_window_px: u32 = 143, "px", Domain::OddBetween(21, 1023), "K§7.2, R33, E7";
        /// Growth of the search window at each update while lost.
        lost_search_growth: f64 = 1.0, "", Domain::Between(1.0, 4.0), "ours, R92";
        /// Scale the template by the ratio of distances.
        scale: bool = true, "", Domain::Switch, "K§4.3.1, R49";
        /// Roll the template by the camera geometry.
        roll: bool = true, "", Domain::Switch, "K§4.3.1, R52";
        /// Warp the template by the slope of the target's surface, as stereo measured it, instead of scale and roll
        /// alone; where both of these are on.
        surface_warp: bool = true, "", Domain::Switch, "ours; beyond R60";
        /// A slope is believed where the neighbours on either side of the target lie within this of one plane, as a
        /// disparity; elsewhere two surfaces meet, or the surface is bent.
        slope_bend_px: f64 = 1.0, "px", Domain::Between(0.0, 100.0), "ours";
        /// How: to first order, or through the plane of the surface pixel by pixel.
        warp_model: WarpModel = WarpModel::Slope, "", Domain::choice(&["slope", "homography"]), "ours; beyond R60", if surface_warp = true;
        /// What finds the template first. Descents by gradient (klt) start from the prediction and bear only small errors of it.
        first_stage: FirstStage = FirstStage::Correlation, "", Domain::choice(&["correlation", "klt_translation", "klt_affine"]), "K§2, R217, R218";
        /// By what template and image are compared. Differences (sad, ssd) see a change of light as one of the scene.
        measure: Measure = Measure::Ncc, "", Domain::choice(&["ncc", "sad", "ssd", "sdog"]), "K§4.3.2, R216, R219", if first_stage = "correlation";
        /// Of sdog: 1σ of the narrower Gaussian.
        sdog_sigma_px: f64 = 1.5, "px", Domain::Between(0.3, 10.0), "ours, R219", if measure = "sdog";
        /// Of sdog: how much wider the other is.
        sdog_ratio: f64 = 1.6, "", Domain::Between(1.1, 4.0), "ours, R219", if measure = "sdog";
        /// Which positions of the search window are compared.
        search: Search = Search::Exhaustive, "", Domain::choice(&["exhaustive", "coarse_to_fine"]), "K§4.3.2, R63, R64", if first_stage = "correlation";
        /// Coarse to fine: how often template and image are halved.
        coarse_levels: u32 = 2, "", Domain::Between(1.0, 4.0), "ours, R65", if search = "coarse_to_fine";
        /// Coarse to fine: how many maxima of the coarsest level are followed.
        coarse_candidates: u32 = 5, "", Domain::Between(1.0, 100.0), "ours, R65", if search = "coarse_to_fine";
        /// Coarse to fine: how far each is looked for at a finer level, in pixels of that level.
        coarse_reach_px: u32 = 2, "px", Domain::Between(1.0, 10.0), "ours, R65", if search = "coarse_to_fine";
        /// Second stage after the match: an affine map by gradient descent over gain, level and six parameters.
        refine: Refine = Refine::None, "", Domain::choice(&["none", "affine"]), "K§2, R221, R222";
        /// Second stage: levels of its pyramid, the finest included.
        refine_levels: u32 = 2, "", Domain::Between(1.0, 4.0), "ours, R222", if refine = "affine";
        /// Second stage: it is rejected when it moves the match farther.
        refine_max_shift_px: f64 = 5.0, "px", Domain::Between(0.0, 100.0), "ours, R222", if refine = "affine";
        /// Second stage: it is rejected when it changes the window's area by a larger share.
        refine_max_area_change: f64 = 0.2, "", Domain::Between(0.0, 10.0), "ours, R222", if refine = "affine";
        /// Gradient descents (klt and second stage): most steps at each level.
        descent_iterations: u32 = 30, "", Domain::Between(1.0, 1000.0), "ours, R218", if first_stage = "klt_translation" | "klt_affine", if refine = "affine";
        /// Gradient descents: a step shorter than this ends a level.
        descent_stop_px: f64 = 0.01, "px", Domain::Between(1e-6, 1.0), "ours, R218", if first_stage = "klt_translation" | "klt_affine", if refine = "affine";
        /// klt: levels of the pyramid, the finest included.
        klt_levels: u32 = 3, "", Domain::Between(1.0, 6.0), "ours, R218", if first_stage = "klt_translation" | "klt_affine";
        /// Where scale and roll come from: the geometry, or a brute-force search over a grid.
        transform: Transform = Transform::Geometry, "", Domain::choice(&["geometry", "search"]), "K§2, R224";
        /// Brute force: largest scale tried; the smallest is its inverse.
        search_scale_max: f64 = 1.25, "", Domain::Between(1.0, 4.0), "ours, R224", if transform = "search";
        /// Brute force: ratio of one scale to the next.
        search_scale_ratio: f64 = 1.05, "", Domain::Between(1.005, 2.0), "ours, R224", if transform = "search";
        /// Brute force: largest roll tried, to either side.
        search_roll_deg: f64 = 10.0, "deg", Domain::Between(0.0, 180.0), "ours, R224", if transform = "search";
        /// Brute force: step of the roll.
        search_roll_step_deg: f64 = 2.5, "deg", Domain::Between(0.1, 90.0), "ours, R224", if transform = "search";
        /// Weight of the height term: how far the relief around a maximum, by stereo, decides between it and others; 0: off.
        height_weight: f64 = 0.0, "", Domain::Between(0.0, 1.0), "K§2, R220; off";
        /// Height term: difference of relief at which nothing agrees.
        height_scale_m: f64 = 0.05, "m", Domain::Between(0.001, 10.0), "ours, R220", unless height_weight = 0.0;
        /// How many appearances of the target are tried: the template, and those it replaced, newest first. The best
        /// score wins.
        reference_templates: u32 = 1, "", Domain::Between(1.0, 20.0), "ours";
        /// 1σ of the Gaussian through which a match is refined; 0: all of the window counts alike, as in the paper.
        focus_px: f64 = 4.0, "px", Domain::Between(0.0, 100.0), "ours; correlate/focus.rs";
        /// When an accepted update renews the template.
        template_update: TemplateUpdate = TemplateUpdate::OnCondition, "", Domain::choice(&["every_update", "on_condition", "never", "drift_corrected"]), "K§4.3.3, R70, R71; ours";
        /// Drift corrected: a match of the designated window farther away than this is not used.
        drift_reach_px: f64 = 3.0, "px", Domain::Between(0.0, 50.0), "ours, R71", if template_update = "drift_corrected";
        /// Drift corrected: not used once the designated window must be magnified by more, or shrunk by its inverse: few of
        /// its pixels are left in the template then, and a smooth ramp matches anywhere.
        drift_scale_max: f64 = 2.0, "", Domain::Between(1.0, 100.0), "ours, R71", if template_update = "drift_corrected";
        /// Drift corrected: one that scores less is not used.
        drift_ncc_min: f64 = 0.7, "", Domain::Between(-1.0, 1.0), "ours, R71", if template_update = "drift_corrected";
        /// On condition: renewed once it must be magnified by this, or shrunk by its inverse.
        renew_scale: f64 = 1.3, "", Domain::Between(1.0, 100.0), "ours", if template_update = "on_condition";
        /// On condition: renewed once its match scores less.
        renew_ncc: f64 = 0.95, "", Domain::Between(-1.0, 1.0), "ours";
        /// What the roll is measured against.
        roll_reference: RollReference = RollReference::Horizontal, "", Domain::choice(&["horizontal", "old_image"]), "R57", if roll = true;
        /// Interpolation kernel of the template.
        kernel: Kernel = Kernel::Bicubic, "", Domain::choice(&["bilinear", "bicubic"]), "ours, R58";
        /// Keep the match below the pixel; off shows the random walk of whole pixels.
        sub_pixel: bool = true, "", Domain::Switch, "ours, R67", if first_stage = "correlation";
        /// Tolerance across the epipolar curve.
        epipolar_tolerance_px: f64 = 2.0, "px", Domain::Between(0.0, 30.0), "K§4.4, R73";
        /// From where that tolerance is measured.
        stereo_reference: StereoReference = StereoReference::EpipolarCurve, "", Domain::choice(&["epipolar_curve", "image_row"]), "E38, R73";
        /// Width of the disparity interval.
        disparity_range_px: f64 = 80.0, "px", Domain::Between(2.0, 1024.0), "K§4.4, R74";
        /// Where the disparity interval lies.
        disparity_interval: DisparityInterval = DisparityInterval::Centred, "", Domain::choice(&["centred", "from_zero"]), "E13, R75";
        /// Nearest range searched by point stereo.
        range_min_m: f64 = 0.5, "m", Domain::Between(0.05, 1000.0), "ours";
        /// Farthest range searched by point stereo.
        range_max_m: f64 = 200.0, "m", Domain::Between(0.1, 100_000.0), "ours";
        /// Where the pixel noise of the covariance comes from.
        noise_model: NoiseModel = NoiseModel::Measured, "", Domain::choice(&["measured", "half_pixel"]), "ours; papers: R170";
        /// How alike the errors of two matches in a row are, where they are measured.
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

    /// How a coarse-to-fine search descends.
    pub fn descent(&self) -> Descent {
        Descent {
            levels: self.coarse_levels,
            candidates: self.coarse_candidates as usize,
            reach_px: self.coarse_reach_px,
        }
    }

    /// How many scales and how many rolls a brute-force search tries to either side of none.
    pub fn search_steps(&self) -> [i32; 2] {
        // A hair more, so that a range which is a whole number of steps keeps its last.
        let count = |range: f64, step: f64| (range / step + 1e-9).floor() as i32;
        [
            count(self.search_scale_max.ln(), self.search_scale_ratio.ln()),
            count(self.search_roll_deg, self.search_roll_step_deg),
        ]
    }

    /// How many pairs of a scale and a roll it tries.
    fn pairs(&self) -> u64 {
        self.search_steps().iter().map(|steps| 2 * u64::from(steps.unsigned_abs()) + 1).product()
    }

    /// Why these settings cannot find anything, as one sentence that names the fields and the way out.
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
