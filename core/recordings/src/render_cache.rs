//! Clean radiance stored on disk, so that a change of exposure, detector or noise needs no rendering.
//!
//! The file of an image is `<key>.npy`, with the digest of its bytes after the array:
//!
//! ```text
//! key     = SHA-256 of (sources of the renderer, scenario without fields that do not affect the radiance,
//!           moment of the drive, camera in the site), as JSON with exact numbers
//! file    = .npy array of f32 (rows from the top), then the 32 bytes of its SHA-256
//! ```
//!
//! The key omits the name, the pose estimate's error, the rule for targets, and the exposure, the detector and the
//! noise of the camera; a setting that is added later is in the key until it is omitted here. A file that is
//! truncated, changed, or of another size is not used. Another compiler or processor may render other bits from the
//! same sources: the user of the cache checks this by rendering a few pixels again.
//!
//! Files are written under a temporary name and renamed, so several processes can share a folder: they write the same
//! bytes. If the folder exceeds its limit, the oldest files are removed. A folder that cannot be written costs only
//! time. Only names of 64 hexadecimal digits are touched.
//!
//! Units: radiance as in `world/src/light/reflection.rs`; sizes in bytes. Source: ours.

use std::path::{Path, PathBuf};

use serde::Serialize;
use sha2::{Digest, Sha256};

use super::files::write_atomically;
use sightline_geometry::camera::Camera;
use sightline_vision::image::{GrayImage, npy};
use sightline_world::Scenario;
use sightline_world::scenario::RoverSettings;

/// Name of the cache folder within the folder of a traverse.
pub(crate) const CACHE_FOLDER: &str = "cache";
/// Limit of a traverse's own cache on disk, bytes: 128 images of 1024 × 1024.
pub(crate) const RENDER_LIMIT_BYTES: u64 = 512 << 20;

/// Digest of the sources of the renderer, from the build script.
const SOURCES: &str = env!("SIGHTLINE_RENDERER_SOURCES");

/// Bytes of a digest.
const DIGEST_BYTES: usize = 32;

/// A folder of clean radiance images.
#[derive(Clone, Debug)]
pub struct RenderCache {
    folder: PathBuf,
    limit_bytes: u64,
}

impl RenderCache {
    /// A cache in `folder`, which is created on the first write; a limit of 0 keeps nothing.
    pub fn new(folder: impl Into<PathBuf>, limit_bytes: u64) -> Self {
        Self { folder: folder.into(), limit_bytes }
    }

    /// The cache of a traverse in its own folder.
    pub(super) fn of_traverse(folder: &Path) -> Self {
        // A link to another folder is not followed: an index may come from an untrusted source.
        let limit = if super::files::resolve(folder, CACHE_FOLDER).is_ok() { RENDER_LIMIT_BYTES } else { 0 };
        Self::new(folder.join(CACHE_FOLDER), limit)
    }

    /// The image of this key, if it exists, is complete, and has the camera's size.
    pub(super) fn load(&self, key: &str, camera: &Camera) -> Option<GrayImage> {
        let path = self.path(key);
        let pixels = u64::from(camera.width()) * u64::from(camera.height());
        // A file far larger than the image is not read at all.
        if self.limit_bytes == 0 || std::fs::metadata(&path).ok()?.len() > 4 * pixels + 4096 {
            return None;
        }
        let file = std::fs::read(&path).ok()?;
        let (array, digest) = file.split_at_checked(file.len().checked_sub(DIGEST_BYTES)?)?;
        if Sha256::digest(array).as_slice() != digest {
            return None;
        }
        npy::decode(array, &path)
            .ok()
            .filter(|picture| picture.dimensions() == (camera.width(), camera.height()))
    }

    /// Stores an image, and removes the oldest ones beyond the limit.
    pub(super) fn store(&self, key: &str, picture: &GrayImage) {
        let Ok(mut file) = npy::encode(picture) else { return };
        let digest = Sha256::digest(&file);
        file.extend_from_slice(digest.as_slice());
        if file.len() as u64 <= self.limit_bytes && write_atomically(&self.path(key), &file).is_ok() {
            self.remove_oldest();
        }
    }

    fn path(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.npy"))
    }

