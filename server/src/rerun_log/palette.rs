//! The colours of the debugger: the palette of Okabe and Ito, distinguishable with any colour vision.
//!
//! | meaning | colour |
//! |---|---|
//! | tracking | green #009E73 |
//! | lost | orange #E69F00 |
//! | failed | vermilion #D55E00 |
//! | cleared | grey #999999 |
//! | prediction | sky #56B4E9 |
//! | measurement | blue #0072B2 |
//! | second peak | purple #CC79A7 |
//! | feature | grey #BFC4CC |
//! | inlier, outlier | as tracking, as failed |
//! | residual | yellow #F0E442 |
//! | truth | white, on a black halo |

use rerun::Color;
use sightline_track::target::TrackingState;

/// Red, green and blue.
pub(super) type Rgb = [u8; 3];

pub(super) const TRACKING: Rgb = [0x00, 0x9E, 0x73];
pub(super) const LOST: Rgb = [0xE6, 0x9F, 0x00];
pub(super) const FAILED: Rgb = [0xD5, 0x5E, 0x00];
pub(super) const CLEARED: Rgb = [0x99, 0x99, 0x99];
pub(super) const PREDICTION: Rgb = [0x56, 0xB4, 0xE9];
pub(super) const MEASUREMENT: Rgb = [0x00, 0x72, 0xB2];
pub(super) const SECOND_PEAK: Rgb = [0xCC, 0x79, 0xA7];
pub(super) const TRUTH: Rgb = [0xFF, 0xFF, 0xFF];
pub(super) const KEYPOINT: Rgb = [0xBF, 0xC4, 0xCC];
pub(super) const INLIER: Rgb = TRACKING;
pub(super) const OUTLIER: Rgb = FAILED;
pub(super) const RESIDUAL: Rgb = [0xF0, 0xE4, 0x42];
pub(super) const HALO: Rgb = [0x00, 0x00, 0x00];
pub(super) const ROVER: Rgb = [0xBB, 0xBB, 0xBB];
pub(super) const LIMIT: Rgb = [0x88, 0x88, 0x88];
pub(super) const MAP_BACKGROUND: Rgb = [0x18, 0x1A, 0x1C];

/// The colour as a rerun component, opaque.
pub(super) fn color([r, g, b]: Rgb) -> Color {
    Color::from_rgb(r, g, b)
}

/// The colour as a rerun component, with an opacity from 0 to 255.
pub(super) fn faint([r, g, b]: Rgb, opacity: u8) -> Color {
    Color::from_unmultiplied_rgba(r, g, b, opacity)
}

/// The colour of a tracking state.
pub(super) const fn of_state(state: TrackingState) -> Rgb {
    match state {
        TrackingState::Cleared => CLEARED,
        TrackingState::Tracking => TRACKING,
        TrackingState::Lost { .. } => LOST,
        TrackingState::Failed => FAILED,
    }
}

/// Nine colours at equal steps of matplotlib's viridis (van der Walt & Smith 2015).
const VIRIDIS: [Rgb; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

/// The colour of a score from −1 to 1, with the colour map and limits of the score map.
pub(super) fn of_score(score: f32) -> Rgb {
    let position = (score.clamp(-1.0, 1.0) + 1.0) / 2.0 * (VIRIDIS.len() - 1) as f32;
    let first = (position as usize).min(VIRIDIS.len() - 2);
    mix(VIRIDIS[first], VIRIDIS[first + 1], position - first as f32)
}

/// The colour of a signed value from −1 to 1: blue, white at zero, red.
pub(super) fn of_difference(value: f32) -> Rgb {
    const WHITE: Rgb = [0xF7, 0xF7, 0xF7];
    const BLUE: Rgb = [0x21, 0x66, 0xAC];
    const RED: Rgb = [0xB2, 0x18, 0x2B];
    mix(WHITE, if value < 0.0 { BLUE } else { RED }, value.abs().min(1.0))
}

fn mix(a: Rgb, b: Rgb, t: f32) -> Rgb {
    std::array::from_fn(|i| (f32::from(a[i]) + (f32::from(b[i]) - f32::from(a[i])) * t).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_run_from_the_first_to_the_last_colour_of_viridis() {
        assert_eq!(of_score(-1.0), [68, 1, 84]);
        assert_eq!(of_score(0.0), [33, 144, 141]);
        assert_eq!(of_score(1.0), [253, 231, 37]);
        assert_eq!(of_score(7.0), of_score(1.0));
    }

    #[test]
    fn differences_are_white_at_zero_blue_below_and_red_above() {
        assert_eq!(of_difference(0.0), [0xF7; 3]);
        assert!(of_difference(-0.5)[2] > of_difference(-0.5)[0]);
        assert!(of_difference(0.5)[0] > of_difference(0.5)[2]);
    }
}
