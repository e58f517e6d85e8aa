//! The numbers of the template tracker.

use sightline_track::locate::template::TemplateEvidence;
use sightline_track::locate::template::affine::AffineRefinement;
use sightline_track::locate::template::drift_correction::DriftCorrection;
use sightline_track::locate::template::height::{Relief, WeighedPeak};
use sightline_track::locate::template::klt::Descent;
use sightline_track::locate::template::match_template::{TemplateMatch, TriedTemplate};
use sightline_track::locate::template::point_stereo::PointStereo;
use sightline_track::locate::template::scale_roll::ScaleRoll;
use sightline_track::locate::template::settings::Measure;
use sightline_track::locate::template::triangulate::Triangulation;
use sightline_track::locate::template::warnings::{Warning, WarningKind};
use sightline_vision::correlate::Peak;
use sightline_vision::correlate::coarse_to_fine::CoarseSearch;

use super::sheet::{Sheet, Value};

/// Writes the evidence of the template tracker; at a designation it has only point stereo.
pub(crate) fn evidence(sheet: &mut Sheet, evidence: &TemplateEvidence) {
    sheet.each("warning", &evidence.warnings, warning);
    sheet.optional("warp", evidence.scale_roll.as_ref(), warp);
    sheet.optional("match", evidence.match_template.as_ref(), matched);
    sheet.optional("drift_correction", evidence.drift_correction.as_ref(), correction);
    sheet.optional("relief", evidence.relief.as_ref(), relief);
    sheet.optional("stereo", evidence.point_stereo.as_ref(), stereo);
    sheet.optional("triangulated", evidence.triangulate.as_ref(), triangulated);
}

fn warning(sheet: &mut Sheet, warning: &Warning) {
    let kind = match warning.kind {
        WarningKind::LowContrast => "low contrast",
        WarningKind::DepthRange => "depth range",
        WarningKind::OccludingBoundary => "occluding boundary",
        WarningKind::Shadow => "shadow",
        WarningKind::WeakStereo => "weak stereo",
        WarningKind::LeftRight => "left-right",
    };
    sheet.put("kind", kind);
    sheet.put("value", warning.value);
    sheet.put("limit", warning.limit);
    sheet.put("sentence", warning.sentence.as_str());
}

fn warp(sheet: &mut Sheet, warp: &ScaleRoll) {
    sheet.put("scale", warp.scale);
    sheet.put("roll_rad", warp.roll_rad);
    sheet.put("applied_scale", warp.applied_scale);
    sheet.put("applied_roll_rad", warp.applied_roll_rad);
    sheet.put("by_slope", warp.warped);
    sheet.put("old_distance_m", warp.old_distance_m);
    sheet.put("new_distance_m", warp.new_distance_m);
    sheet.put("template_stop", warp.template_step);
    sheet.put("matrix", warp.image_from_template);
}

fn matched(sheet: &mut Sheet, matched: &TemplateMatch) {
    let window = &matched.search_window;
    let corner = [i64::from(window.x), i64::from(window.y)];
    let size = [window.width, window.height].map(i64::from);
    let measure = match matched.measure {
        Measure::Ncc => "ncc",
        Measure::Sad => "sad",
        Measure::Ssd => "ssd",
        Measure::Sdog => "sdog",
    };
    sheet.put("window", Value::integers(corner.into_iter().chain(size)));
    sheet.put("positions", matched.positions);
    sheet.put("comparisons", matched.comparisons);
    sheet.put("flat", matched.flat_positions);
    sheet.put("measure", measure);
    sheet.within("peak", |sheet| peak(sheet, &matched.peak));
    sheet.put("px", matched.pixel);
    sheet.put("score", matched.score);
    sheet.put("focused_score", matched.focused_score);
    sheet.optional("second", matched.second_peak.as_ref(), |sheet, second| {
        sheet.put("px", second.pixel);
        sheet.put("score", second.score);
        sheet.put("ratio", second.ratio);
        sheet.put("distance_px", second.distance_px);
    });
    sheet.optional("coarse", matched.coarse.as_ref(), coarse);
    sheet.optional("descent", matched.descent.as_ref(), descent);
    sheet.optional("affine", matched.affine.as_ref(), affine);
    sheet.each("tried", &matched.tried, tried);
    sheet.each("weighed", &matched.weighed, weighed);
    sheet.put("covariance_px2", matched.covariance_px2);
    sheet.put("bias_px", matched.bias_px);
}

