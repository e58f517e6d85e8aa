//! The drives of the golden lists: simulated ones, written as scenarios, and excerpts of recorded data.
//!
//! Simulated images are 512 pixels wide with 4 samples per pixel and noise from a fixed seed. The recorded data are not part
//! of the repository: `$SIGHTLINE_DATA` names their folder, by default `../shared/data` beside the workspace.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use sightline_geometry::frames::Pixel;
use sightline_recordings::import::{ImportOptions, import};
use sightline_recordings::{Existing, Traverse, create_simulated};
use sightline_world::{Scenario, choose_targets};

/// Straight towards a rock on a plain, from 9 m to 5.4 m.
const APPROACH: &str = r#"
name = "golden approach"
seed = 7
camera = { image_size = 512, samples_per_axis = 2 }
drive = { start_distance_m = 9.0, end_distance_m = 5.5, step_fraction = 0.12 }
targets = { arrangement = "centre", count = 1, window_px = 11 }
rocks.placed = [{ x_m = 0.0, y_m = 0.0, diameter_m = 1.0, height_m = 0.7, yaw_deg = 200.0, shape = "block" }]
"#;

/// The same from 6 m, with a jump of the estimated heading by 7° at the third stop.
const HEADING_JUMP: &str = r#"
name = "golden heading jump"
seed = 11
camera = { image_size = 512, samples_per_axis = 2 }
drive = { start_distance_m = 6.0, end_distance_m = 4.8, step_fraction = 0.06 }
targets = { arrangement = "centre", count = 1, window_px = 11 }
rocks.placed = [{ x_m = 0.0, y_m = 0.0, diameter_m = 1.0, height_m = 0.7, yaw_deg = 200.0, shape = "block" }]
rover.heading_jumps = [{ stop = 2, yaw_deg = 7.0 }]
"#;

/// The end of the drive of the library's `k9-5`: three stops with the mast cameras, then the front hazcams.
const HAND_OFF: &str = r#"
name = "golden hand-off"
seed = 1
camera = { rig = "table1_pancam", hand_over = "mer_front_hazcam", image_size = 512, samples_per_axis = 2 }
drive = { start_distance_m = 3.3, end_distance_m = 2.4, step_fraction = 0.15 }
targets = { arrangement = "centre" }
rocks.placed = [{ x_m = 0.0, y_m = 0.0, diameter_m = 0.45, height_m = 0.35 }]
"#;

/// A drive of the golden lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DriveName {
    /// Simulated: an undisturbed approach.
    Approach,
    /// The same images; the right image of the third stop is truncated.
    Damaged,
    /// Simulated: the estimated heading jumps.
    HeadingJump,
    /// Simulated: hand-off to other cameras at the last stop.
    HandOff,
    /// Recorded: four frames of a KITTI sequence.
    Street,
    /// Recorded: two views of Opportunity's navcam; each is the left image in turn.
    Opportunity,
    /// Recorded: the same with Spirit's navcam.
    Spirit,
}

/// A drive that is ready to be tracked through.
pub(crate) struct Drive {
    /// Its stops.
    pub(crate) traverse: Traverse,
    /// The designated pixel of the first left image.
    pub(crate) pixel: Pixel,
}

impl DriveName {
    /// All drives.
    pub(crate) const ALL: [Self; 7] = [
        Self::Approach,
        Self::Damaged,
        Self::HeadingJump,
        Self::HandOff,
        Self::Street,
        Self::Opportunity,
        Self::Spirit,
    ];

