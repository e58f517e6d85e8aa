//! The stages of the feature tracker: detected and matched features, the residuals of the motion, and the bootstrap cloud.
//!
//! Radii on the images are the features' scales, px. The 3-D point of a feature is on its left ray at its range. Residuals
//! are drawn from the position predicted by the motion to the observed position, magnified by [`MAGNIFICATION`].

use rerun::{Arrows2D, LineStrips2D, Points2D, Points3D, Radius};
use sightline_geometry::frames::Pixel;
use sightline_track::locate::features::rows::{self, CloudPoint, Feature, Matched};

use super::Logged;
use super::convert::{point, point_3d, vector};
use super::palette::{INLIER, KEYPOINT, MEASUREMENT, OUTLIER, RESIDUAL, Rgb, color};
use super::step::Step;

/// Magnification of drawn residuals.
pub(super) const MAGNIFICATION: f64 = 10.0;

/// The features of the left image, with their scale as radius.
pub(super) fn log_keypoints(step: &Step<'_>) -> Logged {
    let found = features(step).map(|all| {
        Points2D::new(all.iter().map(|feature| point(feature.pixel)))
            .with_radii(all.iter().map(|feature| Radius::new_scene_units(feature.sigma_px as f32)))
            .with_colors([color(KEYPOINT)])
            .with_draw_order(10.0)
    });
    step.log("/{target}/locate/detect/keypoints", found)
}

/// Their matches in the right image.
pub(super) fn log_partners(step: &Step<'_>) -> Logged {
    let found = features(step).map(|all| {
        Points2D::new(all.iter().filter_map(|feature| feature.right).map(point))
            .with_radii([Radius::new_ui_points(1.5)])
            .with_colors([color(KEYPOINT)])
            .with_draw_order(10.0)
    });
    step.log("/{target}/locate/match_features/partners", found)
}

/// The 3-D points of features with a range.
pub(super) fn log_points(step: &Step<'_>) -> Logged {
    let camera = &step.trace.point_mast.left;
    let found = features(step).map(|all| {
        let position_of = |feature: &Feature| Some(camera.ray(feature.pixel)?.at(feature.range_m?));
        let points = all.iter().filter_map(position_of).map(|at| point_3d(&step.in_site(&at)));
        Points3D::new(points).with_radii([Radius::new_ui_points(1.5)]).with_colors([color(KEYPOINT)])
    });
    step.log("/{target}/locate/triangulate/points", found)
}

/// Arrows from the earlier to the current position of the inliers.
pub(super) fn log_inliers(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/match_features/inliers", flow(step, true, INLIER))
}

/// The same arrows for the outliers.
pub(super) fn log_outliers(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/match_features/outliers", flow(step, false, OUTLIER))
}

/// The image residuals of the inliers.
pub(super) fn log_residuals(step: &Step<'_>) -> Logged {
    let arrow = |feature: &Feature, matched: &Matched| {
        Some((matched.moved?, matched.residual_px(feature.pixel)? * MAGNIFICATION))
    };
    let found = matches(step, true).map(|all| {
        let arrows: Vec<_> = all.iter().filter_map(|(feature, matched)| arrow(feature, matched)).collect();
        Arrows2D::from_vectors(arrows.iter().map(|(_, along)| vector(along)))
            .with_origins(arrows.iter().map(|(from, _)| point(*from)))
            .with_colors([color(RESIDUAL)])
            .with_radii([Radius::new_ui_points(0.75)])
            .with_draw_order(25.0)
    });
    step.log("/{target}/locate/fit_motion/residuals", found)
}

/// The target positions of the bootstrap, in space.
pub(super) fn log_cloud(step: &Step<'_>) -> Logged {
    let found = cloud(step).map(|all| {
        let points = all.iter().map(|at| point_3d(&step.in_site(&at.position_in_rover)));
        Points3D::new(points).with_radii([Radius::new_ui_points(1.0)]).with_colors([color(MEASUREMENT)])
    });
    step.log("/{target}/locate/bootstrap/cloud", found)
}

/// The target positions of the bootstrap, in the left image.
pub(super) fn log_cloud_left(step: &Step<'_>) -> Logged {
    let found = cloud(step).map(|all| {
        Points2D::new(all.iter().filter_map(|at| at.left_pixel).map(point))
            .with_radii([Radius::new_ui_points(1.0)])
            .with_colors([color(MEASUREMENT)])
            .with_draw_order(28.0)
    });
    step.log("/{target}/locate/bootstrap/left", found)
}

fn features(step: &Step<'_>) -> Option<Vec<Feature>> {
    let evidence = step.features().filter(|evidence| evidence.detect.is_some())?;
    Some(rows::features(&evidence.table.get()?.values).collect())
}

fn cloud(step: &Step<'_>) -> Option<Vec<CloudPoint>> {
    let evidence = step.features().filter(|evidence| evidence.bootstrap.is_some())?;
    Some(rows::cloud(&evidence.cloud.get()?.values).collect())
}

/// The matches that are inliers of the motion, or its outliers.
fn matches(step: &Step<'_>, is_inlier: bool) -> Option<Vec<(Feature, Matched)>> {
    step.features()?.fit_motion.as_ref()?;
    let matched = |feature: Feature| feature.matched.clone().map(|matched| (feature, matched));
    let all = features(step)?.into_iter().filter_map(matched);
    Some(all.filter(|(_, matched)| matched.is_inlier == is_inlier).collect())
}

fn flow(step: &Step<'_>, is_inlier: bool, rgb: Rgb) -> Option<LineStrips2D> {
    let strip = |(feature, matched): &(Feature, Matched)| -> [[f32; 2]; 2] {
        [matched.then, feature.pixel].map(|pixel: Pixel| point(pixel))
    };
    matches(step, is_inlier).map(|all| {
        LineStrips2D::new(all.iter().map(strip))
            .with_colors([color(rgb)])
            .with_radii([Radius::new_ui_points(0.75)])
            .with_draw_order(22.0)
    })
}
