//! The report of the scenery study: what is written to `scenery.json` and drawn.

use crate::exposure::ExposureRow;
use crate::picture::PictureReport;
use crate::scenery::{GroundReport, RockReport};
use serde::Serialize;

/// A level of the mean–variance line, DN.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct NoiseRow {
    /// Mean over the pixels, without the bias.
    pub(super) mean_dn: f64,
    /// Variance of one pixel between exposures, DN².
    pub(super) variance_dn2: f64,
}

/// Everything that is measured.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) rocks: Vec<(f64, RockReport)>,
    pub(super) ground: GroundReport,
    pub(super) noise: Vec<NoiseRow>,
    /// Electrons per DN: stated, and as the slope of the mean–variance line gives them back.
    pub(super) gain: [f64; 2],
    pub(super) pictures: Vec<(String, PictureReport)>,
    pub(super) rock_faces: Vec<(String, PictureReport)>,
    pub(super) exposure: Vec<ExposureRow>,
}
