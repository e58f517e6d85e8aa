//! The arrays of a step.

use sightline_track::trace::{ArrayName, StepTrace};

use super::sheet::{Sheet, Value};

/// Every array with the name that it has in golden lists.
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

/// Writes the arrays that the step has, after their names on one line.
pub(crate) fn all(sheet: &mut Sheet, trace: &StepTrace) {
    let present = || NAMES.iter().filter_map(|(name, array)| Some((*name, trace.array(*array)?)));
    let names: Vec<&str> = present().map(|(name, _)| name).collect();
    sheet.within("array", |sheet| {
        sheet.put("names", Value::from(names.join(" ")));
        for (name, array) in present() {
            sheet.array(name, &array.size().map(|side| side as usize), array.values());
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_array_has_a_name() {
        for array in ArrayName::all() {
            assert_eq!(NAMES.iter().filter(|(_, known)| *known == array).count(), 1, "{array:?}");
        }
    }
}
