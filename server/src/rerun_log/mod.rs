//! Rerun recordings of runs, as an `.rrd` file ([`export`]) or live ([`LiveRecording`]).
//!
//! Every entity has one `log_*` function, which `log_step` calls in the order of the stages; the numbers are one table in
//! `scores`. `{target}` is the run's path name: `target_1` for the first run of the first target, `target_1_run_1` for the
//! first run forked from it.
//!
//! Timelines: `step`, the stop from 0, and `time`, the time since the first stop. Rows carry no clock time.
//!
//! **Pixels.** In Sightline, (0, 0) is the centre of the first pixel, in rerun's 2-D space its top left corner: only
//! `convert` adds the half pixel. **Frames.** Space is the site frame (x north, y east, z down), declared once at the root;
//! entities below `/rover/pose` are in the rover frame.
//!
//! **Every step has a row.** If a stage was not reached, its entities get a `Clear`, because a viewer would continue to show
//! the last step's data; a missing number is a gap in its line.
//!
//! **Further cameras** have the same entities as the main pair below their names: `/rover/pose/{camera}/left` and `right` at
//! every stop that has the camera; `/capture/{camera}/left` and `right` at stops where a target is tracked in it, and at
//! other stops with a step if the images already exist. Overlays of a run in such a pair, and the corners of odometry, are
//! below the pair's images: `/capture/{camera}/left/odometry/{before, after, flow}`.
//!
//! | path | archetype | when |
//! |---|---|---|
//! | `/` | `ViewCoordinates` | once |
//! | `/traverse` | `TextDocument` | once |
//! | `/rover/path` | `LineStrips3D` | once |
//! | `/rover/pose` | `Transform3D`, static `TransformAxes3D` | every stop |
//! | `/rover/pose/left` | `LineStrips3D` | every stop |
//! | `/rover/pose/right` | `LineStrips3D` | every stop |
//! | `/capture/left` | `EncodedImage` | the stop's files are whole |
//! | `/capture/right` | `EncodedImage` | the stop's files are whole |
//! | `/capture/left/odometry/before` | `Points2D` | the stop has odometry in the main pair |
//! | `/capture/left/odometry/after` | `Points2D` | the stop has odometry in the main pair |
//! | `/capture/left/odometry/flow` | `LineStrips2D` | the stop has odometry in the main pair |
//! | `/{target}` | `TextDocument` | once |
//! | `/{target}/predict/position` | `Points3D` | predicted |
//! | `/{target}/predict/covariance` | `Ellipsoids3D` | predicted |
//! | `/{target}/predict/left` | `Points2D` | predicted in front of the left camera |
//! | `/{target}/predict/right` | `Points2D` | predicted in front of the right camera |
//! | `/{target}/point_mast/gate` | `LineStrips2D` | predicted in front of the left camera |
//! | `/{target}/capture/subframe` | `Boxes2D` | the subframe lies in the image |
//! | `/{target}/capture/frame` | `Transform3D` | the subframe lies in the image |
//! | `/{target}/locate/scale_roll/footprint` | `LineStrips2D` | prepared |
//! | `/{target}/locate/scale_roll/reference` | `DepthImage` | prepared |
//! | `/{target}/locate/scale_roll/scaled` | `DepthImage` | prepared |
//! | `/{target}/locate/scale_roll/rolled` | `DepthImage` | prepared |
//! | `/{target}/locate/match_template/window` | `Boxes2D` | matched |
//! | `/{target}/locate/match_template/surface` | `DepthImage` | matched |
//! | `/{target}/locate/match_template/surface/peak` | `Points2D` | matched |
//! | `/{target}/locate/match_template/surface/second_peak` | `Points2D` | there is a second peak |
//! | `/{target}/locate/match_template/peak` | `Points2D` | matched |
//! | `/{target}/locate/match_template/second_peak` | `Points2D` | there is a second peak |
//! | `/{target}/locate/match_template/matched_window` | `LineStrips2D` | matched |
//! | `/{target}/locate/match_template/matched` | `DepthImage` | matched |
//! | `/{target}/locate/match_template/difference` | `Image` | matched |
//! | `/{target}/locate/point_stereo/curve` | `LineStrips2D` | stereo matched |
//! | `/{target}/locate/point_stereo/match` | `Points2D` | stereo matched |
//! | `/{target}/locate/point_stereo/right_window` | `DepthImage` | stereo matched |
//! | `/{target}/locate/triangulate/position` | `Points3D` | triangulated |
//! | `/{target}/locate/triangulate/covariance` | `Ellipsoids3D` | triangulated |
//! | `/{target}/locate/detect/keypoints` | `Points2D` | features were looked for |
//! | `/{target}/locate/match_features/partners` | `Points2D` | features were looked for |
//! | `/{target}/locate/triangulate/points` | `Points3D` | features were looked for |
//! | `/{target}/locate/match_features/inliers` | `LineStrips2D` | a motion was fitted |
//! | `/{target}/locate/match_features/outliers` | `LineStrips2D` | a motion was fitted |
//! | `/{target}/locate/fit_motion/residuals` | `Arrows2D` | a motion was fitted |
//! | `/{target}/locate/bootstrap/cloud` | `Points3D` | the motion has a covariance |
//! | `/{target}/locate/bootstrap/left` | `Points2D` | the motion has a covariance |
//! | `/{target}/locate/bootstrap/position` | `Points3D` | the target was moved |
//! | `/{target}/locate/bootstrap/covariance` | `Ellipsoids3D` | the target was moved |
//! | `/{target}/locate/surface/disparities` | `DepthImage` | a surface was measured |
//! | `/{target}/locate/surface/ranges` | `DepthImage` | a surface was measured |
//! | `/{target}/locate/coarse_register/sensor` | `DepthImage` | surfaces were compared |
//! | `/{target}/locate/coarse_register/error_before` | `Image` | surfaces were compared |
//! | `/{target}/locate/coarse_register/coarse_search` | `DepthImage` | shifts were searched |
//! | `/{target}/locate/coarse_register/coarse_search/best` | `Points2D` | a shift was found |
//! | `/{target}/locate/coarse_register/error_coarse` | `Image` | surfaces were compared |
//! | `/{target}/locate/refine_register/error_fine` | `Image` | surfaces were compared |
//! | `/{target}/locate/refine_register/mesh_fixed` | `Mesh3D` | registered to an earlier mesh |
//! | `/{target}/locate/refine_register/mesh_moving` | `Mesh3D` | there is a present mesh |
//! | `/{target}/locate/refine_register/position` | `Points3D` | the registration is used |
//! | `/{target}/locate/refine_register/covariance` | `Ellipsoids3D` | the registration is used |
//! | `/{target}/locate/hand_off/draped` | `DepthImage` | the last picture was found at a hand-off |
//! | `/{target}/locate/hand_off/draped_match` | `DepthImage` | the last picture was found at a hand-off |
//! | `/{target}/locate/hand_off/touch` | `Points3D` | the arm can touch the surface near the target |
//! | `/{target}/locate/left_covariance` | `LineStrips2D` | designated or located |
//! | `/{target}/judge/state` | `StateChange`, static `StateConfiguration` | always |
//! | `/{target}/judge/verdict` | `TextLog` | always |
//! | `/{target}/update/position` | `Points3D` | always |
//! | `/truth/{target}/left` | `LineStrips2D` | the truth is visible |
//! | `/truth/{target}/position` | `Points3D` | the truth is known |
//! | `/{target}/point_mast/wanted_azimuth_deg` | `Scalars`, static `SeriesLines` | there is a mast and it reaches |
//! | `/{target}/point_mast/wanted_elevation_deg` | `Scalars`, static `SeriesLines` | there is a mast and it reaches |
//! | `/{target}/point_mast/used_azimuth_deg` | `Scalars`, static `SeriesLines` | there is a mast |
//! | `/{target}/point_mast/used_elevation_deg` | `Scalars`, static `SeriesLines` | there is a mast |
//! | `/{target}/capture/subframe_mean` | `Scalars`, static `SeriesLines` | the subframe lies in the image |
//! | `/{target}/capture/subframe_saturated` | `Scalars`, static `SeriesLines` | the subframe lies in the image |
//! | `/{target}/locate/scale_roll/scale` | `Scalars`, static `SeriesLines` | prepared |
//! | `/{target}/locate/scale_roll/roll_deg` | `Scalars`, static `SeriesLines` | prepared |
//! | `/{target}/locate/match_template/second_peak_ratio` | `Scalars`, static `SeriesLines` | there is a second peak |
//! | `/{target}/locate/point_stereo/range_m` | `Scalars`, static `SeriesLines` | stereo matched |
//! | `/{target}/locate/point_stereo/across_px` | `Scalars`, static `SeriesLines` | stereo matched |
//! | `/{target}/locate/triangulate/gap_px` | `Scalars`, static `SeriesLines` | triangulated |
//! | `/{target}/locate/fit_motion/inliers` | `Scalars`, static `SeriesLines` | a motion was fitted |
//! | `/{target}/locate/coarse_register/mean_m` | `Scalars`, static `SeriesLines` | shifts were searched and surfaces overlap |
//! | `/{target}/locate/refine_register/mean_m` | `Scalars`, static `SeriesLines` | surfaces were compared |
//! | `/{target}/locate/refine_register/overlap` | `Scalars`, static `SeriesLines` | surfaces were compared |
//! | `/{target}/locate/refine_register/overlap/limit` | `Scalars`, static `SeriesLines` | registered |
//! | `/{target}/locate/refine_register/misfit` | `Scalars`, static `SeriesLines` | surfaces were compared |
//! | `/{target}/locate/refine_register/misfit/limit` | `Scalars`, static `SeriesLines` | registered |
//! | `/{target}/locate/refine_register/sigma_m` | `Scalars`, static `SeriesLines` | the shape holds the target |
//! | `/{target}/locate/refine_register/sigma_m/limit` | `Scalars`, static `SeriesLines` | registered |
//! | `/{target}/locate/hand_off/score` | `Scalars`, static `SeriesLines` | the last picture was found at a hand-off |
//! | `/{target}/judge/ncc` | `Scalars`, static `SeriesLines` | judged and matched |
//! | `/{target}/judge/ncc/limit` | `Scalars`, static `SeriesLines` | judged |
//! | `/{target}/judge/stereo_ncc` | `Scalars`, static `SeriesLines` | judged and stereo matched |
//! | `/{target}/judge/stereo_ncc/limit` | `Scalars`, static `SeriesLines` | judged |
//! | `/{target}/judge/distance_correction_m` | `Scalars`, static `SeriesLines` | judged and triangulated |
//! | `/{target}/judge/distance_correction_m/limit` | `Scalars`, static `SeriesLines` | judged |
//! | `/{target}/judge/position_correction_m` | `Scalars`, static `SeriesLines` | judged and triangulated |
//! | `/{target}/judge/position_correction_m/limit` | `Scalars`, static `SeriesLines` | judged |
//! | `/{target}/judge/confidence` | `Scalars`, static `SeriesLines` | judged by confidence and located |
//! | `/{target}/judge/confidence/limit` | `Scalars`, static `SeriesLines` | judged by confidence |
//! | `/{target}/update/sigma_m` | `Scalars`, static `SeriesLines` | always |
//! | `/{target}/update/correction_px` | `Scalars`, static `SeriesLines` | matched and predicted in the left image |
//! | `/{target}/update/correction_m` | `Scalars`, static `SeriesLines` | triangulated |
//! | `/truth/{target}/err_px` | `Scalars`, static `SeriesLines` | matched and the truth is visible |
//! | `/truth/{target}/tolerance_px` | `Scalars`, static `SeriesLines` | the truth is known |
//! | `/truth/{target}/err_m` | `Scalars`, static `SeriesLines` | the truth is known |
//! | `/truth/{target}/nees` | `Scalars`, static `SeriesLines` | the truth is known and there is a covariance |
//!
//! A commanded drive also has `/drive/…`, one row for each decision (`drive`).
//!
//! In addition, `/{target}/record/{stage}/{quantity}` contains every number declared by a stage, as `Scalars`.

