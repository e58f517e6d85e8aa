//! Normalised cross-correlation and its peaks (K§4.3.2, R62–R69).
//!
//! ```text
//! ncc = Σ(I − Ī)(J − J̄) / sqrt(Σ(I − Ī)² Σ(J − J̄)²)                                             K-Eq 11
//! ```
//! | file | what it does |
//! |---|---|
//! | `zncc` | the dense surface of scores of one template over a region, and one score of two patches |
//! | `surface` | the scores and which pixel each belongs to |
//! | `toom_cook/` | the SIMD kernel behind `zncc`: numerators, sums of windows, scores; its README explains it |
//! | `difference` | the surface of sums of absolute or squared differences |
//! | `sdog` | the surface of agreeing signs of a difference of Gaussians |
//! | `similarity` | these measures behind one name |
//! | `coarse_to_fine` | the search that does not compare every position |
//! | `lucas_kanade` | descent along the gradient, by shift or by affine map |
//! | `peak` | the best match below the pixel, its covariance, and the second best |
//! | `focus` | a match refined through a Gaussian window, which counts its centre most |

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