fn peak(sheet: &mut Sheet, peak: &Peak) {
    sheet.put("px", peak.pixel);
    sheet.put("score", peak.score);
    sheet.put("whole_px", Value::integers(peak.integer));
    sheet.put("whole_score", peak.integer_score);
    sheet.put("covariance_px2", peak.covariance_px2);
    sheet.put("at_edge", peak.at_edge);
}

fn coarse(sheet: &mut Sheet, coarse: &CoarseSearch) {
    sheet.put("factor", coarse.factor);
    sheet.put("comparisons", coarse.comparisons);
    sheet.each("candidate", &coarse.candidates, |sheet, candidate| {
        sheet.put("coarse_px", candidate.coarse_pixel);
        sheet.put("coarse_score", candidate.coarse_score);
        sheet.put("px", candidate.pixel);
        sheet.put("score", candidate.score);
    });
    let surface = coarse.coarse.as_ref().expect("a computed step has its scores");
    sheet.array("scores", &[surface.width as usize, surface.height as usize], &surface.scores);
}

fn descent(sheet: &mut Sheet, descent: &Descent) {
    sheet.put("iterations", descent.iterations);
    sheet.put("residual", descent.residual);
    sheet.put("matrix", descent.map);
}

fn affine(sheet: &mut Sheet, affine: &AffineRefinement) {
    sheet.put("px", affine.pixel);
    sheet.put("matrix", affine.map);
    sheet.put("shift_px", affine.shift_px);
    sheet.put("area_change", affine.area_change);
    sheet.put("iterations", affine.iterations);
    sheet.put("accepted", affine.accepted);
    sheet.put("reason", affine.rejected.as_deref());
}

fn tried(sheet: &mut Sheet, tried: &TriedTemplate) {
    sheet.put("template_stop", tried.template_step);
    sheet.put("warped", tried.warped);
    sheet.put("scale", tried.scale);
    sheet.put("roll_rad", tried.roll_rad);
    sheet.put("score", tried.score);
    sheet.put("focused_score", tried.focused_score);
}

fn weighed(sheet: &mut Sheet, weighed: &WeighedPeak) {
    sheet.put("px", weighed.pixel);
    sheet.put("score", weighed.score);
    sheet.put("agreement", weighed.agreement);
    sheet.put("total", weighed.total);
}

fn correction(sheet: &mut Sheet, correction: &DriftCorrection) {
    sheet.put("template_stop", correction.template_step);
    sheet.put("scale", correction.scale);
    sheet.put("px", correction.pixel);
    sheet.put("score", correction.score);
    sheet.put("shift_px", correction.shift_px);
    sheet.put("accepted", correction.accepted);
}

fn relief(sheet: &mut Sheet, relief: &Relief) {
    let neighbours: Vec<f64> =
        relief.neighbours.iter().flat_map(|point| [point.x, point.y, point.z]).collect();
    sheet.put("middle", relief.middle);
    sheet.array("neighbours", &[3, relief.neighbours.len()], &neighbours);
}

fn stereo(sheet: &mut Sheet, stereo: &PointStereo) {
    let points = stereo.curve.len();
    let pixels: Vec<f64> = stereo.curve.iter().flat_map(|point| [point.pixel.x, point.pixel.y]).collect();
    let ranges: Vec<f64> = stereo.curve.iter().map(|point| point.range_m).collect();
    let scores: Vec<f32> = stereo.curve.iter().map(|point| point.score.unwrap_or(f32::NAN)).collect();
    sheet.array("curve_px", &[2, points], &pixels);
    sheet.array("curve_range_m", &[points], &ranges);
    sheet.array("curve_score", &[points], &scores);
    sheet.put("right_px", stereo.right_pixel);
    sheet.put("score", stereo.score);
    sheet.put("range_m", stereo.range_m);
    sheet.put("disparity_px", stereo.disparity_px);
    sheet.put("across_px", stereo.across_px);
    sheet.put("left_right_px", stereo.left_right_px);
    sheet.put("at_end", stereo.at_end);
    sheet.put("covariance_px2", stereo.covariance_px2);
    sheet.put("right_from_left", stereo.right_from_left);
}

fn triangulated(sheet: &mut Sheet, triangulated: &Triangulation) {
    sheet.put("position_rover", triangulated.position_in_rover);
    sheet.put("covariance", triangulated.covariance_in_rover);
    sheet.put("surface_by_pixel", triangulated.surface_by_pixel);
    sheet.put("range_m", triangulated.range_m);
    sheet.put("gap_m", triangulated.gap_m);
    sheet.put("gap_px", triangulated.gap_px);
}