mod blueprint;
mod convert;
mod drive;
mod entities;
mod export;
mod features;
mod images;
mod layout;
mod live;
mod map;
mod memory;
mod odometry;
pub(crate) mod page;
mod palette;
mod properties;
mod recorder;
mod scores;
mod shape;
mod states;
mod step;
mod score_map;
mod templates;

use rerun::{RecordingStream, RecordingStreamResult};
use sightline_rover::pipeline::Stops;
use sightline_session::step::RunStep;

pub use drive::DriveLog;
pub use entities::{EntityDoc, Rows, documented_entities, entities_of, shared_entities};
pub use export::export;
pub use live::LiveRecording;
pub use recorder::RunLog;

use scores::SCORES;
use step::Step;

/// The result of passing a row to rerun.
type Logged = RecordingStreamResult<()>;

/// The name of a run in entity paths; both indices start at 0.
pub fn root(target: usize, run: usize) -> String {
    match run {
        0 => format!("target_{}", target + 1),
        run => format!("target_{}_run_{run}", target + 1),
    }
}

/// Logs the data of a stop that are independent of runs.
fn log_stop(stream: &RecordingStream, stops: &dyn Stops, step: usize) -> Logged {
    map::log_pose(stream, stops, step)?;
    map::log_left_frustum(stream, stops, step)?;
    map::log_right_frustum(stream, stops, step)?;
    map::log_further_frusta(stream, stops, step)
}

