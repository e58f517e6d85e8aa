//! The relation of the two images of a stereo pair, which decides how point stereo searches.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The relation of the two images of a stop, which determines the search of `point_stereo`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoGeometry {
    /// Two cameras side by side: the search interval is one of disparity (R74, R75).
    #[default]
    Lateral,
    /// Two freely placed views: the search follows the epipolar curve by range.
    Convergent,
}
