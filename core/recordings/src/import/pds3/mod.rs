//! PDS3 images of Mars rovers (MER, MSL) as stereo stops.
//!
//! Source: domain.md 6.1, 6.3; labels of real products. An image is imported if its label has a camera model and a
//! rover pose ([`Product`]); its pixels ([`Raster`]) become a 16-bit PNG with the same numbers, and full scale is the
//! detector's (4095 for twelve bits). Reals are scaled so that the largest sample is 65535.
//!
//! A folder's images are combined to stops (`pairs`): left and right image of one moment if there are such (lateral),
//! otherwise two views of one camera from one rover position (convergent). A single file selects the stop to which it
//! belongs; [`ImportOptions::files`] chooses the images instead. Images of other cameras from the same rover position
//! become further cameras of the stop (`further`), but not with chosen files.
//!
//! Poses are those of the labels, in their site frame; all stops must be of one site, because labels do not relate
//! sites. If the two labels of a stop differ in pose (the rover settled between), the second camera is transformed
//! into the first one's rover frame. There is no truth.

mod further;
mod pairs;
mod product;
mod raster;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use product::{Product, camera_model, is_product};
pub use raster::Raster;

use self::further::{Further, further};
use self::pairs::{Frame, Pair};
use super::{ImportFormat, ImportOptions, Output};
use sightline_geometry::camera::Camera;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_vision::image::{GrayImage, io};
use sightline_world::traverse::{CameraSource, FORMAT_VERSION, Stop, StopCamera, TraverseIndex, View};

/// The largest number of a 16-bit PNG.
const PNG_LIMIT_DN: f64 = 65_535.0;

/// The importer.
pub struct Pds3;

impl ImportFormat for Pds3 {
    fn name(&self) -> &'static str {
        "PDS3"
    }

    fn expects(&self) -> &'static str {
        "a .IMG or .LBL file or a folder with them, label beginning with PDS_VERSION_ID or ODL_VERSION_ID"
    }

    fn sniff(&self, path: &Path) -> bool {
        if path.is_file() {
            is_product(path)
        } else {
            product_files(path).is_ok_and(|files| !files.is_empty())
        }
    }

    fn import(&self, path: &Path, options: &ImportOptions, output: &mut Output<'_>) -> Result<TraverseIndex> {
        let Chosen { mut pairs, mut further, stereo } = if options.files.is_empty() {
            choose(path, output)?
        } else {
            chosen_by_hand(path, options, output)?
        };
        pairs.truncate(options.max_stops);
        further.truncate(pairs.len());
        one_site(&pairs)?;
        let frames: Vec<&Frame> = all_frames(&pairs, &further).collect();
        output.expect(frames.len());

        let scale = Scale::of(&frames, output)?;
        let first_clock = pairs[0].left.product.clock_s();
        let mut stops = Vec::with_capacity(pairs.len());
        for (step, pair) in pairs.iter().enumerate() {
            let clock = pair.left.product.clock_s().zip(first_clock);
            stops.push(Stop {
                // Without clocks only the order is known: the stops are one second apart.
                time_s: clock.map_or(step as f64, |(clock, first)| clock - first),
                site_from_rover: pair.left.pose,
                mast_angles: None,
                left: write_view(&pair.left, pair.left.camera.clone(), &scale, output)?,
                right: write_view(&pair.right, pair.right_camera_in_left_rover(), &scale, output)?,
                light: pair.left.product.light(),
                metered_px: None,
                odometry: None,
                odometry_alone: false,
                mast_target: None,
                truth: None,
                cameras: write_further(pair, further.get(step).map_or(&[], Vec::as_slice), &scale, output)?,
            });
        }
        let first = &pairs[0].left.product;
        let folder_name = || folder_of(path).file_name().map(|name| name.to_string_lossy().into_owned());
        Ok(TraverseIndex {
            format: FORMAT_VERSION,
            name: options.name.clone().or_else(folder_name).unwrap_or_default(),
            description: description(first, &pairs),
            full_scale_dn: Some(scale.full_scale_dn),
            stereo,
            odometry_error: OdometryError::default(),
            pointing_error_deg: 0.0,
            mast: None,
            scenario: None,
            stops,
        })
    }
}

