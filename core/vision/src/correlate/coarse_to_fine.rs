//! Coarse-to-fine search: all positions at a coarse level, then the neighbourhood of the best ones (R64, R65).
//!
//! Template and region are halved `levels` times (`image::pyramid`). At the coarsest level every position is compared;
//! its highest local maxima are the candidates. At each finer level a candidate is searched for within `reach_px` of its
//! position at the coarser level, down to whole pixels of the image, where the neighbours required by the sub-pixel fit
//! are compared too. An exhaustive score map is never built: the returned one contains the visited positions and NaN
//! elsewhere.
//!
//! Coarse levels are compared by normalised correlation for every measure (R65): the signs of a difference of Gaussians
//! belong to another band at every level, and are too few in a small template. The measure itself decides among the
//! whole pixels.
//!
//! *Ours:* candidates are local maxima instead of the highest scores, which would all be neighbours. Coarse levels
//! sample every second pixel of the image counted from its first, so that they do not depend on the region. The
//! template's own coarse levels are made from its surroundings; otherwise its border would be smoothed with other pixels
//! than the image's.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::peak::{self, Peak};
use super::similarity::Similarity;
use super::surface::Surface;
use crate::image::patch::{self, Patch};
use crate::image::pyramid;
use crate::image::{GrayImage, PixelRect};
use sightline_geometry::frames::Pixel;

/// Reach of the five-tap blur beyond a level's border, px.
const BLUR_REACH_PX: u32 = 2;

/// Parameters of the coarse-to-fine search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descent {
    /// Number of times that template and image are halved.
    pub levels: u32,
    /// Number of local maxima of the coarsest level to follow.
    pub candidates: usize,
    /// Search radius around each candidate at every finer level, px of that level.
    pub reach_px: u32,
}

/// A local maximum of the coarsest level and its final position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = CoarseCandidate)]
pub struct Candidate {
    /// Position at the coarsest level, px of the image.
    pub coarse_pixel: Pixel,
    /// Score at the coarsest level.
    pub coarse_score: f64,
    /// Final position, px.
    pub pixel: Pixel,
    /// Score at the final position.
    pub score: f64,
}

/// Record of a coarse-to-fine search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CoarseSearch {
    /// Pixels of the image per pixel of the coarsest level.
    pub factor: u32,
    /// The followed candidates, in descending order of their coarse score.
    pub candidates: Vec<Candidate>,
    /// Number of positions compared, over all levels.
    pub comparisons: u64,
    /// Score map of the coarsest level; its pixels are `factor` px of the image. Not serialised: `None` in a record read
    /// from JSON.
    #[serde(skip)]
    #[schema(ignore)]
    pub coarse: Option<Surface>,
}

/// Finds the middle `size` × `size` px of `wide` in `region`; returns the visited scores at whole pixels, and the
/// record.
///
/// `wide` must contain [`Descent::margin_px`] around the template; the border of a narrower one is smoothed with fewer
/// pixels. `None` as for [`Similarity::surface`].
pub fn coarse_to_fine(
    similarity: &Similarity,
    wide: &Patch,
    size: u32,
    image: &GrayImage,
    region: PixelRect,
    descent: &Descent,
) -> Option<(Surface, CoarseSearch)> {
    let levels = Levels::new(similarity, wide, size, image, region, descent)?;
    let (coarse, mut comparisons) = levels.exhaustive(descent.levels)?;
    let mut visited = levels.empty_surface()?;
    let candidates: Vec<Candidate> = peak::highest_maxima(&coarse, descent.candidates)
        .into_iter()
        .filter_map(|(place, score)| {
            let found = levels.follow(place, &mut visited, &mut comparisons)?;
            let to_image = f64::from(1_u32 << descent.levels);
            Some(Candidate {
                coarse_pixel: Pixel::new(f64::from(place[0]) * to_image, f64::from(place[1]) * to_image),
                coarse_score: f64::from(score),
                pixel: Pixel::new(f64::from(found.0[0]), f64::from(found.0[1])),
                score: f64::from(found.1),
            })
        })
        .collect();
    if let Some((ix, iy, _)) = visited.maximum() {
        let best = visited.pixel_of(ix, iy);
        // The quartic of the sub-pixel fit passes through 5 × 5 scores.
        comparisons += levels.visit(0, [best.x as i32, best.y as i32], 2, &mut visited);
    }
    Some((
        visited,
        CoarseSearch { factor: 1 << descent.levels, candidates, comparisons, coarse: Some(coarse) },
    ))
}

