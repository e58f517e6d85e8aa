//! Ranges of a left image by point stereo on a grid, for pairs whose rows cannot be aligned.
//!
//! Two freely placed views (`StereoGeometry::Convergent`), such as two pointings of one mast camera, see each other's
//! centre in or near the picture: no turn of the cameras makes their rows agree, and dense stereo finds nothing. Each grid
//! node is matched along its epipolar curve, as a designation would be. A node counts when its score reaches
//! `stereo_ncc_min`, its match is inside the searched curve, and the match leads back to the node.
//!
//! ```text
//! b = │B − (B·r) r│         d = f b / R         3σ_R / R = R Δd / (f b)
//! ```
//! | symbol | name | unit |
//! |---|---|---|
//! | B | vector between the camera centres | m |
//! | r | unit vector along the line of sight | – |
//! | b | `effective_baseline_m`: the part of the baseline that is seen from the target | m |
//! | d | `disparity_px` of the grid, in nodes | px / `SPACING_PX` |
//! | R | range | m |
//! | Δd | `disparity_error_px` | px |

use rayon::prelude::*;

use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pixel, Point3, Ray};
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_track::locate::template::failure::TemplateFailure;
use sightline_track::locate::template::point_stereo::{PointStereo, StereoInput, point_stereo};
use sightline_track::locate::template::settings::TemplateSettings;
use sightline_track::settings::Settings;
use sightline_track::stages::capture::StereoPair;
use sightline_vision::stereo::{DisparityMap, Outcome};

/// Pixels between two nodes of the grid.
pub(super) const SPACING_PX: u32 = 8;

/// A match that leads back farther from its node is not believed, px.
const BACK_MAX_PX: f64 = 1.5;

/// Nearest range of the search, baselines: nearer surfaces differ too much between the views, and their part of the
/// epipolar curve has no bound.
const RANGE_MIN_BASELINES: f64 = 4.0;

/// Parts of a ray whose images are compared with the borders of the right image.
const CURVE_SAMPLES: u32 = 8;

/// Ranges on a grid of the left image.
pub(super) struct PointRanges {
    /// Disparities and outcomes of the nodes, row by row.
    pub(super) nodes: DisparityMap,
    /// The point of each node, m, rover frame; NaN without a range.
    pub(super) points_m: Vec<[f32; 3]>,
    /// The centre of the left camera, m, rover frame.
    pub(super) viewpoint: Point3,
}

/// One node.
struct Node {
    disparity_px: f32,
    outcome: Outcome,
    point_m: [f32; 3],
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
        let [width, height] = left.size.map(|side| side.saturating_sub(1) / SPACING_PX + 1);
        let baseline_m = (right.model.centre() - left.model.centre()).norm();
        let template = search_settings(&settings.template, baseline_m);
        let node = |x: u32, y: u32| -> Node {
            let input = StereoInput {
                left_pixel: Pixel::new(f64::from(x * SPACING_PX), f64::from(y * SPACING_PX)),
                left_image: &pair.left,
                right_image: &pair.right,
                left,
                right,
                geometry: StereoGeometry::Convergent,
                predicted_range_m: None,
            };
            Node::of(&input, &template, settings.limits.stereo_ncc_min)
        };
        let rows: Vec<Vec<Node>> = (0..height)
            .into_par_iter()
            .map(|y| {
                cancel.check()?;
                Ok((0..width).map(|x| node(x, y)).collect())
            })
            .collect::<Result<_>>()?;
        let nodes: Vec<Node> = rows.into_iter().flatten().collect();
        Ok(Self {
            nodes: DisparityMap {
                width,
                height,
                disparity_px: nodes.iter().map(|node| node.disparity_px).collect(),
                outcome: nodes.iter().map(|node| node.outcome).collect(),
            },
            points_m: nodes.iter().map(|node| node.point_m).collect(),
            viewpoint: left.model.centre(),
        })
    }
}

impl Node {
    fn of(input: &StereoInput<'_>, template: &TemplateSettings, score_min: f64) -> Self {
        let none = |outcome| Self { disparity_px: f32::NAN, outcome, point_m: [f32::NAN; 3] };
        let ray = input.left.ray(input.left_pixel);
        let Some(ray) = ray.filter(|ray| may_be_seen(ray, input.right, template)) else {
            return none(Outcome::Outside);
        };
        let found = match point_stereo(input, template) {
            Ok(found) => found,
            Err(failure) => return none(outcome_of(&failure)),
        };
        if let Some(outcome) = rejected(&found, score_min) {
            return none(outcome);
        }
        let focal_px = input.left.model.focal_length_px(input.left_pixel);
        let Some(focal_px) = focal_px else { return none(Outcome::Outside) };
        let disparity_px = focal_px * effective_baseline_m(&ray, input.right) / found.range_m;
        Self {
            disparity_px: (disparity_px / f64::from(SPACING_PX)) as f32,
            outcome: Outcome::Found,
            point_m: ray.at(found.range_m).coords.map(|value| value as f32).into(),
        }
    }
}

/// Whether a part of the ray may be in the right image: most nodes of a pair with little overlap need no search.
fn may_be_seen(ray: &Ray, right: &Camera, template: &TemplateSettings) -> bool {
    let far = 1.0 / template.range_max_m;
    let near = 1.0 / template.range_min_m;
    let samples = (0..=CURVE_SAMPLES).map(|k| far + (near - far) * f64::from(k) / f64::from(CURVE_SAMPLES));
    let seen: Vec<Pixel> = samples.filter_map(|inverse| right.project(&ray.at(1.0 / inverse))).collect();
    // The box of two neighbours contains the nearly straight curve between them.
    let [width, height] = right.size.map(f64::from);
    seen.windows(2).any(|pair| {
        let (a, b) = (pair[0], pair[1]);
        a.x.max(b.x) >= 0.0 && a.x.min(b.x) <= width && a.y.max(b.y) >= 0.0 && a.y.min(b.y) <= height
    })
}

/// The settings of the search at a node: the window of a designation, compared once.
fn search_settings(template: &TemplateSettings, baseline_m: f64) -> TemplateSettings {
    let range_min_m = template.range_min_m.max(RANGE_MIN_BASELINES * baseline_m).min(template.range_max_m);
    TemplateSettings { surface_warp: false, focus_px: 0.0, range_min_m, ..template.clone() }
}

/// Why a match gives no range; `None` if it does.
fn rejected(found: &PointStereo, score_min: f64) -> Option<Outcome> {
    let leads_back = found.left_right_px.is_some_and(|distance_px| distance_px <= BACK_MAX_PX);
    if found.at_end {
        Some(Outcome::OutOfRange)
    } else if found.score < score_min || !leads_back {
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

/// The part of the baseline that is seen from a target on `ray`, m.
pub(super) fn effective_baseline_m(ray: &Ray, right: &Camera) -> f64 {
    let baseline = right.model.centre() - ray.origin;
    (baseline - ray.direction * baseline.dot(&ray.direction)).norm()
}