/// The images of an import.
struct Chosen {
    pairs: Vec<Pair>,
    /// The further cameras of each pair; empty if the user chose the images.
    further: Vec<Vec<Further>>,
    stereo: StereoGeometry,
}

/// The images of all stops.
fn all_frames<'a>(pairs: &'a [Pair], further: &'a [Vec<Further>]) -> impl Iterator<Item = &'a Frame> {
    let of_pairs = pairs.iter().flat_map(|pair| [&pair.left, &pair.right]);
    let of_further =
        further.iter().flatten().flat_map(|camera| std::iter::once(&camera.left).chain(&camera.right));
    of_pairs.chain(of_further).map(AsRef::as_ref)
}

/// Writes the images of a stop's further cameras, with the models transformed into the rover frame of the stop.
fn write_further(
    stop: &Pair,
    cameras: &[Further],
    scale: &Scale,
    output: &mut Output<'_>,
) -> Result<Vec<StopCamera>> {
    let mut view = |frame: &Frame| write_view(frame, stop.camera_in_left_rover(frame), scale, output);
    let mut written = Vec::with_capacity(cameras.len());
    for camera in cameras {
        written.push(StopCamera {
            name: camera.name,
            mast_angles: None,
            left: view(&camera.left)?,
            right: camera.right.as_ref().map(|right| view(right)).transpose()?,
            true_left_camera: None,
            true_right_camera: None,
        });
    }
    Ok(written)
}

fn description(first: &Product, pairs: &[Pair]) -> String {
    let sol = first.label.number("PLANET_DAY_NUMBER").map(|sol| format!(", sol {sol}")).unwrap_or_default();
    let products: Vec<_> =
        pairs.iter().flat_map(|pair| [pair.left.product.id(), pair.right.product.id()]).collect();
    format!("PDS3 pictures of {}{sol}: {}.", first.instrument(), products.join(", "))
}

/// The folder of a recording, which may be given by one of its files.
fn folder_of(path: &Path) -> &Path {
    if path.is_dir() { path } else { path.parent().unwrap_or(path) }
}

