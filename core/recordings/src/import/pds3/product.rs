//! One PDS3 product: the data of its label on the camera, the rover and the image.
//!
//! Source: domain.md 1.4, 1.6, 2.4, 6.1, 6.3; labels of MER and MSL products. Group names are matched by
//! their beginning, because MSL and later missions write `…_PARMS` or shorten them. A camera model that
//! appears twice is taken from its last group. O is made unit on reading (domain.md 2.4); the other vectors
//! stay as printed. Poses are those of the label: rover in site, scalar first.

use std::io::Read;
use std::path::{Path, PathBuf};

use crate::import::odl::Group;
use sightline_geometry::camera::{Cahv, Cahvor, Cahvore, Camera, CameraModel, Imaging};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{POSITION_LIMIT_M, Point3, PoseRecord, Vector3};
use sightline_vision::image::io::{MAX_PIXELS, open_regular};
use sightline_world::traverse::StopLight;

/// The largest file that is read, bytes.
pub(crate) const FILE_LIMIT: u64 = 256 << 20;
/// The largest label that is read, bytes.
const LABEL_LIMIT: u64 = 1 << 20;
/// The largest number of lines or samples of an image.
pub(crate) const SIZE_LIMIT: u32 = 16_384;

/// A product, represented by its label; its pixels are read by `raster`.
#[derive(Clone, Debug)]
pub struct Product {
    /// The file with the label: the image itself, or a detached label beside it.
    pub path: PathBuf,
    /// The label.
    pub label: Group,
}

/// Whether the file begins as a PDS3 product does.
pub fn is_product(path: &Path) -> bool {
    let mut head = Vec::new();
    let read = open_regular(path).and_then(|file| file.take(512).read_to_end(&mut head));
    let begins = |mark: &[u8]| head.windows(mark.len()).any(|window| window == mark);
    read.is_ok() && (begins(b"PDS_VERSION_ID") || begins(b"ODL_VERSION_ID"))
}

