//! Dense stereo: a depth for every pixel of the left image that has a partner in the right one (R187, D§2).
//!
//! ```text
//! two images, two cameras ─► align ─► census ─► block_matching │ semi_global ─► checks ─► ranges ─► points
//! ```
//! | file | contents |
//! |---|---|
//! | `align` | two linear cameras whose rows agree, and the images resampled to them |
//! | `census` | the surroundings of a pixel in bits, and the number of differing bits: the cost of a disparity |
//! | `scene` | input of both methods |
//! | `block_matching` | sums of costs over a window |
//! | `semi_global` | sums of costs along paths |
//! | `winner`, `row` | the cheapest disparity of the left and of the right pixels |
//! | `subpixel` | the fraction of a disparity |
//! | `texture`, `checks`, `speckle` | pixels without a disparity, and the reason |
//! | `ranges` | points from the true cameras |
//! | `lanes` | portable vectors |
//!
//! | symbol | our name | unit |
//! |---|---|---|
//! | d = x_L − x_R | [`DisparityMap::disparity_px`] | px of the aligned images |
//! | – | [`DenseStereo::points_m`] | m, in the frame of the cameras |
//!
//! A pixel without a disparity is NaN, and its [`Outcome`] is the reason; holes are not filled. Sums are integers: the
//! same images give the same bits on every processor and any number of threads.
//!
//! Sources: domain.md 3.3 and 7 (JPL's stereo); Hirschmüller 2008. docs/stereo.md lists its accuracy.

mod lanes;
pub mod settings;
pub mod align;
mod census;
mod scene;
mod winner;
mod row;
mod block_matching;
mod semi_global;
mod subpixel;
mod texture;
mod checks;
mod speckle;
mod ranges;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod vector_tests;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::image::GrayImage;
use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Point3;

pub use align::{AlignSettings, Alignment, Plane};
pub use settings::{StereoMethod, StereoPaths, StereoSettings};

use row::RowResult;
use scene::Scene;

/// Result of matching a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[repr(u8)]
#[schema(as = StereoOutcome)]
pub enum Outcome {
    /// A disparity was found.
    #[default]
    Found,
    /// The pixel or its partner is outside its image or invalid.
    Outside,
    /// The surroundings have too little gradient along the row.
    NoTexture,
    /// Another disparity is nearly as good.
    NotUnique,
    /// The left-right check failed: the partner's best match is another pixel.
    LeftRight,
    /// The patch of the pixel is too small.
    Speckle,
    /// The rays do not intersect in front of the cameras, or the point is too far away.
    OutOfRange,
}

/// The disparities of an aligned left image.
#[derive(Clone, Debug, PartialEq)]
pub struct DisparityMap {
    /// Columns of the image.
    pub width: u32,
    /// Rows of the image.
    pub height: u32,
    /// x_L − x_R, px, row by row; NaN without a disparity.
    pub disparity_px: Vec<f32>,
    /// Result of every pixel.
    pub outcome: Vec<Outcome>,
}

impl DisparityMap {
    /// Number of pixels with an outcome.
    pub fn count(&self, outcome: Outcome) -> usize {
        self.outcome.iter().filter(|found| **found == outcome).count()
    }

    /// Disparity of a pixel, px; `None` if it has none.
    pub fn at(&self, x: u32, y: u32) -> Option<f32> {
        let disparity = *self.disparity_px.get((y * self.width + x) as usize).filter(|_| x < self.width)?;
        disparity.is_finite().then_some(disparity)
    }
}

/// Images, disparities and points of dense stereo.
#[derive(Clone, Debug)]
pub struct DenseStereo {
    /// The aligned cameras.
    pub alignment: Alignment,
    /// The images resampled to the aligned cameras.
    pub images: [GrayImage; 2],
    /// The disparities of the aligned left image.
    pub disparities: DisparityMap,
    /// Point of each pixel of the aligned left image, m, in the frame of the cameras; NaN without a disparity.
    pub points_m: Vec<[f32; 3]>,
}

impl DenseStereo {
    /// Point of a pixel of the aligned left image, m, in the frame of the cameras; `None` without a disparity.
    pub fn point(&self, x: u32, y: u32) -> Option<Point3> {
        let map = &self.disparities;
        let point = self.points_m.get((y * map.width + x) as usize).filter(|_| x < map.width)?;
        point[0].is_finite().then(|| Point3::from(point.map(f64::from)))
    }
}

/// Aligns a pair, matches it, and triangulates its points with the true cameras, which must be in one frame.
///
/// # Errors
/// [`Error::Setting`] for an invalid setting; [`Error::Request`] for a pair that cannot be aligned, or images whose size
/// differs from their cameras'.
pub fn dense_stereo(
    [left, right]: [&GrayImage; 2],
    cameras: [&Camera; 2],
    settings: &StereoSettings,
) -> Result<DenseStereo> {
    dense_stereo_until([left, right], cameras, settings, Cancel::default())
}

