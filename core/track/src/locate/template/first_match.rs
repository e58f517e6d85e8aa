//! The result of the first stage of `match_template`, shared by correlation, descent and the height term.

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::Pixel;
use sightline_vision::correlate::Surface;
use sightline_vision::correlate::coarse_to_fine::CoarseSearch;
use sightline_vision::correlate::lucas_kanade::Placed;
use sightline_vision::correlate::peak::Peak;
use sightline_vision::image::PixelRect;

/// The result of a descent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Descent {
    /// Number of steps, over all levels.
    pub iterations: u32,
    /// RMS residual after the last step, fraction of full scale.
    pub residual: f64,
    /// Maps offsets from the template's centre into the image, px per px.
    #[schema(value_type = Vec<f64>)]
    pub map: Matrix2<f64>,
}

/// A maximum that the height term compared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WeighedPeak {
    /// Its position, px.
    pub pixel: Pixel,
    /// Its score.
    pub score: f64,
    /// Agreement of its relief with the template's, 0 to 1.
    pub agreement: f64,
    /// Weighted mean of score and agreement.
    pub total: f64,
}

/// The result of the first stage.
#[derive(Clone, Debug)]
pub struct FirstMatch {
    pub(super) search_window: PixelRect,
    pub(super) positions: u64,
    pub(super) surface: Surface,
    pub(super) peak: Peak,
    pub(super) coarse: Option<CoarseSearch>,
    pub(super) descent: Option<(Descent, Placed)>,
    pub(super) weighed: Vec<WeighedPeak>,
}
