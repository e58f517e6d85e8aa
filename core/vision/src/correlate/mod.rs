//! Similarity measures of a template and an image, their score maps and peaks (K§4.3.2, R62–R69).
//!
//! ```text
//! ncc = Σ(I − Ī)(J − J̄) / sqrt(Σ(I − Ī)² Σ(J − J̄)²)                                             K-Eq 11
//! ```
//! | file | contents |
//! |---|---|
//! | `zncc` | score map of one template over a region, and the score of two patches |
//! | `surface` | a score map, and the pixel of each score |
//! | `toom_cook/` | the SIMD kernel behind `zncc`: numerators, sums of windows, scores; explained in its README |
//! | `difference` | score maps of sums of absolute or squared differences |
//! | `sdog` | score map of agreeing signs of a difference of Gaussians |
//! | `similarity` | the choice between these measures |
//! | `coarse_to_fine` | non-exhaustive search |
//! | `lucas_kanade` | gradient descent, by translation or by affine map |
//! | `peak` | the best match at sub-pixel precision, its covariance, and the second best |
//! | `focus` | refinement of a match with a Gaussian window |
//! | `pseudo` | score map of the pseudo-normalised cross-correlation |

pub mod zncc;
pub mod surface;
mod grid;
mod toom_cook;
pub mod difference;
pub mod sdog;
pub mod similarity;
pub mod peak;
pub mod pseudo;
pub mod coarse_to_fine;
pub mod lucas_kanade;
pub mod focus;

pub use crate::image::PixelRect;
pub use coarse_to_fine::{CoarseSearch, Descent, coarse_to_fine};
pub use focus::Focus;
pub use peak::{Peak, SecondPeak, find_peak, second_peak};
pub use similarity::Similarity;
pub use surface::Surface;
pub use zncc::{zncc, zncc_surface};