    /// Makes the drive below `root`.
    ///
    /// # Errors
    /// The folder of the missing recorded data.
    ///
    /// # Panics
    /// If the drive cannot be created although its data exist.
    pub(crate) fn open(self, root: &Path) -> Result<Drive, PathBuf> {
        match self {
            Self::Approach => Ok(simulated(APPROACH, &root.join("approach"))),
            Self::Damaged => Ok(damaged(&root.join("approach"), &root.join("damaged"))),
            Self::HeadingJump => Ok(simulated(HEADING_JUMP, &root.join("heading-jump"))),
            Self::HandOff => Ok(simulated(HAND_OFF, &root.join("hand-off"))),
            Self::Street => {
                let options = ImportOptions { max_stops: 4, ..ImportOptions::default() };
                let source = recorded("kitti-seq1-frames-0-19")?;
                Ok(imported(&source, options, &root.join("street"), Pixel::new(665.0, 186.0)))
            }
            Self::Opportunity => {
                let files = ["1N491020376ILFCNY9P0706L0M1.IMG", "1N491020519ILFCNY9P0706L0M1.IMG"];
                let source = recorded("mer1-navcam-sol4087-pair")?;
                Ok(imported(&source, in_turn(files), &root.join("opportunity"), Pixel::new(850.0, 777.0)))
            }
            Self::Spirit => {
                let files = ["2n292280938effb100p0703l0m1.img", "2n292280989effb100p0703l0m1.img"];
                let source = recorded("mer2-navcam-sol1869")?;
                Ok(imported(&source, in_turn(files), &root.join("spirit"), Pixel::new(852.0, 530.0)))
            }
        }
    }
}

/// The scenario's drive with its images, and the target by the scenario's rule.
fn simulated(scenario: &str, folder: &Path) -> Drive {
    let scenario = Scenario::from_toml(scenario, Path::new("golden.toml")).expect("a valid scenario");
    let traverse = create_simulated(&scenario, folder).expect("a drive from the scenario");
    for step in 0..traverse.stop_count() {
        traverse.capture(step).expect("rendered images");
    }
    let world = traverse.world().expect("a simulated world");
    let pixel = choose_targets(world, &scenario, traverse.index()).first().copied().expect("a target");
    Drive { traverse, pixel }
}

/// The drive in `whole`, created if it is missing, copied, with a damaged image.
fn damaged(whole: &Path, folder: &Path) -> Drive {
    let Drive { traverse, pixel } = simulated(APPROACH, whole);
    let image = traverse.index().stops[2].right.image.clone();
    copy_files(whole, folder);
    let image = folder.join(image);
    let bytes = fs::read(&image).expect("the image that is to be damaged");
    fs::write(&image, &bytes[..bytes.len() / 2]).expect("half of the image");
    Drive { traverse: Traverse::open(folder).expect("the copied drive"), pixel }
}

fn copy_files(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder to copy into");
    for entry in fs::read_dir(from).expect("the folder to copy") {
        let path = entry.expect("an entry of the folder").path();
        let copy = to.join(path.file_name().expect("a file name"));
        if path.is_dir() {
            copy_files(&path, &copy);
        } else {
            fs::copy(&path, &copy).expect("a copy of the file");
        }
    }
}

/// The folder of a recorded data set.
fn recorded(set: &str) -> Result<PathBuf, PathBuf> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let beside = || workspace.join("../shared/data");
    let folder = std::env::var_os("SIGHTLINE_DATA").map_or_else(beside, PathBuf::from).join(set);
    if folder.is_dir() { Ok(folder) } else { Err(folder) }
}

/// Two stops from two views; each view is the left one in turn.
fn in_turn([first, second]: [&str; 2]) -> ImportOptions {
    let files = [first, second, second, first].map(PathBuf::from).to_vec();
    // Each view is written twice, with the same pixels.
    ImportOptions { files, existing: Existing::Replace, ..ImportOptions::default() }
}

fn imported(source: &Path, options: ImportOptions, folder: &Path, pixel: Pixel) -> Drive {
    let never = AtomicBool::new(false);
    import(source, &options, folder, &mut |_, _| {}, &never).expect("the import of recorded data");
    Drive { traverse: Traverse::open(folder).expect("the imported drive"), pixel }
}