impl Product {
    /// Reads the label of a product, attached or detached.
    ///
    /// # Errors
    /// A file that cannot be read, is larger than `FILE_LIMIT`, or whose label is damaged.
    pub fn read(path: &Path) -> Result<Self> {
        let unreadable = |source| Error::Read { path: path.to_owned(), source };
        let file = open_regular(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        if length > FILE_LIMIT {
            let (mib, limit) = (length >> 20, FILE_LIMIT >> 20);
            return Err(Error::format(
                path,
                format!("the file has {mib} MiB, more than the {limit} allowed"),
            ));
        }
        let mut head = Vec::new();
        file.take(LABEL_LIMIT).read_to_end(&mut head).map_err(unreadable)?;
        let label = Group::parse(&head).map_err(|problem| Error::format(path, problem.to_string()))?;
        Ok(Self { path: path.to_owned(), label })
    }

    /// An error about this product.
    pub(super) fn problem(&self, problem: impl Into<String>) -> Error {
        Error::format(&self.path, problem)
    }

    /// The product's name: its `PRODUCT_ID`, or the file's name if the label has none.
    pub fn id(&self) -> String {
        let stem = || self.path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        self.label.text("PRODUCT_ID").map(str::to_owned).or_else(stem).unwrap_or_default()
    }

    /// The instrument, for example `NAVCAM_LEFT`; empty if the label lacks it.
    pub fn instrument(&self) -> &str {
        self.label.text("INSTRUMENT_ID").unwrap_or_default()
    }

    /// The rover motion counter (SITE, DRIVE, …), if the label has at least these two.
    pub(crate) fn motion_counter(&self) -> Option<Vec<f64>> {
        self.label.numbers("ROVER_MOTION_COUNTER").filter(|counter| counter.len() >= 2)
    }

    /// The spacecraft clock at the start of the exposure, s.
    pub(crate) fn clock_s(&self) -> Option<f64> {
        let text = self.label.text("SPACECRAFT_CLOCK_START_COUNT")?;
        // A clock partition may precede a slash.
        text.rsplit('/').next()?.trim().parse().ok().filter(|clock: &f64| clock.is_finite())
    }

    /// Width and height of the image, px.
    ///
    /// # Errors
    /// No `IMAGE` object, or a size of 0 or beyond `SIZE_LIMIT`.
    pub fn size(&self) -> Result<[u32; 2]> {
        let image = self.image()?;
        let read = |key: &str| {
            let value = image.number(key).ok_or_else(|| self.problem(format!("IMAGE has no {key}")))?;
            let problem = || self.problem(format!("{key} is {value}, but it must be 1 to {SIZE_LIMIT}"));
            let in_range = value >= 1.0 && value <= f64::from(SIZE_LIMIT) && value.fract() == 0.0;
            in_range.then_some(value as u32).ok_or_else(problem)
        };
        let [width, height] = [read("LINE_SAMPLES")?, read("LINES")?];
        if u64::from(width) * u64::from(height) > MAX_PIXELS {
            let limit = MAX_PIXELS / 1_000_000;
            let problem = format!("{width} × {height} pixels; at most {limit} million can be read");
            return Err(self.problem(problem));
        }
        Ok([width, height])
    }

    /// The `IMAGE` object, at the top or inside a `FILE` object.
    pub(super) fn image(&self) -> Result<&Group> {
        let is_image = |name: &str| name == "IMAGE";
        let nested = || self.label.groups.iter().rev().find_map(|group| group.last_group(is_image));
        let image = self.label.last_group(is_image).or_else(nested);
        image.ok_or_else(|| self.problem("the label describes no IMAGE; choose a product with a picture"))
    }

    /// The camera in the rover frame, with O made unit and the size of the image.
    ///
    /// # Errors
    /// No camera model, an implausible one, one of another frame, or a bad image size.
    pub fn camera(&self) -> Result<Camera> {
        let model = camera_model(&self.label).map_err(|problem| self.problem(problem))?;
        let [width, height] = self.size()?;
        Ok(Camera::new(model, width, height))
    }

    /// Sun and exposure; `None` if the label lacks the sun's direction.
    ///
    /// Opportunity's labels count the sun's elevation downwards, the others upwards; images are taken by day, so the
    /// sign is dropped.
    pub fn light(&self) -> Option<StopLight> {
        let site = self.label.last_group(|name| name.starts_with("SITE_DERIVED_GEOMETRY"))?;
        let state = self.label.last_group(|name| name.starts_with("INSTRUMENT_STATE"));
        Some(StopLight {
            sun_azimuth_deg: site.number("SOLAR_AZIMUTH")?,
            sun_elevation_deg: site.number("SOLAR_ELEVATION")?.abs(),
            exposure_s: state.and_then(|group| group.number("EXPOSURE_DURATION")).map(|ms| ms / 1000.0),
        })
    }

    /// The pose of the rover in the site frame.
    ///
    /// # Errors
    /// No rover frame in the label, an implausible pose, or a pose in another frame than the site's.
    pub fn site_from_rover(&self) -> Result<PoseRecord> {
        rover_pose(&self.label).map_err(|problem| self.problem(problem))
    }
}

/// The camera model of a label, in the rover frame, with O made unit.
///
/// # Errors
/// A sentence that names the missing or implausible entry.
pub fn camera_model(label: &Group) -> Result<CameraModel, String> {
    const GROUP: &str = "GEOMETRIC_CAMERA_MODEL";
    let group = label.last_group(|name| name.starts_with(GROUP));
    let group = group.ok_or_else(|| format!("the label has no {GROUP}; choose a calibrated product"))?;
    let frame = group.text("REFERENCE_COORD_SYSTEM_NAME").unwrap_or("ROVER_FRAME");
    if !frame.starts_with("ROVER") {
        return Err(format!("{GROUP} is given in {frame}, but only the rover frame is understood"));
    }
    let linear = Cahv::as_printed(
        Point3::from(component(group, "C")?),
        Vector3::from(component(group, "A")?),
        Vector3::from(component(group, "H")?),
        Vector3::from(component(group, "V")?),
    );
    let optical_axis = || component(group, "O").map(Vector3::from);
    let model = match group.text("MODEL_TYPE").unwrap_or("NONE") {
        "CAHV" => CameraModel::Cahv(linear),
        "CAHVOR" => CameraModel::Cahvor(Cahvor::normalised(linear, optical_axis()?, component(group, "R")?)),
        "CAHVORE" => {
            let [kind] = component(group, "T")?;
            let imaging = Imaging::try_from(kind as u8)?;
            // P is used by the general law only, and older labels omit it otherwise.
            let linearity = match imaging {
                Imaging::General => component(group, "P")?,
                Imaging::Perspective | Imaging::Fisheye => [0.0],
            };
            let (radial, pupil) = (component(group, "R")?, component(group, "E")?);
            let law = (imaging, linearity[0]);
            CameraModel::Cahvore(Cahvore::normalised(linear, optical_axis()?, radial, pupil, law))
        }
        other => return Err(format!("MODEL_TYPE {other} is not one of CAHV, CAHVOR and CAHVORE")),
    };
    model.validate().map_err(|problem| format!("{GROUP}: {problem}"))?;
    Ok(model)
}

/// The numbers of one vector of a camera model, found by its letter in `MODEL_COMPONENT_ID`.
fn component<const N: usize>(group: &Group, letter: &str) -> Result<[f64; N], String> {
    const USUAL_ORDER: [&str; 9] = ["C", "A", "H", "V", "O", "R", "E", "T", "P"];
    let place = match group.value("MODEL_COMPONENT_ID") {
        Some(ids) => ids.items().iter().position(|id| id.text() == Some(letter)),
        None => USUAL_ORDER.iter().position(|id| *id == letter),
    };
    let place = place.ok_or_else(|| format!("MODEL_COMPONENT_ID lists no {letter}"))?;
    let key = format!("MODEL_COMPONENT_{}", place + 1);
    let numbers = group.numbers(&key).and_then(|numbers| numbers.try_into().ok());
    numbers.ok_or_else(|| format!("{key} ({letter}) must have {N} numbers"))
}

fn rover_pose(label: &Group) -> Result<PoseRecord, String> {
    const GROUP: &str = "ROVER_COORDINATE_SYSTEM";
    let group = label.last_group(|name| name.starts_with("ROVER_COORD"));
    let group = group.ok_or_else(|| format!("the label has no {GROUP}, so the rover's pose is unknown"))?;
    let frame = group.text("REFERENCE_COORD_SYSTEM_NAME").unwrap_or("SITE_FRAME");
    if frame != "SITE_FRAME" {
        return Err(format!("{GROUP} is given in {frame}, but only SITE_FRAME is understood"));
    }
    let record = PoseRecord {
        position_m: vector(group, "ORIGIN_OFFSET_VECTOR")?,
        quaternion_sxyz: vector(group, "ORIGIN_ROTATION_QUATERNION")?,
    };
    let plausible = record.is_plausible().then_some(record);
    plausible.ok_or_else(|| {
        format!(
            "{GROUP}: ORIGIN_ROTATION_QUATERNION is not of unit length, or ORIGIN_OFFSET_VECTOR beyond \
             {POSITION_LIMIT_M:.0e} m"
        )
    })
}

fn vector<const N: usize>(group: &Group, key: &str) -> Result<[f64; N], String> {
    let numbers = group.numbers(key).and_then(|numbers| numbers.try_into().ok());
    numbers.ok_or_else(|| format!("{}: {key} must have {N} numbers", group.name))
}
