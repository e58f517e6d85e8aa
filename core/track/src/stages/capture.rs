//! Stage 3, `capture`: the stereo pair of this stop and the subframe around the prediction (K§4.1 step 2, R31).
//!
//! The subframe is the part that the flight software downlinks and that sets the exposure: 161 × 161 px around the
//! prediction. In a replay the exposure is the recorded one; its mean and its saturated share in the subframe are reported.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::locate::store::HeapBytes;
use sightline_geometry::frames::Pixel;
use sightline_record::{Declaration, Record, Unit};
use sightline_vision::image::{GrayImage, PixelRect};

/// Both images of one stop.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StereoPair {
    /// The left (or first) image.
    pub left: Arc<GrayImage>,
    /// The right (or second) image.
    pub right: Arc<GrayImage>,
}

impl HeapBytes for StereoPair {
    fn heap_bytes(&self) -> usize {
        size_of_val(self.left.as_raw().as_slice()) + size_of_val(self.right.as_raw().as_slice())
    }
}

/// The stereo pair with its exposure in the subframe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Capture {
    /// Size of the left image (width, height), px.
    pub left_size: [u32; 2],
    /// Size of the right image (width, height), px.
    pub right_size: [u32; 2],
    /// The subframe around the prediction, clipped to the image; null if the prediction is outside it.
    pub subframe: Option<PixelRect>,
    /// Mean grey value in the subframe, as a fraction of full scale.
    pub subframe_mean: Option<f32>,
    /// Share of subframe pixels at full scale.
    pub subframe_saturated: Option<f32>,
    /// The images.
    #[serde(skip)]
    #[schema(ignore)]
    pub pair: StereoPair,
}

/// Describes `pair` around `centre` with a subframe of side `subframe_px`.
pub fn capture(pair: StereoPair, centre: Option<Pixel>, subframe_px: u32) -> Capture {
    let (width, height) = pair.left.dimensions();
    let subframe = centre
        .map(|pixel| PixelRect::centred(pixel, subframe_px))
        .and_then(|rect| rect.intersect(&PixelRect::whole(width, height)));
    let statistics = subframe.map(|rect| exposure_statistics(&pair.left, &rect));
    Capture {
        left_size: [width, height],
        right_size: pair.right.dimensions().into(),
        subframe,
        subframe_mean: statistics.map(|(mean, _)| mean),
        subframe_saturated: statistics.map(|(_, saturated)| saturated),
        pair,
    }
}

/// Mean, and share at full scale, of the valid pixels of `rect`.
fn exposure_statistics(image: &GrayImage, rect: &PixelRect) -> (f32, f32) {
    let (mut sum, mut saturated, mut count) = (0.0_f64, 0_u32, 0_u32);
    for y in rect.y..rect.y + rect.height as i32 {
        for x in rect.x..rect.x + rect.width as i32 {
            let value = image.get_pixel(x as u32, y as u32)[0];
            if value.is_finite() {
                sum += f64::from(value);
                saturated += u32::from(value >= 1.0);
                count += 1;
            }
        }
    }
    let count = f64::from(count.max(1));
    ((sum / count) as f32, (f64::from(saturated) / count) as f32)
}

impl Record for Capture {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("left_size", Unit::Pixel, |c| c.left_size).describe("Width and height of the left image.");
        r.quantity("right_size", Unit::Pixel, |c| c.right_size)
            .describe("Width and height of the right image.");
        r.quantity("subframe_mean", Unit::One, |c| c.subframe_mean)
            .describe("Mean grey value in the subframe, as a fraction of full scale.");
        r.quantity("subframe_saturated", Unit::One, |c| c.subframe_saturated)
            .describe("Share of the subframe's pixels at full scale.");
    }
}
