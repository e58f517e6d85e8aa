//! Ranges of a left image by point stereo on a grid, for pairs whose rows cannot be aligned.
//!
//! Two freely placed views (`StereoGeometry::Convergent`), such as two pointings of one mast camera, may have the epipole
//! in or near the image: no rotation of the cameras aligns their rows, and dense stereo finds nothing. Each grid node is
//! matched along its epipolar curve. Its match is *consistent* if it is inside the searched curve and its reverse match
//! returns to the node. A consistent match gives a range if its score reaches `stereo_ncc_min`, or if it reaches
//! `SCORE_FLOOR` and the disparities of its neighbours agree with it: noise lowers the score of a correct match.
//!
//! The grid is matched from coarse to fine. The first level searches the whole curve; each later level searches from the
//! far end to `REACH_PX` beyond the largest disparity of its neighbours. Without a consistent neighbour, a node of the
//! last level is not searched.
//!
//! ```text
//! b = │B − (B·r) r│         d = f b / R         3σ_R / R = R Δd / (f b)
//! ```
//! | symbol | name | unit |
//! |---|---|---|
//! | B | vector between the camera centres | m |
//! | r | unit vector along the line of sight | – |
//! | b | `effective_baseline_m`: the component of the baseline across the line of sight | m |
//! | d | `disparity_px`, in the map of the nodes divided by `SPACING_PX` | px |
//! | R | range | m |
//! | Δd | `disparity_error_px` | px |

use rayon::prelude::*;

use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pixel, Point3, Ray};
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_track::locate::template::failure::TemplateFailure;
use sightline_track::locate::template::point_match::{PointMatch, point_match};
use sightline_track::locate::template::point_stereo::StereoInput;
use sightline_track::locate::template::settings::TemplateSettings;
use sightline_track::settings::Settings;
use sightline_track::stages::capture::StereoPair;
use sightline_vision::stereo::{DisparityMap, Outcome};

/// Spacing of the grid's nodes, px; the first is half of that from the image's corner, like the cells of a map.
pub(super) const SPACING_PX: u32 = 8;

/// Largest distance between a node and its reverse match, px.
const BACK_MAX_PX: f64 = 1.5;

/// Nearest range of the search, in baselines: nearer surfaces differ too much between the views, and their part of the
/// epipolar curve is unbounded.
const RANGE_MIN_BASELINES: f64 = 4.0;

/// Intervals of a ray whose projections are tested against the borders of the right image.
const CURVE_SAMPLES: u32 = 8;

/// Node spacing of each level, coarse to fine, in nodes.
const STRIDES: [u32; 3] = [4, 2, 1];

/// Search margin beyond the largest disparity of a node's neighbours, px.
const REACH_PX: f64 = 6.0;

/// Lowest score of a consistent match whose neighbours agree.
const SCORE_FLOOR: f64 = 0.5;

/// Largest difference of the disparities of neighbouring nodes that agree, px.
const AGREE_PX: f64 = 1.0;

/// Smallest number of its eight neighbours that must agree with a match below `stereo_ncc_min`.
const AGREE_MIN: usize = 3;

/// Ranges on a grid of the left image.
pub(super) struct PointRanges {
    /// Disparities and outcomes of the nodes, row by row.
    pub(super) nodes: DisparityMap,
    /// The point of each node, m, rover frame; NaN without a range.
    pub(super) points_m: Vec<[f32; 3]>,
    /// The score of each node; NaN without a range.
    pub(super) scores: Vec<f32>,
    /// The centre of the left camera, m, rover frame.
    pub(super) viewpoint: Point3,
}

/// A match inside the searched curve whose reverse match returns to its node.
#[derive(Clone, Copy)]
struct Match {
    disparity_px: f64,
    score: f64,
    point_m: Point3,
}

/// A node: its match, or the reason for having none.
type Node = Result<Match, Outcome>;

/// The grid during matching.
struct Grid {
    width: u32,
    height: u32,
    /// `None` until the node's level is matched.
    nodes: Vec<Option<Node>>,
}

