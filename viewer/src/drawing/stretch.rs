//! The mapping of grey values to brightness on the screen: as recorded, automatic, or manual.
//!
//! ```text
//! as recorded   s = v
//! automatic     s = (v − l) / (h − l)                                   l, h: 0.5 % and 99.5 % quantiles of the grey values
//! by hand       s = ( c (v − 0.5) + 0.5 + b )^(1/γ)
//! ```
//! v and s are fractions of full scale, s is clamped to 0 to 1. The images that the tracker uses are never changed.

use sightline_vision::image::GrayImage;

/// Share of pixels that the automatic stretch saturates to black, and to white.
const TAIL: f64 = 0.005;

/// Bins of the histogram from which the automatic stretch is computed.
const BINS: usize = 4096;

/// A stretch of the images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Stretch {
    /// As recorded.
    None,
    /// From the levels of the image.
    #[default]
    Auto,
    /// By hand.
    Manual {
        /// Offset, fraction of full scale.
        brightness: f32,
        /// Factor about the middle grey.
        contrast: f32,
        /// Exponent: above 1 lifts the shadows.
        gamma: f32,
    },
}

impl Stretch {
    /// The manual stretch without a change.
    pub const NEUTRAL: Self = Self::Manual { brightness: 0.0, contrast: 1.0, gamma: 1.0 };

    /// Its name in the list.
    pub const fn word(self) -> &'static str {
        match self {
            Self::None => "as recorded",
            Self::Auto => "automatic",
            Self::Manual { .. } => "by hand",
        }
    }

    /// Its text in the browser's storage.
    pub(crate) fn to_stored(self) -> String {
        match self {
            Self::None => "none".to_owned(),
            Self::Auto => "auto".to_owned(),
            Self::Manual { brightness, contrast, gamma } => format!("{brightness} {contrast} {gamma}"),
        }
    }

    /// Parses the text of `to_stored`; `None` if invalid.
    pub(crate) fn from_stored(text: &str) -> Option<Self> {
        match text {
            "none" => Some(Self::None),
            "auto" => Some(Self::Auto),
            numbers => {
                let numbers: Option<Vec<f32>> = numbers
                    .split(' ')
                    .map(|number| number.parse().ok().filter(|n: &f32| n.is_finite()))
                    .collect();
                let [brightness, contrast, gamma] = numbers?.try_into().ok()?;
                Some(Self::Manual { brightness, contrast, gamma })
            }
        }
    }

    /// Its effect on an image with these `levels`, in words.
    pub fn describe(self, levels: [f32; 2]) -> String {
        match self {
            Self::None => "as recorded: 0 is black, 1 is white".to_owned(),
            Self::Auto => {
                format!("automatic: {:.3} is black, {:.3} is white", levels[0], levels[1])
            }
            Self::Manual { brightness, contrast, gamma } => {
                format!("by hand: brightness {brightness:+.2}, contrast ×{contrast:.2}, γ {gamma:.2}")
            }
        }
    }

    /// The brightness on the screen of a grey value.
    pub fn apply(self, value: f32, levels: [f32; 2]) -> f32 {
        let raised = |v: f32, gamma: f32| v.clamp(0.0, 1.0).powf(1.0 / gamma);
        match self {
            Self::None => value,
            Self::Auto => ((value - levels[0]) / (levels[1] - levels[0]).max(1e-6)).clamp(0.0, 1.0),
            Self::Manual { brightness, contrast, gamma } => {
                raised(contrast * (value - 0.5) + 0.5 + brightness, gamma)
            }
        }
    }
}

/// The levels of an image: the grey values below and above which a share `TAIL` of its pixels lies.
pub(crate) fn levels(values: &GrayImage) -> [f32; 2] {
    let mut counts = vec![0_u32; BINS];
    let mut total = 0_u64;
    for value in values.iter().filter(|v| v.is_finite()) {
        let bin = (value.clamp(0.0, 1.0) * (BINS - 1) as f32).round() as usize;
        counts[bin] += 1;
        total += 1;
    }
    let skip = (total as f64 * TAIL) as u64;
    let low = first_beyond(&counts, 0..BINS, skip).unwrap_or(0);
    let high = first_beyond(&counts, (0..BINS).rev(), skip).unwrap_or(BINS - 1);
    [low, high].map(|bin| bin as f32 / (BINS - 1) as f32)
}

/// The first of `bins` at which the cumulative count exceeds `skip` pixels.
fn first_beyond(counts: &[u32], mut bins: impl Iterator<Item = usize>, skip: u64) -> Option<usize> {
    let mut seen = 0;
    bins.find(|&bin| {
        seen += u64::from(counts[bin]);
        seen > skip
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_automatic_stretch_takes_the_dark_end_to_black_and_the_bright_end_to_white() {
        // A ramp from 0.1 to 0.3 with one hot pixel.
        let mut image =
            GrayImage::from_fn(100, 100, |x, y| image::Luma([0.1 + 0.2 * (x + 100 * y) as f32 / 1e4]));
        image.put_pixel(50, 50, image::Luma([1.0]));
        let [low, high] = levels(&image);
        assert!((low - 0.101).abs() < 5e-4 && (high - 0.299).abs() < 5e-4, "{low} {high}");
        assert_eq!(Stretch::Auto.apply(low, [low, high]), 0.0);
        assert_eq!(Stretch::Auto.apply(high, [low, high]), 1.0);
        let middle = Stretch::Auto.apply((low + high) / 2.0, [low, high]);
        assert!((middle - 0.5).abs() < 1e-4, "{middle}");
    }

    #[test]
    fn a_stored_stretch_is_restored() {
        for stretch in
            [Stretch::None, Stretch::Auto, Stretch::Manual { brightness: -0.1, contrast: 2.5, gamma: 0.7 }]
        {
            assert_eq!(Stretch::from_stored(&stretch.to_stored()), Some(stretch));
        }
        for damaged in ["", "bright", "1 2", "1 2 NaN", "1 2 3 4"] {
            assert_eq!(Stretch::from_stored(damaged), None, "{damaged}");
        }
    }

    #[test]
    fn by_hand_nothing_changes_before_something_is_set_and_gamma_lifts_shadows() {
        for value in [0.0, 0.2, 0.9] {
            assert!((Stretch::NEUTRAL.apply(value, [0.0, 1.0]) - value).abs() < 1e-6);
        }
        let lifted = Stretch::Manual { brightness: 0.0, contrast: 1.0, gamma: 2.0 };
        assert!((lifted.apply(0.25, [0.0, 1.0]) - 0.5).abs() < 1e-6);
        assert!(Stretch::Auto.apply(f32::NAN, [0.0, 1.0]).is_nan(), "what does not exist stays so");
    }
}