/// Logs the odometry of a stop, independent of runs, over the pair that measured it.
fn log_odometry(stream: &RecordingStream, stops: &dyn Stops, trace: &RunStep) -> Logged {
    let corners = odometry::corners(stops, trace);
    let camera = trace.odometry.as_ref().and_then(|measured| measured.camera);
    let mut cameras = odometry::cameras(stops);
    cameras.insert(None);
    cameras
        .into_iter()
        .try_for_each(|known| odometry::log(stream, known, corners.as_deref().filter(|_| known == camera)))
}

/// Logs one step of a run, stage by stage; the images only for the first run of its pair at this stop.
fn log_step(step: &Step<'_>, is_first_here: bool) -> Logged {
    map::log_predicted_position(step)?;
    map::log_predicted_covariance(step)?;
    images::log_predicted_left(step)?;
    images::log_predicted_right(step)?;

    images::log_gate(step)?;

    if is_first_here {
        images::log_left_image(step)?;
        images::log_right_image(step)?;
    }
    images::log_subframe(step)?;
    images::log_subframe_frame(step)?;

    images::log_footprint(step)?;
    templates::log_reference(step)?;
    templates::log_scaled(step)?;
    templates::log_rolled(step)?;
    images::log_search_window(step)?;
    score_map::log_score_map(step)?;
    score_map::log_score_map_peak(step)?;
    score_map::log_score_map_second_peak(step)?;
    images::log_peak(step)?;
    images::log_second_peak(step)?;
    images::log_matched_window(step)?;
    templates::log_matched(step)?;
    templates::log_difference(step)?;
    images::log_curve(step)?;
    images::log_right_match(step)?;
    templates::log_right_window(step)?;
    map::log_triangulated_position(step)?;
    map::log_triangulated_covariance(step)?;
    features::log_keypoints(step)?;
    features::log_partners(step)?;
    features::log_points(step)?;
    features::log_inliers(step)?;
    features::log_outliers(step)?;
    features::log_residuals(step)?;
    features::log_cloud(step)?;
    features::log_cloud_left(step)?;
    map::log_moved_position(step)?;
    map::log_moved_covariance(step)?;
    log_shape(step)?;
    images::log_left_covariance(step)?;

    states::log_state(step)?;
    states::log_verdict(step)?;

    map::log_position(step)?;

    images::log_true_left(step)?;
    map::log_true_position(step)?;

    SCORES.iter().try_for_each(|score| scores::log_score(step, score))?;
    scores::log_declared(step)
}

