//! `sightline info`: prints a summary of a traverse.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use sightline_geometry::camera::{CameraModel, CameraName};
use sightline_geometry::error::Result;
use sightline_geometry::frames::PoseRecord;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_recordings::Traverse;
use sightline_world::traverse::Stop;

use super::{open, terminal};
use crate::printable::printable;

/// Print the contents of a traverse.
#[derive(Debug, Args)]
pub(super) struct Info {
    /// The traverse: a folder, an index or a scenario.
    traverse: PathBuf,
}

impl Info {
    /// Writes the summary.
    ///
    /// # Errors
    /// A traverse that cannot be opened.
    pub(super) fn run(self) -> Result<()> {
        let traverse = open::open(&self.traverse, None)?;
        // Names come from the file and could contain control characters.
        summary(&traverse).iter().try_for_each(|line| terminal::line(&printable(line)))
    }
}

fn summary(traverse: &Traverse) -> Vec<String> {
    let index = traverse.index();
    let count = traverse.stop_count();
    let mut lines = vec![format!("name         {}", index.name)];
    if !index.description.is_empty() {
        lines.push(format!("description  {}", index.description));
    }
    lines.push(format!("folder       {}", traverse.folder().display()));
    let duration_s = index.stops.last().map_or(0.0, |stop| stop.time_s);
    let driven_m = driven_m(&index.stops);
    lines.push(format!("stops        {count}, {driven_m:.2} m driven by the estimates, {duration_s:.0} s"));
    lines.push(format!("left camera  {}", camera(traverse, true)));
    lines.push(format!("right camera {}", camera(traverse, false)));
    lines.extend(further(traverse));
    let stereo = match index.stereo {
        StereoGeometry::Lateral => "lateral: two eyes side by side",
        StereoGeometry::Convergent => "convergent: two freely placed views",
    };
    lines.push(format!("stereo       {stereo}, base {:.3} m at the first stop", base_m(traverse)));
    lines.push(format!("mast         {}", if index.mast.is_some() { "known" } else { "not known" }));
    let error = index.odometry_error;
    lines.push(format!(
        "odometry     1σ {:.2} % along, {:.2} % across, {:.2}° a step",
        100.0 * error.along_fraction,
        100.0 * error.across_fraction,
        error.attitude_deg
    ));
    if index.pointing_error_deg > 0.0 {
        lines.push(format!("pointing     1σ {:.3}° of each mast angle", index.pointing_error_deg));
    }
    lines.push(format!("truth        {}", truth(traverse)));
    lines.push(format!("images       {}", images(traverse)));
    lines.extend(traverse.warnings().iter().map(|warning| format!("warning      {warning}")));
    lines
}

fn camera(traverse: &Traverse, is_left: bool) -> String {
    let of = |step| if is_left { traverse.left_camera(step) } else { traverse.right_camera(step) };
    let [width, height] = of(0).size;
    let is_constant = (1..traverse.stop_count()).all(|step| of(step) == of(0));
    let moves = if is_constant { "the same at all stops" } else { "moves with the mast" };
    let model = match of(0).model {
        CameraModel::Cahv(_) => "CAHV",
        CameraModel::Cahvor(_) => "CAHVOR",
        CameraModel::Cahvore(_) => "CAHVORE",
    };
    format!("{model}, {width} × {height} px, {moves}")
}

/// One line for each name of a further camera.
fn further(traverse: &Traverse) -> Vec<String> {
    let count = traverse.stop_count();
    let mut found: BTreeMap<CameraName, (usize, String)> = BTreeMap::new();
    for camera in (0..count).flat_map(|step| traverse.further_cameras(step)) {
        let [width, height] = camera.left.size;
        let kind = if camera.right.is_some() { "pair" } else { "single camera" };
        let mount = if camera.mast_angles.is_some() { "on the mast" } else { "on the body" };
        let words = format!("{kind} of {width} × {height} px {mount}");
        found.entry(camera.name).or_insert((0, words)).0 += 1;
    }
    let line = |(name, (stops, words)): (CameraName, (usize, String))| {
        let at =
            if stops == count { "at all stops".to_owned() } else { format!("at {stops} of {count} stops") };
        format!("camera       {name}: {words}, {at}")
    };
    found.into_iter().map(line).collect()
}

fn base_m(traverse: &Traverse) -> f64 {
    (traverse.right_camera(0).model.centre() - traverse.left_camera(0).model.centre()).norm()
}

fn truth(traverse: &Traverse) -> String {
    let stops = &traverse.index().stops;
    let known = stops.iter().filter(|stop| stop.truth.is_some()).count();
    match (known, traverse.index().scenario.is_some()) {
        (0, _) => "none: nothing can be compared".to_owned(),
        (_, true) => "poses, cameras and surface: the traverse is simulated".to_owned(),
        (known, false) => format!("poses of {known} of {} stops: what is compared is the drift", stops.len()),
    }
}

fn images(traverse: &Traverse) -> String {
    let stops = &traverse.index().stops;
    let is_there = |name: &str| traverse.folder().join(name).is_file();
    let missing: Vec<_> =
        stops.iter().flat_map(Stop::views).map(|view| &view.image).filter(|name| !is_there(name)).collect();
    let all = stops.iter().flat_map(Stop::views).count();
    match (missing.as_slice(), traverse.index().scenario.is_some()) {
        ([], _) => format!("all {all} there"),
        (missing, true) => format!("{} of {all} not rendered yet; rendered on demand", missing.len()),
        (missing, false) => {
            let names: Vec<_> = missing.iter().take(10).map(|name| name.as_str()).collect();
            let more = if missing.len() > names.len() { ", …" } else { "" };
            format!("{} of {all} missing: {}{more}", missing.len(), names.join(", "))
        }
    }
}

/// Length of the estimated path, m.
fn driven_m(stops: &[Stop]) -> f64 {
    let steps = stops.windows(2).map(|pair| between_m(&pair[0].site_from_rover, &pair[1].site_from_rover));
    // The sum of no numbers is −0.0.
    steps.sum::<f64>().abs()
}

fn between_m(a: &PoseRecord, b: &PoseRecord) -> f64 {
    let difference = a.position_m.iter().zip(&b.position_m).map(|(a, b)| (a - b) * (a - b));
    difference.sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_of_one_stop_has_no_negative_length() {
        assert_eq!(format!("{:.2}", driven_m(&[])), "0.00");
    }
}