    /// Removes the oldest files until the rest fits into the limit.
    fn remove_oldest(&self) {
        let Ok(entries) = std::fs::read_dir(&self.folder) else { return };
        let mut files: Vec<_> = entries
            .flatten()
            .filter(|entry| is_ours(&entry.file_name().to_string_lossy()))
            .filter_map(|entry| {
                let metadata = entry.metadata().ok()?;
                Some((metadata.modified().ok()?, entry.path(), metadata.len()))
            })
            .collect();
        files.sort();
        let mut total: u64 = files.iter().map(|(_, _, bytes)| bytes).sum();
        for (_, path, bytes) in files {
            if total <= self.limit_bytes {
                break;
            }
            // Another process may have removed it already.
            let _ = std::fs::remove_file(path);
            total -= bytes;
        }
    }
}

/// Whether a file belongs to a cache, complete or left behind by a process that was killed while writing.
fn is_ours(name: &str) -> bool {
    let mut parts = name.trim_start_matches('.').split('.');
    let digits = parts.next().unwrap_or_default();
    let is_key = digits.len() == 2 * DIGEST_BYTES && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_key && parts.next() == Some("npy")
}

/// The key of an image's clean radiance, 64 hexadecimal digits; `moment`: the state of its stop besides the camera
/// (number, time, true pose).
pub(super) fn key(scenario: &Scenario, moment: &impl Serialize, camera_in_site: &Camera) -> String {
    key_of(SOURCES, scenario, moment, camera_in_site)
}

