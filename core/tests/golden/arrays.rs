//! The arrays of a step.

use sightline_track::trace::{ArrayName, StepTrace};

use super::sheet::{Sheet, Value};

/// The arrays whose name in golden lists differs from the one in the record.
const NAMES: [(&str, ArrayName); 21] = [
    ("template_reference", ArrayName::REFERENCE),
    ("template_scaled", ArrayName::SCALED),
    ("template_warped", ArrayName::ROLLED),
    ("match_patch", ArrayName::MATCHED),
    ("match_difference", ArrayName::DIFFERENCE),
    ("match_scores", ArrayName::SURFACE),
    ("stereo_patch", ArrayName::RIGHT_WINDOW),
    ("scene_features", ArrayName::FEATURES),
    ("bootstrap_cloud", ArrayName::CLOUD),
    ("dense_disparity", ArrayName::DISPARITIES),
    ("dense_range", ArrayName::RANGES),
    ("sensor_depth", ArrayName::SENSOR),
    ("depth_error_before", ArrayName::ERROR_BEFORE),
    ("depth_error_coarse", ArrayName::ERROR_COARSE),
    ("depth_error_fine", ArrayName::ERROR_FINE),
    ("coarse_search", ArrayName::COARSE_SEARCH),
    ("refine_path", ArrayName::REFINE_PATH),
    ("mesh_earlier", ArrayName::MESH_FIXED),
    ("mesh_current", ArrayName::MESH_MOVING),
    ("draped_picture", ArrayName::DRAPED),
    ("draped_match", ArrayName::DRAPED_MATCH),
];

/// Writes a line with the names of the step's arrays, then the arrays.
pub(crate) fn all(sheet: &mut Sheet, trace: &StepTrace) {
    let is_named = |array: &ArrayName| NAMES.iter().any(|(_, known)| known == array);
    let others = ArrayName::all().filter(|array| !is_named(array)).map(|array| (array.word(), array));
    let all: Vec<(&str, ArrayName)> = NAMES.into_iter().chain(others).collect();
    let present = || all.iter().filter_map(|(name, array)| Some((*name, trace.array(*array)?)));
    let names: Vec<&str> = present().map(|(name, _)| name).collect();
    sheet.within("array", |sheet| {
        sheet.put("names", Value::from(names.join(" ")));
        for (name, array) in present() {
            sheet.array(name, &array.size().map(|side| side as usize), array.values());
        }
    });
}
