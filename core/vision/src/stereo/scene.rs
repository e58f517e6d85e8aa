//! Input of both methods: an aligned pair as integers, and the layout of its disparities.

use super::census::Sixteen;
use super::lanes::{LANES, Row};
use super::settings::StereoSettings;
use super::winner::rival_share;
use crate::image::GrayImage;
use sightline_geometry::cancel::Cancel;

/// An aligned pair, ready for matching.
pub(super) struct Scene<'a> {
    /// The left image, fractions of full scale.
    pub(super) image: &'a GrayImage,
    /// Columns and rows of the left image.
    pub(super) size: [usize; 2],
    /// The left image in 16 bits.
    pub(super) left: Sixteen,
    /// The right image in 16 bits, mirrored.
    pub(super) right: Sixteen,
    /// Bytes before the first pixel of a mirrored row, and after its last one.
    pub(super) margin: usize,
    /// Index of the first partner of pixel 0 in a mirrored row with its margin; for pixel x it is x less.
    pub(super) first: usize,
    /// Cells of a pixel, one per disparity: 64, 128, 256 or 512.
    pub(super) cells: usize,
    /// 0 for the requested disparities, 65535 for those that pad the last block.
    pub(super) beyond: Row<u16>,
    /// The same for the costs: 0 or 255.
    pub(super) beyond_costs: Row<u8>,
    /// Fraction by which another sum must exceed the least one, in 65536ths.
    pub(super) rival_share: u64,
    pub(super) settings: &'a StereoSettings,
    /// Once requested, the remaining rows are not matched: the result is discarded.
    pub(super) cancel: Cancel<'a>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(
        left: &'a GrayImage,
        right: &GrayImage,
        settings: &'a StereoSettings,
        cancel: Cancel<'a>,
    ) -> Self {
        let count = settings.disparity_count as usize;
        let cells = count.next_power_of_two().max(LANES);
        let first_px = settings.disparity_first_px as isize;
        let (left_width, right_width) = (left.width() as usize, right.width() as usize);
        // From the first disparity of the last left pixel to the last disparity of the first.
        let margin = (cells + first_px.unsigned_abs() + left_width.saturating_sub(right_width) + 1)
            .next_multiple_of(LANES);
        let mut beyond = Row::new(cells, 0);
        beyond.values_mut()[count..].fill(u16::MAX);
        let mut beyond_costs = Row::new(cells, 0);
        beyond_costs.values_mut()[count..].fill(u8::MAX);
        let (left_values, right_values) =
            rayon::join(|| Sixteen::of(left, false), || Sixteen::of(right, true));
        Self {
            image: left,
            size: [left_width, left.height() as usize],
            left: left_values,
            right: right_values,
            margin,
            first: (margin + right_width - 1).wrapping_add_signed(first_px),
            cells,
            beyond,
            beyond_costs,
            rival_share: rival_share(settings.uniqueness_min),
            settings,
            cancel,
        }
    }

    /// Bytes of a mirrored row including its margins.
    pub(super) fn right_stride(&self) -> usize {
        self.right.is_none(0).len().next_multiple_of(LANES) + 2 * self.margin
    }
}