impl Descent {
    /// Width of the surroundings that the search needs around a template of `size` px, px.
    pub fn margin_px(&self, similarity: &Similarity, size: u32) -> u32 {
        let factor = 1 << self.levels;
        let half = (size / 2).div_ceil(factor) + similarity.margin_px() + BLUR_REACH_PX;
        half * factor - size / 2
    }
}

/// Template, image and region at every level, finest first.
struct Levels<'a> {
    similarity: &'a Similarity,
    /// Wide template, its side, image and region of each level.
    steps: Vec<(Patch, u32, GrayImage, PixelRect)>,
    /// Pixel of the image at (0, 0) of every level.
    origin: [i32; 2],
    reach_px: u32,
}

impl<'a> Levels<'a> {
    fn new(
        similarity: &'a Similarity,
        wide: &Patch,
        size: u32,
        image: &GrayImage,
        region: PixelRect,
        descent: &Descent,
    ) -> Option<Self> {
        let region = region.intersect(&PixelRect::whole(image.width(), image.height()))?;
        let factor = 1_i32 << descent.levels;
        let margin = (descent.margin_px(similarity, size) as i32 / factor + 1) * factor;
        // A multiple of the factor, so that levels sample the same pixels for any region.
        let start = |first: i32| ((first - margin).max(0) / factor) * factor;
        let (x, y) = (start(region.x), start(region.y));
        let end = |first: i32, length: u32, start: i32| (first + length as i32 + margin - start) as u32;
        let part = PixelRect::new(x, y, end(region.x, region.width, x), end(region.y, region.height, y))
            .intersect(&PixelRect::whole(image.width(), image.height()))?;
        let mut steps = vec![(
            wide.clone(),
            size,
            patch::crop(image, &part),
            PixelRect::new(region.x - x, region.y - y, region.width, region.height),
        )];
        for _ in 0..descent.levels {
            let (wide, size, image, region) = steps.last()?;
            let wide = Patch::from(pyramid::halve(evenly_centred(wide)?.image()));
            // The region's pixels on the coarse grid.
            let first = |v: i32| v.div_euclid(2) + v.rem_euclid(2);
            let last = |v: i32, length: u32| (v + length as i32 - 1).div_euclid(2);
            let (x, y) = (first(region.x), first(region.y));
            let width = u32::try_from(last(region.x, region.width) - x + 1).ok()?;
            let height = u32::try_from(last(region.y, region.height) - y + 1).ok()?;
            let next = (wide, (size / 4) * 2 + 1, pyramid::halve(image), PixelRect::new(x, y, width, height));
            steps.push(next);
        }
        Some(Self { similarity, steps, origin: [part.x, part.y], reach_px: descent.reach_px })
    }

    /// Score map over `region` of a level, in pixels of the level counted from the image's first.
    fn surface(&self, level: usize, region: PixelRect) -> Option<Surface> {
        let (wide, size, image, _) = self.steps.get(level)?;
        let similarity = if level == 0 { self.similarity } else { &Similarity::Ncc };
        let mut surface = similarity.surface(wide, *size, image, region)?;
        surface.origin[0] += self.origin[0] >> level;
        surface.origin[1] += self.origin[1] >> level;
        Some(surface)
    }

    /// Score map of a whole level, and the number of positions compared.
    fn exhaustive(&self, level: u32) -> Option<(Surface, u64)> {
        let (_, _, _, region) = self.steps.get(level as usize)?;
        let surface = self.surface(level as usize, *region)?;
        let compared = surface.scores.len() as u64;
        Some((surface, compared))
    }

    /// Score map of the finest level, with no position visited.
    fn empty_surface(&self) -> Option<Surface> {
        let (_, size, _, region) = self.steps.first()?;
        let width = (region.width + 1).checked_sub(*size).filter(|w| *w > 0)?;
        let height = (region.height + 1).checked_sub(*size).filter(|h| *h > 0)?;
        let half = (size / 2) as i32;
        Some(Surface {
            origin: [region.x + half + self.origin[0], region.y + half + self.origin[1]],
            width,
            height,
            scores: vec![f32::NAN; width as usize * height as usize],
            flat_positions: 0,
            template_size: *size,
        })
    }

