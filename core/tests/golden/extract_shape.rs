//! The numbers of the shape tracker and of the combined one.

use sightline_track::locate::shape_tracker::ShapeEvidence;
use sightline_track::locate::shape_tracker::drape::Draped;
use sightline_track::locate::shape_tracker::evidence::Registered;
use sightline_track::locate::shape_tracker::placement::Placement;
use sightline_track::locate::shape_tracker::surface::SurfaceSeen;
use sightline_track::locate::shape_tracker::view::View;
use sightline_vision::registration::Method;

use super::sheet::{Sheet, Value};

/// Writes the evidence of the shape tracker.
pub(crate) fn evidence(sheet: &mut Sheet, evidence: &ShapeEvidence) {
    sheet.put("why", evidence.why.as_str());
    sheet.put("decides", evidence.is_judged_by_shape);
    sheet.put("reason", evidence.missing.as_deref());
    sheet.optional("surface", evidence.surface.as_ref(), surface);
    sheet.optional("registration", evidence.registration.as_ref(), registration);
    sheet.optional("placement", evidence.placement.as_ref(), placement);
    sheet.optional("view", evidence.view.as_deref(), view);
}

fn surface(sheet: &mut Sheet, surface: &SurfaceSeen) {
    let [found, outside, flat, ambiguous, unconfirmed, speckle, out_of_range] = surface.pixels;
    sheet.put("size", Value::integers(surface.size));
    sheet.put("found", found);
    sheet.put("outside", outside);
    sheet.put("flat", flat);
    sheet.put("ambiguous", ambiguous);
    sheet.put("unconfirmed", unconfirmed);
    sheet.put("speckle", speckle);
    sheet.put("out_of_range", out_of_range);
    sheet.put("vertices", surface.vertices);
    sheet.put("triangles", surface.triangles);
    sheet.put("stride", surface.stride);
    sheet.put("detail_rms_m", surface.detail_rms_m);
    sheet.put("shown_every", surface.shown_every);
}

fn registration(sheet: &mut Sheet, registered: &Registered) {
    let method = match registered.method {
        Method::SimplexL1 => "simplex over absolute differences",
        Method::PointToPlane => "point to plane",
    };
    let [before, coarse, fine] = registered.mean_m;
    sheet.put("to_stop", registered.to_step);
    sheet.put("hand_off", registered.is_hand_off);
    sheet.put("method", method);
    sheet.put("half_width_m", registered.half_width_m);
    sheet.put("sensor_side_m", registered.sensor_side_m);
    sheet.put("start_rover", registered.start_in_rover);
    sheet.put("correction_m", registered.correction_m);
    sheet.put("coarse_shift_m", registered.coarse_shift_m);
    sheet.put("search_m", registered.search_m);
    sheet.put("mean_before_m", before);
    sheet.put("mean_coarse_m", coarse);
    sheet.put("mean_fine_m", fine);
    sheet.put("evaluations", registered.evaluations);
    sheet.put("turn_deg", registered.turn_deg);
    sheet.put("sigmas_m", registered.sigmas_m);
    sheet.optional("ray", registered.ray.as_ref(), |sheet, ray| {
        sheet.put("moved_m", ray.moved_m);
        sheet.put("incidence_deg", ray.incidence_deg);
    });
    sheet.optional("draped", registered.draped.as_ref(), draped);
    sheet.put("draped_missing", registered.draped_missing.as_deref());
    for check in &registered.checks {
        sheet.within(&format!("check.{}", check.name), |sheet| {
            sheet.put("unit", check.unit.as_str());
            sheet.put("value", check.value);
            sheet.put("limit", check.limit);
            sheet.put("side", if check.at_least { "at least" } else { "at most" });
        });
    }
    sheet.put("failed", registered.failure.is_some());
    sheet.put("reason", registered.reason.as_deref());
}

fn draped(sheet: &mut Sheet, draped: &Draped) {
    sheet.put("px", draped.pixel);
    sheet.put("score", draped.score);
    sheet.put("correction_px", draped.correction_px);
    sheet.put("covariance_px2", draped.covariance_px2);
    sheet.put("on_mesh", draped.on_mesh);
}

fn placement(sheet: &mut Sheet, placement: &Placement) {
    sheet.put("reach_m", placement.reach_m);
    sheet.put("reachable", placement.is_reachable);
    sheet.put("touch_rover", placement.touch_in_rover);
    sheet.put("offset_m", placement.offset_m);
    sheet.put("approach_rover", placement.approach_in_rover);
}

fn view(sheet: &mut Sheet, view: &View) {
    sheet.put("stop", view.step);
    sheet.put("position_rover", view.position_in_rover);
    sheet.put("covariance", view.covariance_in_rover);
    sheet.put("ray_origin", view.ray.map(|ray| ray.origin));
    sheet.put("ray_direction", view.ray.map(|ray| ray.direction));
    sheet.put("half_width_m", view.half_width_m);
}
