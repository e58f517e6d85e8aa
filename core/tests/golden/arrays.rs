//! The arrays of a step.

use sightline_core::trace::{ArrayName, StepTrace};

use super::sheet::{Sheet, Value};

/// Every array with the name that it has in golden lists.
const NAMES: [(&str, ArrayName); 21] = [
    ("template_reference", ArrayName::Reference),
    ("template_scaled", ArrayName::Scaled),
    ("template_warped", ArrayName::Rolled),
    ("match_patch", ArrayName::Matched),
    ("match_difference", ArrayName::Difference),
    ("match_scores", ArrayName::Surface),
    ("stereo_patch", ArrayName::RightWindow),
    ("scene_features", ArrayName::Features),
    ("bootstrap_cloud", ArrayName::Cloud),
    ("dense_disparity", ArrayName::Disparities),
    ("dense_range", ArrayName::Ranges),
    ("sensor_depth", ArrayName::Sensor),
    ("depth_error_before", ArrayName::ErrorBefore),
    ("depth_error_coarse", ArrayName::ErrorCoarse),
    ("depth_error_fine", ArrayName::ErrorFine),
    ("coarse_search", ArrayName::CoarseSearch),
    ("refine_path", ArrayName::RefinePath),
    ("mesh_earlier", ArrayName::MeshFixed),
    ("mesh_current", ArrayName::MeshMoving),
    ("draped_picture", ArrayName::Draped),
    ("draped_match", ArrayName::DrapedMatch),
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
        for array in ArrayName::ALL {
            assert_eq!(NAMES.iter().filter(|(_, known)| *known == array).count(), 1, "{array:?}");
        }
    }
}
