//! The relation of the two images of a stereo pair, which decides how point stereo searches.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// How the two images of a stop relate, which decides how `point_stereo` searches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StereoGeometry {
    /// Two eyes side by side: the search interval is one of disparity (R74, R75).
    #[default]
    Lateral,
    /// Two freely placed views: the search walks the epipolar curve by range.
    Convergent,
}