/// As [`dense_stereo_until`], for a scene near a plane such as the ground, in the frame of the cameras: the pair is
/// aligned about the plane, and disparities are relative to it ([`Alignment::about`]).
///
/// # Errors
/// As [`dense_stereo_until`], and for a plane that is not in front of the left camera.
pub fn dense_stereo_about(
    images: [&GrayImage; 2],
    cameras: [&Camera; 2],
    plane: &Plane,
    settings: &StereoSettings,
    cancel: Cancel<'_>,
) -> Result<DenseStereo> {
    dense(images, cameras, Some(plane), settings, cancel)
}

/// As [`dense_stereo`], but ends within a row or an alignment once `cancel` is requested.
///
/// # Errors
/// As [`dense_stereo`], and [`Error::Cancelled`].
pub fn dense_stereo_until(
    images: [&GrayImage; 2],
    cameras: [&Camera; 2],
    settings: &StereoSettings,
    cancel: Cancel<'_>,
) -> Result<DenseStereo> {
    dense(images, cameras, None, settings, cancel)
}

fn dense(
    [left, right]: [&GrayImage; 2],
    cameras: [&Camera; 2],
    plane: Option<&Plane>,
    settings: &StereoSettings,
    cancel: Cancel<'_>,
) -> Result<DenseStereo> {
    for (image, camera) in [left, right].into_iter().zip(cameras) {
        if <[u32; 2]>::from(image.dimensions()) != camera.size {
            return Err(Error::Request("an image of the pair is not as large as its camera says".to_owned()));
        }
    }
    let alignment = Alignment::about(cameras[0], cameras[1], plane, &settings.align)?;
    let mut settings = settings.clone();
    if settings.disparity_count == 0 {
        // Points above the plane: the disparity is less than plane_px plus the disparity of range_min_m.
        let nearest = alignment.disparity_px(settings.range_min_m) + alignment.plane_px
            - f64::from(settings.disparity_first_px);
        settings.disparity_count = (nearest.ceil() as u32 + 1).clamp(8, 512);
    }
    let images = alignment.images(left, right);
    cancel.check()?;
    let mut disparities = disparities_until([&images[0], &images[1]], &settings, cancel)?;
    let points_m = ranges::points(&mut disparities, &alignment, cameras, settings.range_max_m);
    Ok(DenseStereo { alignment, images, disparities, points_m })
}

/// Disparities of an aligned pair. Images of different widths must have the left border in common.
///
/// # Errors
/// [`Error::Setting`] for an invalid setting; [`Error::Request`] for images without pixels or of unequal height.
pub fn disparities(images: [&GrayImage; 2], settings: &StereoSettings) -> Result<DisparityMap> {
    disparities_until(images, settings, Cancel::default())
}

fn disparities_until(
    [left, right]: [&GrayImage; 2],
    settings: &StereoSettings,
    cancel: Cancel<'_>,
) -> Result<DisparityMap> {
    settings.check()?;
    if left.height() != right.height() || left.is_empty() || right.is_empty() {
        return Err(Error::Request(
            "the images of an aligned pair must have pixels and the same height".to_owned(),
        ));
    }
    let (scene, texture) = rayon::join(
        || Scene::new(left, right, settings, cancel),
        || if settings.texture_min > 0.0 { texture::texture(left) } else { Vec::new() },
    );
    let pixels = left.as_raw().len();
    let mut map = DisparityMap {
        width: left.width(),
        height: left.height(),
        disparity_px: vec![f32::NAN; pixels],
        outcome: vec![Outcome::Found; pixels],
    };
    match scene.cells {
        64 => match_all::<1>(&scene, &texture, &mut map),
        128 => match_all::<2>(&scene, &texture, &mut map),
        256 => match_all::<4>(&scene, &texture, &mut map),
        _ => match_all::<8>(&scene, &texture, &mut map),
    }
    cancel.check()?;
    checks::remove_speckles(&mut map, settings.speckle_px as usize, settings.speckle_step_px as f32);
    Ok(map)
}

/// Matches all rows; each pixel has `N` blocks of cells.
fn match_all<const N: usize>(scene: &Scene<'_>, texture: &[f32], map: &mut DisparityMap) {
    let width = scene.size[0];
    let of_row = |y: usize| texture.get(y * width..(y + 1) * width).unwrap_or_default();
    match scene.settings.method {
        StereoMethod::SemiGlobal => semi_global::match_rows::<N>(scene, |y, row: &RowResult| {
            let at = y * width..(y + 1) * width;
            let (disparities, outcomes) = (&mut map.disparity_px[at.clone()], &mut map.outcome[at]);
            checks::finish_row(scene, (y, row), of_row(y), disparities, outcomes);
        }),
        StereoMethod::BlockMatching => {
            let band = block_matching::BAND * width;
            let bands = map.disparity_px.par_chunks_mut(band).zip(map.outcome.par_chunks_mut(band));
            let room = || block_matching::Band::new(scene);
            bands.enumerate().for_each_init(room, |room, (number, (disparities, outcomes))| {
                let first = number * block_matching::BAND;
                let rows = first..first + disparities.len() / width;
                block_matching::match_rows::<N>(scene, room, rows, |y, row: &RowResult| {
                    let at = (y - first) * width..(y - first + 1) * width;
                    let (disparities, outcomes) = (&mut disparities[at.clone()], &mut outcomes[at]);
                    checks::finish_row(scene, (y, row), of_row(y), disparities, outcomes);
                });
            });
        }
    }
}