/// Logs the stages of the shape tracker.
fn log_shape(step: &Step<'_>) -> Logged {
    shape::log_disparities(step)?;
    shape::log_ranges(step)?;
    shape::log_sensor(step)?;
    shape::log_error_before(step)?;
    shape::log_coarse_search(step)?;
    shape::log_coarse_best(step)?;
    shape::log_error_coarse(step)?;
    shape::log_error_fine(step)?;
    shape::log_mesh_fixed(step)?;
    shape::log_mesh_moving(step)?;
    shape::log_position(step)?;
    shape::log_covariance(step)?;
    shape::log_draped(step)?;
    shape::log_draped_match(step)?;
    shape::log_touch(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The entity as a row of the table: path, archetype, when.
    fn table_row(doc: &EntityDoc) -> String {
        let when = match doc.rows {
            Rows::Once => "once",
            Rows::EachStop => "every stop",
            Rows::EachStep { when, .. } | Rows::EachScore { when, .. } => when,
        };
        let style = doc.style.map(|style| format!(", static `{style}`")).unwrap_or_default();
        format!("| `{}` | `{}`{style} | {when} |", doc.path, doc.archetype)
    }

    #[test]
    fn the_table_of_this_file_lists_every_entity() {
        let own = entities_of("{target}");
        // One rule below the table describes the numbers declared by stages.
        let own = own.iter().filter(|doc| !doc.path.contains("/record/"));
        let shared = shared_entities();
        let rows: Vec<_> = shared.iter().chain(own).map(table_row).collect();
        let header: Vec<_> = include_str!("mod.rs")
            .lines()
            .filter_map(|line| line.strip_prefix("//! "))
            .filter(|l| l.starts_with("| `"))
            .collect();
        assert_eq!(header, rows, "put these rows in the header:\n//! {}", rows.join("\n//! "));
    }

    #[test]
    fn runs_are_distinguished_by_their_names() {
        assert_eq!(root(0, 0), "target_1");
        assert_eq!(root(2, 1), "target_3_run_1");
    }
}
