//! Why the template tracker found no target: a named reason for every step, rendered to a sentence in the record.

use sightline_vision::correlate::lucas_kanade::DescentFailure;

/// Why there is no position.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TemplateFailure {
    /// Settings contradict each other.
    #[error("{0}")]
    Settings(String),
    /// All pixels of the designated window are equal.
    #[error(
        "the window of template_size_px {size_px} around it has no contrast: choose a target with texture"
    )]
    NoContrast {
        /// Side of the window, px.
        size_px: u32,
    },
    /// The helper points of scale and roll are not visible.
    #[error("the predicted target lies behind the left camera or outside its model")]
    PredictionUnseen,
    /// The pose estimates make the template too small or too large to be compared.
    #[error(
        "the predicted target is {now_m:.1} m away and was {then_m:.1} m away when its template was taken: a template \
         is scaled by 1/{limit} to {limit}; check the poses of both stops"
    )]
    ScaleOutside {
        /// Distance from the left camera when the template was taken, m.
        then_m: f64,
        /// Predicted distance from the left camera, m.
        now_m: f64,
        /// Largest scale; its inverse is the smallest.
        limit: f64,
    },
    /// The prediction has no pixel.
    #[error("the predicted target lies behind the left camera")]
    PredictionBehind,
    /// The search window is outside the image.
    #[error(
        "the predicted target lies outside the left image: no part of search_window_px around it is in it"
    )]
    WindowOutside,
    /// The template is cut from too near the border of its image.
    #[error(
        "the template reaches over the border of the image from which it was taken: template_size_px is too large for \
         a target so near it"
    )]
    TemplateIncomplete,
    /// The part of the search window in the image is smaller than the template.
    #[error(
        "no position of search_window_px can hold the template of template_size_px: too little of the window lies in \
         the left image"
    )]
    WindowTooSmall,
    /// No position has a score.
    #[error("no valid score in the search window")]
    NoScore,
    /// The prediction is outside the image, so that no descent can start there.
    #[error("the predicted target lies outside the left image")]
    PredictionOutside,
    /// The descent found no minimum.
    #[error(transparent)]
    Descent(#[from] DescentFailure),
    /// The descent ended outside the search window.
    #[error("the descent left the search window (search_window_px)")]
    DescentLeftWindow,
    /// No template was tried.
    #[error("there is no template")]
    NoTemplate,
    /// The window of point stereo is cut by the border.
    #[error("the stereo window reaches over the border of the left image")]
    StereoWindowOutside,
    /// The left ray has no image in the right camera.
    #[error("the target's ray is not seen by the right camera")]
    RayUnseen,
    /// The searched part of the epipolar curve has no complete window.
    #[error("no window of the right image fits on the searched part of the epipolar curve")]
    NoStereoWindow,
    /// The interval of disparities has no part on the epipolar curve.
    #[error("the disparity interval lies off the epipolar curve")]
    IntervalOffCurve,
    /// The best score may belong to a point beyond the searched ranges.
    #[error("the best stereo match lies at the end of the searched ranges, at {range_m:.1} m")]
    StereoAtEnd {
        /// Range of the best match, m.
        range_m: f64,
    },
    /// The rays of both pixels do not meet.
    #[error("the two rays do not meet in front of the cameras")]
    RaysDoNotMeet,
    /// Rays within the noise do not meet.
    #[error("the position is too uncertain: rays within the pixel noise do not meet in front of the cameras")]
    TooUncertain,
}

/// Why the map of the second stage is not used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum AffineFailure {
    /// There is no image around the match.
    #[error("the match lies outside the left image")]
    Outside,
    /// The descent found no minimum.
    #[error(transparent)]
    Descent(#[from] DescentFailure),
    /// The match moved too far.
    #[error("moves the match by {shift_px:.1} px, more than refine_max_shift_px {limit_px}")]
    Moved {
        /// How far the match moved, px.
        shift_px: f64,
        /// How far it may move, px.
        limit_px: f64,
    },
    /// The area changed too much.
    #[error("changes the area by {change:.2}, more than refine_max_area_change {limit}")]
    AreaChanged {
        /// Relative change of the window's area.
        change: f64,
        /// The largest allowed one.
        limit: f64,
    },
}
