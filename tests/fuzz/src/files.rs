//! Parsers that read files: products, sequences, indexes and images.

use std::path::Path;

use sightline_recordings::Traverse;
use sightline_recordings::import::kitti;
use sightline_recordings::import::pds3::{Product, is_product};
use sightline_vision::image::{io, npz};

use crate::recording;

/// Maximum number of pixels that are decoded here: the parsers permit more than the fuzzer's memory.
const PIXELS_MAX: u64 = 1 << 20;

/// A product with its label, camera, pose and pixels.
pub(crate) fn pds3(bytes: &[u8]) {
    with_file("product.img", bytes, |path| {
        is_product(path);
        let Ok(product) = Product::read(path) else { return };
        // Each part may be refused.
        let _ = (product.id(), product.instrument().to_owned(), product.light());
        let _ = (product.camera(), product.site_from_rover());
        let is_small =
            product.size().is_ok_and(|[width, height]| u64::from(width) * u64::from(height) <= PIXELS_MAX);
        if is_small && let Ok(raster) = product.read_raster() {
            let _ = raster.statistics();
        }
    });
}

/// The projection matrices of a sequence.
pub(crate) fn kitti_calibration(bytes: &[u8]) {
    with_file("calib.txt", bytes, |path| {
        let _ = kitti::read_cameras(path, [64, 48]);
    });
}

/// The poses of a sequence.
pub(crate) fn kitti_poses(bytes: &[u8]) {
    with_file("poses.txt", bytes, |path| {
        let _ = kitti::read_poses(path);
    });
}

/// An index in TOML.
pub(crate) fn index_toml(bytes: &[u8]) {
    index("traverse.toml", bytes);
}

/// An index in JSON.
pub(crate) fn index_json(bytes: &[u8]) {
    index("traverse.json", bytes);
}

fn index(name: &str, bytes: &[u8]) {
    with_file(name, bytes, |path| {
        if let Ok(traverse) = Traverse::open(path) {
            let _ = traverse.warnings();
            for step in 0..traverse.stop_count().min(4) {
                // The images do not exist.
                assert!(traverse.capture(step).is_err());
            }
        }
    });
}

/// An image.
pub(crate) fn png(bytes: &[u8]) {
    with_file("image.png", bytes, |path| {
        let Ok([width, height]) = io::png_size(path) else { return };
        if u64::from(width) * u64::from(height) <= PIXELS_MAX {
            let _ = io::read_png_of_size(path, Some(4095.0), [width, height]);
        }
        // An image with too many pixels is refused by its header.
        let is_larger = u64::from(width) * u64::from(height) > 1;
        assert!(!is_larger || io::read_png_of_size(path, None, [1, 1]).is_err());
    });
}

/// An archive of arrays.
pub(crate) fn npz(bytes: &[u8]) {
    let _ = npz::decode(bytes, "arrays.npz");
}

/// Passes the path of a file with these bytes to a parser.
fn with_file(name: &str, bytes: &[u8], read: impl FnOnce(&Path)) {
    let path = recording::scratch().join(name);
    std::fs::write(&path, bytes).expect("the scratch folder can be written");
    read(&path);
    std::fs::remove_file(&path).expect("the scratch folder can be written");
}
