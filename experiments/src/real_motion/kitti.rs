//! The excerpt of a KITTI sequence, read as its importer reads it (`traverse::import::kitti`).

use std::path::Path;

use super::{Frame, Recording, Set, pair};
use sightline_geometry::error::Result;
use sightline_geometry::frames::Point3;
use sightline_recordings::import::kitti::{read_cameras, read_poses};
use sightline_vision::image::io::read_png;

const FOLDER: &str = "kitti-seq1-frames-0-19";

/// Its first frames, at most so many; each with the next one, and every third with the third after it.
pub(super) fn read(data: &Path, frames_max: usize) -> Result<Recording> {
    let folder = data.join(FOLDER);
    let read = |(number, world_from_rig)| {
        let image = |eye: &str| read_png(folder.join(eye).join(format!("{number:06}.png")), None);
        Ok(Frame {
            name: format!("{number}"),
            pair: pair(image("image_0")?, image("image_1")?),
            world_from_rig,
            about_in_rig: Point3::origin(),
            outline: None,
        })
    };
    let poses = read_poses(&folder.join("poses.txt"))?;
    let frames: Vec<Frame> =
        poses.into_iter().enumerate().take(frames_max).map(read).collect::<Result<_>>()?;
    let size = frames.first().map(|frame| frame.pair.left.dimensions().into()).unwrap_or_default();
    let next = (1..frames.len()).map(|now| (Set::KittiEveryFrame, now - 1, now));
    let third = (3..frames.len()).step_by(3).map(|now| (Set::KittiEveryThird, now - 3, now));
    let pairs = next.chain(third).collect();
    Ok(Recording {
        cameras: read_cameras(&folder.join("calib.txt"), size)?,
        frames,
        pairs,
        range_min_m: None,
    })
}
