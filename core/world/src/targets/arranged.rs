//! Targets on the large rock, in straight rows or all over it with some on its boundary; or at the centre of one rock.
//!
//! **The large rock** is the one with the most pixels near the targets' centre, counted on a grid of every third pixel.
//!
//! **Rows** (R110). On every third image row of the large rock, the longest stretch of pixels that satisfy the window rule
//! is found. The longest of all is the first row; the next is the longest at least a window's height away from those
//! taken. Each row gets its share of the targets at equal spacing from end to end of its stretch, in whole pixels, so that
//! correct tracks keep the rows straight and evenly spaced.
//!
//! **Centre.** Of all pixels that show the rock at the targets' centre, the one nearest to their mean. The centre itself
//! is on top of the rock, which from afar is the rock's upper edge, where no user would designate a target (R20).
//! **Placed** is the same for each placed rock.
//!
//! Units: px. Frame: pixels of the first left image. Sources: papers.md R110, R115, R119.

use std::collections::{BTreeSet, HashMap};
use std::ops::RangeInclusive;

use nalgebra::Vector3;
use rand_pcg::Pcg64;

use crate::scenario::PlacedRock;
use crate::targets::view::View;
use crate::world::SurfaceId;
use sightline_geometry::frames::{Pixel, Point3, Ray};

/// Spacing of the grid on which pixels are counted, px.
const STRIDE_PX: u32 = 3;

/// Largest distance between the projected top of a rock, which is at its edge, and the pixels that show the rock, px.
const EDGE_PX: i32 = 16;

/// Height above the targets' centre from which every nearby rock is below, m.
const HIGH_M: f64 = 10.0;

/// A stretch of an image row whose pixels satisfy the window rule.
struct Stretch {
    y: u32,
    columns: RangeInclusive<u32>,
}

impl Stretch {
    fn length(&self) -> u32 {
        self.columns.end() - self.columns.start()
    }
}