    /// Follows a candidate from the coarsest level down to the image; adds the positions visited at the finest to
    /// `visited`.
    fn follow(
        &self,
        place: [i32; 2],
        visited: &mut Surface,
        comparisons: &mut u64,
    ) -> Option<([i32; 2], f32)> {
        let mut place = place;
        let mut found = None;
        for level in (0..self.steps.len() - 1).rev() {
            let expected = [2 * place[0], 2 * place[1]];
            let near = self.near(level, expected, self.reach_px)?;
            *comparisons += near.scores.len() as u64;
            let (ix, iy, score) = near.maximum()?;
            place = [near.origin[0] + ix as i32, near.origin[1] + iy as i32];
            found = Some((place, score));
            if level == 0 {
                copy(&near, visited);
            }
        }
        found
    }

    /// Compares the positions of a level around a place and adds them to `visited`; returns their number.
    fn visit(&self, level: usize, place: [i32; 2], reach: u32, visited: &mut Surface) -> u64 {
        let Some(near) = self.near(level, place, reach) else { return 0 };
        copy(&near, visited);
        near.scores.len() as u64
    }

    /// Scores of a level within `reach` of a place, clipped to the region.
    fn near(&self, level: usize, place: [i32; 2], reach: u32) -> Option<Surface> {
        let (_, size, _, region) = self.steps.get(level)?;
        let reach = (size / 2 + reach) as i32;
        let side = 2 * reach as u32 + 1;
        let [x, y] = [place[0] - (self.origin[0] >> level), place[1] - (self.origin[1] >> level)];
        let around = PixelRect::new(x - reach, y - reach, side, side);
        // A coarse level may round the region outwards by a pixel: the nearest positions inside are used.
        self.surface(level, around.intersect(region)?)
    }
}

/// The patch with its centre on an even pixel; cropped by one pixel on each side if necessary.
fn evenly_centred(wide: &Patch) -> Option<Patch> {
    if (wide.width() / 2).is_multiple_of(2) {
        return Some(wide.clone());
    }
    patch::middle(wide, wide.width().checked_sub(2)?)
}

/// Copies the scores of `part` into the score map `into`.
fn copy(part: &Surface, into: &mut Surface) {
    for (iy, ix) in (0..part.height).flat_map(|iy| (0..part.width).map(move |ix| (iy, ix))) {
        let (x, y) = (part.origin[0] + ix as i32, part.origin[1] + iy as i32);
        if let (Some((u, v)), Some(score)) = (into.index_of(x, y), part.at(ix, iy)) {
            into.scores[v as usize * into.width as usize + u as usize] = score;
        }
    }
}

/// Results of both searches for one template.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The best match of the exhaustive search.
    pub exhaustive: Peak,
    /// The best match of the coarse-to-fine search.
    pub coarse_to_fine: Peak,
    /// Whether both found the same whole pixel.
    pub is_same: bool,
    /// Number of positions compared by the exhaustive search.
    pub exhaustive_comparisons: u64,
    /// Record of the coarse-to-fine search.
    pub search: CoarseSearch,
}

/// Runs both searches and compares their results (R65); `None` if either has no position to compare.
pub fn compare(
    similarity: &Similarity,
    wide: &Patch,
    size: u32,
    image: &GrayImage,
    region: PixelRect,
    descent: &Descent,
) -> Option<Comparison> {
    let all = similarity.surface(wide, size, image, region)?;
    let (visited, search) = coarse_to_fine(similarity, wide, size, image, region, descent)?;
    let (exhaustive, coarse_to_fine) = (peak::find_peak(&all, true)?, peak::find_peak(&visited, true)?);
    Some(Comparison {
        is_same: exhaustive.integer == coarse_to_fine.integer,
        exhaustive,
        coarse_to_fine,
        exhaustive_comparisons: all.scores.len() as u64,
        search,
    })
}

#[cfg(test)]
#[path = "coarse_to_fine_tests.rs"]
mod tests;
