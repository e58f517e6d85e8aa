//! What part of its image each panel shows.

use crate::drawing::view2d::View2d;

/// What each panel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Views {
    /// The left image.
    pub left: View2d,
    /// The right image.
    pub right: View2d,
    /// The surface of scores.
    pub surface: View2d,
}

impl Default for Views {
    fn default() -> Self {
        Self { left: View2d::Fit, right: View2d::Fit, surface: View2d::Fit }
    }
}