impl View<'_> {
    /// The targets of the arrangement `rows`.
    pub(super) fn rows(&self) -> Vec<Pixel> {
        let Some((rock, [columns, rows])) = self.large_rock() else { return Vec::new() };
        let mut stretches: Vec<Stretch> = rows
            .step_by(STRIDE_PX as usize)
            .filter_map(|y| self.longest_stretch(rock, y, columns.clone()))
            .collect();
        // The sort is stable: equal lengths keep their order from top to bottom.
        stretches.sort_by_key(|stretch| std::cmp::Reverse(stretch.length()));
        let mut taken: Vec<&Stretch> = Vec::new();
        for stretch in &stretches {
            let is_apart = |other: &&Stretch| other.y.abs_diff(stretch.y) >= self.rule.window_px;
            if (taken.len() as u32) < self.rule.rows && taken.iter().all(is_apart) {
                taken.push(stretch);
            }
        }
        taken.sort_by_key(|stretch| stretch.y);
        let count = self.rule.count / self.rule.rows.max(1);
        taken.into_iter().flat_map(|stretch| evenly_spaced(stretch, count)).collect()
    }

    /// The targets of the arrangement `face`.
    pub(super) fn face(&self, random: &mut Pcg64) -> Vec<Pixel> {
        let Some((rock, _)) = self.large_rock() else { return Vec::new() };
        let boundary = self.rule.boundary.min(self.rule.count);
        let on_rock = |pixel: Pixel| self.shows(rock, pixel) && self.is_target(pixel);
        let mut chosen = self.drawn(self.rule.count - boundary, random, &on_rock);
        let on_edge = |pixel: Pixel| self.shows(rock, pixel) && self.is_on_boundary(pixel);
        chosen.extend(self.drawn(boundary, random, &on_edge));
        chosen
    }

    /// The target of the arrangement `centre`; the targets' centre if it is not on a rock, or if the rock is not visible.
    pub(super) fn centre(&self) -> Option<Pixel> {
        let centre = self.world.targets_centre();
        self.middle_of_rock_at([centre.x, centre.y]).or_else(|| self.camera.project(&centre))
    }

    /// The targets of the arrangement `placed`: the centre of the visible part of each placed rock, if it is in the image.
    pub(super) fn on_placed(&self) -> Vec<Pixel> {
        let centre = self.world.targets_centre();
        let middle = |rock: &PlacedRock| self.middle_of_rock_at([centre.x + rock.x_m, centre.y + rock.y_m]);
        let [width, height] = self.camera.size;
        let middles = self.placed.iter().filter_map(middle);
        middles.filter(|pixel| pixel.is_inside(width, height)).take(self.rule.count as usize).collect()
    }

    /// The centre of the visible part of the rock at x, y of the site frame, m; `None` without a visible rock there.
    fn middle_of_rock_at(&self, [x, y]: [f64; 2]) -> Option<Pixel> {
        let above = Point3::new(x, y, self.world.targets_centre().z) - HIGH_M * Vector3::z();
        let below = self.world.cast(&Ray { origin: above, direction: Vector3::z() })?;
        let SurfaceId::Rock(rock) = below.surface else { return None };
        let centre = self.camera.project(&below.point)?;
        let seen = self.seen_of(rock, [centre.x.round() as i32, centre.y.round() as i32]);
        let mean = |k: usize| seen.iter().map(|at| f64::from(at[k])).sum::<f64>() / seen.len() as f64;
        let middle = Pixel::new(mean(0), mean(1));
        let pixels = seen.iter().map(|at| Pixel::new(at[0].into(), at[1].into()));
        pixels.min_by(|a, b| a.distance(middle).total_cmp(&b.distance(middle)))
    }

    /// The connected pixels that show a rock, starting from the one nearest to `near`, at most [`EDGE_PX`] away.
    fn seen_of(&self, rock: u32, near: [i32; 2]) -> BTreeSet<[i32; 2]> {
        let shows = |at: &[i32; 2]| self.shows(rock, Pixel::new(at[0].into(), at[1].into()));
        let offsets = (-EDGE_PX..=EDGE_PX).flat_map(|y| (-EDGE_PX..=EDGE_PX).map(move |x| [x, y]));
        let mut around: Vec<[i32; 2]> = offsets.collect();
        around.sort_by_key(|[x, y]| x * x + y * y);
        let mut open: Vec<[i32; 2]> =
            around.iter().map(|[x, y]| [near[0] + x, near[1] + y]).find(shows).into_iter().collect();
        let mut seen: BTreeSet<[i32; 2]> = open.iter().copied().collect();
        while let Some([x, y]) = open.pop() {
            for at in [[x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]] {
                if !seen.contains(&at) && shows(&at) {
                    seen.insert(at);
                    open.push(at);
                }
            }
        }
        seen
    }

    fn shows(&self, rock: u32, pixel: Pixel) -> bool {
        let hit = self.camera.ray(pixel).and_then(|ray| self.world.cast(&ray));
        hit.is_some_and(|hit| hit.surface == SurfaceId::Rock(rock))
    }

    /// The large rock with the range of columns and rows in which it is visible.
    fn large_rock(&self) -> Option<(u32, [RangeInclusive<u32>; 2])> {
        let [columns, rows] = self.bounds()?;
        let mut seen: HashMap<u32, Vec<[u32; 2]>> = HashMap::new();
        for y in (rows[0]..=rows[1]).step_by(STRIDE_PX as usize) {
            for x in (columns[0]..=columns[1]).step_by(STRIDE_PX as usize) {
                let ray = self.camera.ray(Pixel::new(x.into(), y.into()));
                if let Some(SurfaceId::Rock(rock)) =
                    ray.and_then(|ray| self.world.cast(&ray)).map(|hit| hit.surface)
                {
                    seen.entry(rock).or_default().push([x, y]);
                }
            }
        }
        let (rock, pixels) =
            seen.into_iter().max_by_key(|(rock, pixels)| (pixels.len(), std::cmp::Reverse(*rock)))?;
        let range = |k: usize| -> Option<RangeInclusive<u32>> {
            let of_axis = || pixels.iter().map(|pixel| pixel[k]);
            Some(of_axis().min()?..=of_axis().max()?)
        };
        Some((rock, [range(0)?, range(1)?]))
    }

    /// The longest stretch of pixels of a rock in an image row that satisfy the window rule.
    fn longest_stretch(&self, rock: u32, y: u32, columns: RangeInclusive<u32>) -> Option<Stretch> {
        let (mut longest, mut first): (Option<Stretch>, Option<u32>) = (None, None);
        for x in columns.step_by(STRIDE_PX as usize) {
            let pixel = Pixel::new(x.into(), y.into());
            if !(self.shows(rock, pixel) && self.is_target(pixel)) {
                first = None;
                continue;
            }
            let stretch = Stretch { y, columns: *first.get_or_insert(x)..=x };
            if longest.as_ref().is_none_or(|known| stretch.length() > known.length()) {
                longest = Some(stretch);
            }
        }
        longest
    }
}

/// `count` pixels from end to end of a stretch, at equal spacing in whole pixels.
fn evenly_spaced(stretch: &Stretch, count: u32) -> Vec<Pixel> {
    let spacing_px = stretch.length() / count.saturating_sub(1).max(1);
    let at = |k: u32| Pixel::new((stretch.columns.start() + k * spacing_px).into(), stretch.y.into());
    // If the stretch has fewer pixels than there are targets, each pixel is used once.
    let fitting = if spacing_px == 0 { 1 } else { count };
    (0..fitting.min(count)).map(at).collect()
}
