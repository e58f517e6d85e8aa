//! The visible region of each zoomable image.

use crate::drawing::view2d::View2d;

/// The visible region of each zoomable image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Views {
    /// The left image.
    pub left: View2d,
    /// The right image.
    pub right: View2d,
    /// The score map.
    pub score_map: View2d,
}

impl Default for Views {
    fn default() -> Self {
        Self { left: View2d::Fit, right: View2d::Fit, score_map: View2d::Fit }
    }
}