impl PointRanges {
    /// Measures the ranges of a pair.
    ///
    /// # Errors
    /// `Error::Cancelled` soon after `cancel` is requested.
    pub(super) fn measure(
        pair: &StereoPair,
        [left, right]: [&Camera; 2],
        settings: &Settings,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        let [width, height] = left.size.map(|side| side.div_ceil(SPACING_PX));
        let baseline_m = (right.model.centre() - left.model.centre()).norm();
        let template = search_settings(&settings.template, baseline_m);
        let mut grid = Grid { width, height, nodes: vec![None; (width * height) as usize] };
        for stride in STRIDES {
            let node = |x: u32, y: u32| {
                let input = StereoInput {
                    left_pixel: node_pixel([x, y], left.size),
                    left_image: &pair.left,
                    right_image: &pair.right,
                    left,
                    right,
                    geometry: StereoGeometry::Convergent,
                    predicted_range_m: None,
                    surface_by_pixel: None,
                };
                match grid.largest_disparity_px([x, y], 2 * stride) {
                    None if stride == 1 => Err(grid.coarser_outcome([x, y])),
                    neighbours => matched(&input, &template, neighbours),
                }
            };
            let found: Vec<Vec<(usize, Node)>> = (0..height)
                .into_par_iter()
                .step_by(stride as usize)
                .map(|y| {
                    cancel.check()?;
                    let row = (0..width).step_by(stride as usize);
                    let open = row.map(|x| (x, (y * width + x) as usize));
                    let open = open.filter(|(_, index)| grid.nodes[*index].is_none());
                    Ok(open.map(|(x, index)| (index, node(x, y))).collect())
                })
                .collect::<Result<_>>()?;
            for (index, node) in found.into_iter().flatten() {
                grid.nodes[index] = Some(node);
            }
        }
        Ok(grid.ranges(settings.limits.stereo_ncc_min, left.model.centre()))
    }
}

/// The pixel of a node; beyond the last whole cell, the last pixel.
fn node_pixel(node: [u32; 2], size: [u32; 2]) -> Pixel {
    let at = |k: usize| f64::from((node[k] * SPACING_PX + SPACING_PX / 2).min(size[k].saturating_sub(1)));
    Pixel::new(at(0), at(1))
}

/// The node nearest to a pixel, in fractions of nodes.
pub(super) fn node_of(pixel: Pixel) -> Pixel {
    let (spacing_px, first_px) = (f64::from(SPACING_PX), f64::from(SPACING_PX / 2));
    Pixel::new((pixel.x - first_px) / spacing_px, (pixel.y - first_px) / spacing_px)
}

impl Grid {
    fn at(&self, x: i64, y: i64) -> Option<&Node> {
        let inside = (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y);
        inside.then(|| self.nodes[(y * i64::from(self.width) + x) as usize].as_ref()).flatten()
    }

    /// The largest disparity of the sixteen nodes around one that are `stride` apart, px.
    fn largest_disparity_px(&self, [x, y]: [u32; 2], stride: u32) -> Option<f64> {
        let stride = i64::from(stride);
        let around = |v: u32| (-1..=2).map(move |k| (i64::from(v).div_euclid(stride) + k) * stride);
        let nodes = around(y).flat_map(|v| around(x).filter_map(move |u| self.at(u, v)));
        let found = nodes.filter_map(|node| node.ok()).filter(|found| found.score >= SCORE_FLOOR);
        found.map(|found| found.disparity_px).reduce(f64::max)
    }

    /// The outcome of the nearest coarser node, for a node whose neighbours have no match.
    fn coarser_outcome(&self, [x, y]: [u32; 2]) -> Outcome {
        let beside = self.at(i64::from(x / 2 * 2), i64::from(y / 2 * 2));
        beside.and_then(|node| node.err()).unwrap_or(Outcome::LeftRight)
    }

    /// Number of the eight neighbours that agree with the disparity of a match.
    fn agreeing(&self, index: usize, found: &Match) -> usize {
        let width = self.width as usize;
        let (x, y) = ((index % width) as i64, (index / width) as i64);
        let around = (-1..=1).flat_map(|v| (-1..=1).map(move |u| (u, v))).filter(|at| *at != (0, 0));
        let neighbours = around.filter_map(|(u, v)| self.at(x + u, y + v)?.ok());
        neighbours.filter(|other| (other.disparity_px - found.disparity_px).abs() <= AGREE_PX).count()
    }

