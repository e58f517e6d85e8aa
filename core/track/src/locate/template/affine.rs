//! The second stage: an affine map by gradient descent from the first stage's match (R221, R222).
//!
//! The sum of squared differences over six affine parameters is minimised by Gauss–Newton, coarse to fine, with gain
//! and offset estimated in each step (`correlate::lucas_kanade`): the first stage is invariant to them, and a change
//! of light between two stops would bias a second stage that is not. The window covers the same part of the scene at
//! every pyramid level.
//!
//! The map is rejected, with the reason in the record, if it moves the match by more than `refine_max_shift_px` or
//! changes the window's area by more than `refine_max_area_change`; the first stage's match is then kept.

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::failure::AffineFailure;
use super::klt::around;
use super::scale_roll::Prepared;
use super::settings::TemplateSettings;
use sightline_geometry::frames::Pixel;
use sightline_vision::correlate::lucas_kanade::{Descend, Footprint, Placed, descend};
use sightline_vision::image::GrayImage;

/// The result of the second stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AffineRefinement {
    /// Position of the match, px.
    pub pixel: Pixel,
    /// Maps offsets from the template's centre into the image, px per px.
    #[schema(value_type = Vec<f64>)]
    pub map: Matrix2<f64>,
    /// Distance from the first stage's match, px.
    pub shift_px: f64,
    /// Relative change of the window's area.
    pub area_change: f64,
    /// Number of steps, over all levels.
    pub iterations: u32,
    /// Whether the match is used.
    pub accepted: bool,
    /// Reason for the rejection, as one sentence; null if accepted.
    pub rejected: Option<String>,
}

impl AffineRefinement {
    /// The placement of the window.
    pub(super) fn placed(&self) -> Placed {
        Placed { centre: self.pixel, map: self.map, iterations: self.iterations, residual: 0.0 }
    }
}

/// Descends from the first stage's match.
pub(super) fn refine(
    prepared: &Prepared<'_>,
    start: Placed,
    image: &GrayImage,
    settings: &TemplateSettings,
) -> AffineRefinement {
    let (footprint, levels) =
        (Footprint::SameScene(settings.template_size_px), settings.refine_levels as usize);
    let wide = footprint.wide_px(levels);
    let options = Descend {
        affine: true,
        photometric: true,
        iterations: settings.descent_iterations,
        stop_px: settings.descent_stop_px,
    };
    let reach = settings.refine_max_shift_px.ceil() as u32;
    let found = around(image, start.centre, 2 * (wide + reach) + 1).ok_or(AffineFailure::Outside).and_then(
        |(part, [x, y])| {
            let (x, y) = (f64::from(x), f64::from(y));
            let here = Placed { centre: start.centre.offset(-x, -y), ..start };
            let found = descend(&prepared.window(wide), footprint, levels, &part, here, &options)?;
            Ok(Placed { centre: found.centre.offset(x, y), ..found })
        },
    );
    let (placed, failure) = match found {
        Ok(placed) => (placed, None),
        Err(missing) => (start, Some(missing)),
    };
    let shift_px = placed.centre.distance(start.centre);
    let area_change = placed.map.determinant() / start.map.determinant() - 1.0;
    let rejected = failure.or_else(|| {
        let (most_px, most) = (settings.refine_max_shift_px, settings.refine_max_area_change);
        if shift_px > most_px {
            return Some(AffineFailure::Moved { shift_px, limit_px: most_px });
        }
        (area_change.abs() > most).then_some(AffineFailure::AreaChanged { change: area_change, limit: most })
    });
    AffineRefinement {
        pixel: placed.centre,
        map: placed.map,
        shift_px,
        area_change,
        iterations: placed.iterations,
        accepted: rejected.is_none(),
        rejected: rejected.map(|failure| failure.to_string()),
    }
}
