//! Recorded poses of a rover within a site: the master file of the MER operations archive (RVF, XML).
//!
//! A `solution` is the pose of ROVER_FRAME in SITE_FRAME for one state of the rover motion counter (site, drive, arm, mast,
//! antenna; `index1` to `index5`). Site 137 has 160 solutions, in no order of time, one for each state of the counter. Arm,
//! mast and antenna count up while the rover stands, so several states share a drive counter; their poses differ where a
//! better one was found later. [`one_per_drive_counter`] keeps the solution with the latest `add_date`, of equal ones the
//! last state. At site 137 that leaves 131 poses, 23.41 m apart in the level and 23.52 m in space.
//!
//! Frames: SITE_FRAME (x north, y east, z down) and ROVER_FRAME, m; scalar first quaternions. Source: the data's README.

use std::path::Path;

use roxmltree::{Document, Node};

use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pose, PoseRecord};

/// The file within the folder of the data sets.
pub const FILE: &str = "mer2-rover-motion/mer2_site_137_master.rvf";

/// One solution.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedPose {
    /// Site, drive, arm, mast and antenna of the rover motion counter.
    pub counter: [u32; 5],
    /// When it was added, UTC, as in the file: texts of ISO 8601, which sort by time.
    pub added: String,
    /// The pose, SITE_FRAME from ROVER_FRAME, m.
    pub site_from_rover: Pose,
}

impl RecordedPose {
    /// The drive counter.
    pub fn drive(&self) -> u32 {
        self.counter[1]
    }
}

/// Reads the poses at site 137, one for each drive counter, from the folder of the data sets.
///
/// # Errors
/// A file that is missing or damaged.
pub fn read(data: &Path) -> Result<Vec<RecordedPose>> {
    let path = data.join(FILE);
    let text = std::fs::read_to_string(&path).map_err(|source| Error::Read { path: path.clone(), source })?;
    let poses = parse(&text).map_err(|problem| Error::format(&path, problem))?;
    Ok(one_per_drive_counter(poses))
}

/// All solutions of ROVER_FRAME, in the order of the file.
///
/// # Errors
/// A sentence that names the solution and what is wrong with it.
pub fn parse(text: &str) -> Result<Vec<RecordedPose>, String> {
    let document = Document::parse(text).map_err(|error| format!("is no XML: {error}"))?;
    let solutions = document.descendants().filter(|node| node.has_tag_name("solution"));
    solutions.filter(|node| node.attribute("name") == Some("ROVER_FRAME")).map(solution).collect()
}

/// The solution of each drive counter with the latest date, of equal dates the last state; by drive counter.
pub fn one_per_drive_counter(mut poses: Vec<RecordedPose>) -> Vec<RecordedPose> {
    poses.sort_by(|a, b| {
        let drive = |pose: &RecordedPose| [pose.counter[0], pose.counter[1]];
        drive(a).cmp(&drive(b)).then_with(|| b.added.cmp(&a.added)).then_with(|| b.counter.cmp(&a.counter))
    });
    poses.dedup_by_key(|pose| [pose.counter[0], pose.counter[1]]);
    poses
}

/// One solution.
fn solution(node: Node<'_, '_>) -> Result<RecordedPose, String> {
    let mut counter = [0; 5];
    for (place, value) in counter.iter_mut().enumerate() {
        let name = format!("index{}", place + 1);
        // A counter that is left out is zero.
        let Some(text) = node.attribute(name.as_str()) else { continue };
        *value =
            text.parse().map_err(|_| format!("{name} of a solution is {text:?}, which is no counter"))?;
    }
    let number = |element: &str, name: &str| {
        let child = node.children().find(|child| child.has_tag_name(element));
        let value: Option<f64> = child.and_then(|child| child.attribute(name)?.parse().ok());
        value.filter(|value| value.is_finite()).ok_or_else(|| {
            format!("{element} {name} of the solution of counter {counter:?} is missing or no number")
        })
    };
    let pose = PoseRecord {
        position_m: [number("offset", "x")?, number("offset", "y")?, number("offset", "z")?],
        quaternion_sxyz: [
            number("orientation", "s")?,
            number("orientation", "v1")?,
            number("orientation", "v2")?,
            number("orientation", "v3")?,
        ],
    };
    if !pose.is_plausible() {
        return Err(format!("orientation of the solution of counter {counter:?} is not of unit length"));
    }
    let added = node.attribute("add_date").unwrap_or_default().to_owned();
    Ok(RecordedPose { counter, added, site_from_rover: pose.to_pose() })
}