    /// Keeps the matches that give a range.
    fn ranges(self, score_min: f64, viewpoint: Point3) -> PointRanges {
        let judge = |index: usize, node: &Option<Node>| -> Node {
            let found = node.unwrap_or(Err(Outcome::Outside))?;
            if found.score >= score_min {
                return Ok(found);
            }
            let supported = found.score >= SCORE_FLOOR && self.agreeing(index, &found) >= AGREE_MIN;
            if supported { Ok(found) } else { Err(Outcome::Speckle) }
        };
        let judged: Vec<Node> =
            self.nodes.iter().enumerate().map(|(index, node)| judge(index, node)).collect();
        let value = |of: fn(&Match) -> f64| {
            judged.iter().map(|node| node.as_ref().map_or(f32::NAN, |found| of(found) as f32)).collect()
        };
        let point = |node: &Node| {
            node.map_or([f32::NAN; 3], |found| found.point_m.coords.map(|value| value as f32).into())
        };
        PointRanges {
            nodes: DisparityMap {
                width: self.width,
                height: self.height,
                disparity_px: value(|found| found.disparity_px / f64::from(SPACING_PX)),
                outcome: judged.iter().map(|node| node.err().unwrap_or(Outcome::Found)).collect(),
            },
            points_m: judged.iter().map(point).collect(),
            scores: value(|found| found.score),
            viewpoint,
        }
    }
}

/// Matches a node, up to `REACH_PX` beyond the largest disparity of its neighbours if that is known.
fn matched(input: &StereoInput<'_>, template: &TemplateSettings, neighbours_px: Option<f64>) -> Node {
    let ray = input.left.ray(input.left_pixel).ok_or(Outcome::Outside)?;
    let focal_px = input.left.model.focal_length_px(input.left_pixel).ok_or(Outcome::Outside)?;
    let product = focal_px * effective_baseline_m(&ray, input.right);
    let near_m = neighbours_px.map_or(0.0, |largest_px| product / (largest_px + REACH_PX));
    let range_min_m = template.range_min_m.max(near_m).min(0.5 * template.range_max_m);
    let template = TemplateSettings { range_min_m, ..template.clone() };
    if !may_be_seen(&ray, input.right, &template) {
        return Err(Outcome::Outside);
    }
    let found = point_match(input, &template).map_err(|failure| outcome_of(&failure))?;
    rejected(&found).map_or(Ok(()), Err)?;
    Ok(Match { disparity_px: product / found.range_m, score: found.score, point_m: ray.at(found.range_m) })
}

/// Whether a part of the ray may be in the right image: in a pair with little overlap most nodes need no search.
fn may_be_seen(ray: &Ray, right: &Camera, template: &TemplateSettings) -> bool {
    let far = 1.0 / template.range_max_m;
    let near = 1.0 / template.range_min_m;
    let samples = (0..=CURVE_SAMPLES).map(|k| far + (near - far) * f64::from(k) / f64::from(CURVE_SAMPLES));
    let seen: Vec<Pixel> = samples.filter_map(|inverse| right.project(&ray.at(1.0 / inverse))).collect();
    // The bounding box of two neighbouring samples contains the nearly straight curve between them.
    let [width, height] = right.size.map(f64::from);
    seen.windows(2).any(|pair| {
        let (a, b) = (pair[0], pair[1]);
        a.x.max(b.x) >= 0.0 && a.x.min(b.x) <= width && a.y.max(b.y) >= 0.0 && a.y.min(b.y) <= height
    })
}

/// The settings of the search at a node: the window of a designation, matched without refinement.
fn search_settings(template: &TemplateSettings, baseline_m: f64) -> TemplateSettings {
    let range_min_m = template.range_min_m.max(RANGE_MIN_BASELINES * baseline_m).min(template.range_max_m);
    TemplateSettings { surface_warp: false, focus_px: 0.0, range_min_m, ..template.clone() }
}

/// Why a match is not consistent; `None` if it is.
fn rejected(found: &PointMatch) -> Option<Outcome> {
    let leads_back = found.left_right_px.is_some_and(|distance_px| distance_px <= BACK_MAX_PX);
    if found.at_end {
        Some(Outcome::OutOfRange)
    } else if !leads_back {
        Some(Outcome::LeftRight)
    } else {
        None
    }
}

fn outcome_of(failure: &TemplateFailure) -> Outcome {
    match failure {
        TemplateFailure::RayUnseen | TemplateFailure::NoStereoWindow => Outcome::Outside,
        _ => Outcome::NoTexture,
    }
}

/// The component of the baseline across the line of sight `ray`, m.
pub(super) fn effective_baseline_m(ray: &Ray, right: &Camera) -> f64 {
    let baseline = right.model.centre() - ray.origin;
    (baseline - ray.direction * baseline.dot(&ray.direction)).norm()
}