/// The key of an image rendered by these sources.
fn key_of(sources: &str, scenario: &Scenario, moment: &impl Serialize, camera_in_site: &Camera) -> String {
    let default = Scenario::default();
    let of_radiance = Scenario {
        name: String::new(),
        description: String::new(),
        odometry_error: default.odometry_error,
        targets: default.targets,
        camera: scenario.camera.of_radiance(),
        rover: RoverSettings { heading_jumps: Vec::new(), ..scenario.rover.clone() },
        ..scenario.clone()
    };
    let all = (sources, of_radiance, moment, camera_in_site);
    // All values are plain numbers and names, which JSON can always write.
    let text = serde_json::to_vec(&all).unwrap_or_default();
    Sha256::digest(&text).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::camera::Mast;
    use sightline_world::scenario::{CameraRig, ExposureMode, HeadingJump, Quantisation};

    fn camera() -> Camera {
        Mast::spirit().left_in_head.downsampled(64)
    }

    fn picture(value: f32) -> GrayImage {
        GrayImage::from_fn(16, 16, |x, y| image::Luma([value + 1e-7 * x as f32 + y as f32]))
    }

    fn keys() -> [String; 3] {
        [1, 2, 3].map(|seed| key(&Scenario { seed, ..Scenario::demo() }, &0, &camera()))
    }

    #[test]
    fn a_picture_comes_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let cache = RenderCache::new(folder.path().join("deep/cache"), 1 << 20);
        let [one, two, _] = keys();
        assert!(cache.load(&one, &camera()).is_none());
        cache.store(&one, &picture(0.1));
        assert_eq!(cache.load(&one, &camera()).unwrap(), picture(0.1));
        assert!(cache.load(&two, &camera()).is_none());
        assert!(cache.load(&one, &Mast::spirit().left_in_head).is_none());
    }

    #[test]
    fn a_damaged_file_is_not_used() {
        let folder = tempfile::tempdir().unwrap();
        let cache = RenderCache::new(folder.path(), 1 << 20);
        let [one, ..] = keys();
        cache.store(&one, &picture(0.1));
        let whole = std::fs::read(cache.path(&one)).unwrap();
        for at in [0, 90, 300, whole.len() - 1] {
            let mut damaged = whole.clone();
            damaged[at] ^= 1;
            std::fs::write(cache.path(&one), damaged).unwrap();
            assert!(cache.load(&one, &camera()).is_none(), "byte {at}");
        }
        for length in [0, 31, 32, whole.len() - 4] {
            std::fs::write(cache.path(&one), &whole[..length]).unwrap();
            assert!(cache.load(&one, &camera()).is_none(), "{length} bytes");
        }
        std::fs::write(cache.path(&one), &whole).unwrap();
        assert!(cache.load(&one, &camera()).is_some());
    }

    #[test]
    fn beyond_the_limit_the_oldest_go_first_and_strangers_stay() {
        let folder = tempfile::tempdir().unwrap();
        let [one, two, three] = keys();
        RenderCache::new(folder.path(), 1 << 20).store(&one, &picture(0.1));
        let bytes = std::fs::metadata(folder.path().join(format!("{one}.npy"))).unwrap().len();
        std::fs::write(folder.path().join("notes.npy"), vec![0; 5000]).unwrap();
        let cache = RenderCache::new(folder.path(), 2 * bytes);
        cache.store(&two, &picture(0.2));
        for (key, minutes) in [(&one, 2), (&two, 1)] {
            let file = std::fs::File::options().write(true).open(cache.path(key)).unwrap();
            let written = file.metadata().unwrap().modified().unwrap();
            file.set_modified(written - std::time::Duration::from_secs(60 * minutes)).unwrap();
        }
        cache.store(&three, &picture(0.2));
        assert!(cache.load(&one, &camera()).is_none());
        assert!(cache.load(&two, &camera()).is_some() && cache.load(&three, &camera()).is_some());
        assert!(folder.path().join("notes.npy").exists());
        let nothing = RenderCache::new(folder.path().join("none"), 0);
        nothing.store(&one, &picture(0.1));
        assert!(nothing.load(&one, &camera()).is_none() && !folder.path().join("none").exists());
    }

    #[test]
    fn many_who_write_the_same_picture_never_read_half_of_it() {
        use rayon::prelude::*;
        let folder = tempfile::tempdir().unwrap();
        let [one, two, _] = keys();
        (0..64).into_par_iter().for_each(|k| {
            // Each has its own cache, as processes do; one image fits, the other one is removed.
            let cache = RenderCache::new(folder.path(), 1500);
            let (key, value) = if k % 2 == 0 { (&one, 0.1) } else { (&two, 0.2) };
            cache.store(key, &picture(value));
            assert!(cache.load(key, &camera()).is_none_or(|read| read == picture(value)));
        });
        assert!(std::fs::read_dir(folder.path()).unwrap().count() <= 2);
    }

    #[test]
    fn only_files_of_a_cache_are_taken_for_its_own() {
        let [one, ..] = keys();
        assert!(is_ours(&format!("{one}.npy")) && is_ours(&format!(".{one}.npy.3.part")));
        for stranger in [format!("{one}.png"), "notes.npy".into(), format!("{}.npy", &one[1..]), one] {
            assert!(!is_ours(&stranger), "{stranger}");
        }
    }

    #[test]
    fn the_key_follows_what_is_seen_and_not_how_it_is_recorded() {
        let scenario = Scenario::demo();
        let plain = key(&scenario, &0, &camera());
        let mut other = scenario.clone();
        other.name = "another name".into();
        other.odometry_error.attitude_deg = 1.0;
        other.targets.count += 1;
        other.rover.heading_jumps = vec![HeadingJump { stop: 1, yaw_deg: 2.0 }];
        other.camera.noise_seed = Some(7);
        other.camera.exposure = ExposureMode::Subframe;
        other.camera.auto_exposure.start_s = 1.0;
        (other.camera.bit_depth, other.camera.quantisation) = (8, Quantisation::SquareRoot);
        (other.camera.vignetting, other.camera.smear_s, other.camera.mean_level) = (1.0, 0.005, 0.3);
        assert_eq!(key(&other, &0, &camera()), plain);
        let changes: [fn(&mut Scenario); 6] = [
            |scenario| scenario.seed += 1,
            |scenario| scenario.sun.azimuth_deg += 1e-9,
            |scenario| scenario.rocks.area_fraction *= 0.5,
            |scenario| scenario.camera.blur_px = 0.5,
            |scenario| scenario.camera.samples_per_axis = 3,
            |scenario| scenario.camera.rig = CameraRig::MerPancam,
        ];
        for change in changes {
            let mut other = scenario.clone();
            change(&mut other);
            assert_ne!(key(&other, &0, &camera()), plain);
        }
        let nudge = sightline_geometry::frames::Pose::translation(1e-12, 0.0, 0.0);
        assert_ne!(key(&scenario, &0, &camera().moved(&nudge)), plain);
        assert_ne!(key(&scenario, &1, &camera()), plain);
        assert_ne!(key_of("other sources", &scenario, &0, &camera()), plain);
    }
}