/// The products of a folder, by name.
fn product_files(folder: &Path) -> Result<Vec<PathBuf>> {
    let unreadable = |source| Error::Read { path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let extension = path.extension().map(std::ffi::OsStr::to_ascii_lowercase);
        if extension.is_some_and(|extension| extension == "img" || extension == "lbl") && is_product(&path) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The stops of a folder, or the one to which a file belongs.
fn choose(path: &Path, output: &mut Output<'_>) -> Result<Chosen> {
    let mut frames: Vec<Arc<Frame>> = Vec::new();
    for file in product_files(folder_of(path))? {
        output.check_cancelled()?;
        match Product::read(&file).and_then(Frame::new) {
            // A product with both an attached and a detached label is one product.
            Ok(frame) if frames.iter().any(|other| other.product.id() == frame.product.id()) => {}
            Ok(frame) => frames.push(Arc::new(frame)),
            Err(error) if file == path => return Err(error),
            Err(error) => output.note(format!("left out: {error}")),
        }
    }
    let (mut pairs, stereo) = pairs::assemble(&frames);
    if path.is_file() {
        let wanted = Product::read(path)?.id();
        pairs.retain(|pair| pair.left.product.id() == wanted || pair.right.product.id() == wanted);
    }
    if pairs.is_empty() {
        let problem = "has no two pictures that make a stereo stop (left and right of one moment, or two \
                       overlapping views of one camera from one rover position); name the files to take";
        return Err(Error::format(path, problem));
    }
    let is_used = |frame: &Frame| pairs.iter().any(|pair| pair.uses(frame));
    let unused: Vec<_> = frames.iter().filter(|frame| !is_used(frame)).cloned().collect();
    let further = further(&pairs, &unused);
    let is_further = |frame: &Frame| further.iter().flatten().any(|camera| camera.uses(frame));
    for frame in unused.iter().filter(|frame| !is_further(frame)) {
        output.note(format!("left out: {} ({})", frame.product.id(), frame.product.instrument()));
    }
    Ok(Chosen { pairs, further, stereo })
}

/// The stops of the files named by the user, left and right alternately.
fn chosen_by_hand(path: &Path, options: &ImportOptions, output: &mut Output<'_>) -> Result<Chosen> {
    if !options.files.len().is_multiple_of(2) {
        let count = options.files.len();
        return Err(Error::setting(
            "files",
            format!("names {count} files, but each stop needs a left and a right"),
        ));
    }
    let read = |file: &PathBuf| Product::read(&folder_of(path).join(file)).and_then(Frame::new).map(Arc::new);
    let mut pairs = Vec::new();
    for files in options.files.chunks_exact(2) {
        output.check_cancelled()?;
        pairs.push(Pair { left: read(&files[0])?, right: read(&files[1])? });
    }
    let lateral = pairs.iter().all(Pair::is_lateral);
    let stereo = if lateral { StereoGeometry::Lateral } else { StereoGeometry::Convergent };
    Ok(Chosen { pairs, further: Vec::new(), stereo })
}

/// Rejects stops whose poses are in different frames.
fn one_site(pairs: &[Pair]) -> Result<()> {
    let mut sites =
        pairs.iter().flat_map(|pair| [&pair.left, &pair.right]).map(|frame| (frame, frame.site()));
    let Some((_, first)) = sites.next() else { return Ok(()) };
    match sites.find(|(_, site)| *site != first) {
        Some((frame, _)) => {
            Err(frame.product.problem("is of another site than the first picture; name files of one site"))
        }
        None => Ok(()),
    }
}

/// The conversion of detector numbers to those of a PNG.
struct Scale {
    /// PNG number per detector number.
    factor: f64,
    full_scale_dn: f64,
}

impl Scale {
    /// The same scale for all images, so that their brightness can be compared.
    fn of(frames: &[&Frame], output: &Output<'_>) -> Result<Self> {
        if output.is_dry() {
            return Ok(Self { factor: 1.0, full_scale_dn: PNG_LIMIT_DN });
        }
        let mut largest = 0.0_f64;
        let mut full_scale = Some(0.0_f64);
        for frame in frames {
            output.check_cancelled()?;
            let raster = frame.product.read_raster()?;
            largest = raster.samples.iter().fold(largest, |largest, &v| largest.max(f64::from(v)));
            full_scale = full_scale.zip(raster.full_scale_dn).map(|(a, b)| a.max(b));
        }
        Ok(match full_scale.filter(|&dn| dn <= PNG_LIMIT_DN) {
            Some(full_scale_dn) => Self { factor: 1.0, full_scale_dn },
            None if largest > 0.0 => Self { factor: PNG_LIMIT_DN / largest, full_scale_dn: PNG_LIMIT_DN },
            None => return Err(frames[0].product.problem("all samples are zero or less")),
        })
    }
}

/// Writes the image of a frame as PNG, named after its product.
fn write_view(frame: &Frame, camera: Camera, scale: &Scale, output: &mut Output<'_>) -> Result<View> {
    let name = format!("{}.png", file_name(&frame.product.id()));
    if output.is_dry() {
        return Ok(View { image: name, camera: CameraSource::Inline(camera) });
    }
    let raster = frame.product.read_raster()?;
    let negative = raster.samples.iter().filter(|&&v| v < 0.0).count();
    if negative > 0 {
        output.note(format!("{}: {negative} samples below zero became 0", frame.product.id()));
    }
    // One number of the PNG is one number of the detector: the image is a fraction of 65535, not of full scale.
    let samples =
        raster.samples.iter().map(|&v| (f64::from(v) * scale.factor / PNG_LIMIT_DN) as f32).collect();
    let image = GrayImage::from_raw(raster.width, raster.height, samples);
    let image = image.ok_or_else(|| frame.product.problem("the picture is not complete"))?;
    output.write(&name, &io::encode_png_u16(&image, Some(PNG_LIMIT_DN))?)?;
    Ok(View { image: name, camera: CameraSource::Inline(camera) })
}

/// Converts a product's name to the name of a file.
fn file_name(id: &str) -> String {
    id.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}
