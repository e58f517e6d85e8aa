//! The images of a traverse: read from their files on demand; missing images of a simulated traverse are rendered first.
//!
//! The pairs used last are kept in the stores that the targets share ([`Stores`]), whose cache has a limit in bytes.
//! Every camera pair has its own store, so that results of one pair are never used for another.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use sightline_geometry::camera::{Camera, CameraName};
use sightline_geometry::error::{Error, Result};
use sightline_rover::pair::{self, FurtherCamera};
use sightline_track::locate::store::{Cache, SharedStore};
use sightline_track::stages::capture::StereoPair;
use sightline_vision::image::{GrayImage, io};
use sightline_world::traverse::{Stop, TraverseIndex, View};

use super::check::FurtherCameras;
use super::files::resolve;
use super::native::Traverse;

/// Earlier results, for each camera pair.
pub(super) struct Stores {
    cache: Arc<Cache>,
    main: SharedStore,
    further: Vec<(CameraName, SharedStore)>,
}

impl Stores {
    /// Empty stores within a cache for all pairs of an index.
    pub(super) fn new(cache: &Arc<Cache>, index: &TraverseIndex) -> Self {
        let main = SharedStore::within(cache);
        let mut stores = Self { cache: Arc::clone(cache), main, further: Vec::new() };
        index.stops.iter().for_each(|stop| stores.add_cameras_of(stop));
        stores
    }

    /// Adds stores for the pairs of one more stop.
    pub(super) fn add_cameras_of(&mut self, stop: &Stop) {
        for camera in &stop.cameras {
            if self.further.iter().all(|(name, _)| *name != camera.name) {
                self.further.push((camera.name, SharedStore::within(&self.cache)));
            }
        }
    }

    /// The store of the main pair, or of a further one; `None` for a name that no stop has.
    pub(super) fn of(&self, camera: Option<CameraName>) -> Option<&SharedStore> {
        let Some(name) = camera else { return Some(&self.main) };
        self.further.iter().find(|(own, _)| *own == name).map(|(_, store)| store)
    }
}

/// An image of a stop, with its names for messages.
struct Source<'a> {
    words: String,
    field: String,
    view: &'a View,
    camera: &'a Camera,
}

impl Traverse {
    /// The cameras of a stop beside its main pair, in the order of the index.
    pub fn further_cameras(&self, step: usize) -> impl Iterator<Item = FurtherCamera<'_>> {
        let of_index = &self.index.stops[step].cameras;
        self.cameras[step].further.iter().zip(of_index).map(|(camera, of_index)| FurtherCamera {
            name: camera.name,
            left: &camera.left,
            right: camera.right.as_ref(),
            mast_angles: of_index.mast_angles,
        })
    }

    /// Whether the main pair of a stop needs no rendering: always for recorded ones, whether their files exist or not.
    pub fn is_ready(&self, step: usize) -> bool {
        self.is_rendered(step, None)
    }

    /// As [`Self::is_ready`], for the main pair or a further camera; `true` if the stop lacks the camera.
    pub fn is_rendered(&self, step: usize, camera: Option<CameraName>) -> bool {
        let Some((left, right)) = views(&self.index.stops[step], camera) else { return true };
        self.simulated.is_none() || (self.exists(left) && right.is_none_or(|right| self.exists(right)))
    }

    fn exists(&self, view: &View) -> bool {
        resolve(&self.folder, &view.image).is_ok_and(|path| path.exists())
    }

    /// Renders the missing images of a simulated stop's main pair; does nothing for a recorded one.
    ///
    /// # Errors
    /// No such stop, images that cannot be written, or [`Error::Cancelled`] soon after `cancel` is set.
    pub fn render_step(&self, step: usize, cancel: &AtomicBool) -> Result<()> {
        self.render_camera(step, None, cancel)
    }

    /// As [`Self::render_step`], for the main pair or a further camera.
    ///
    /// # Errors
    /// As [`Self::render_step`], and a stop without a camera of this name.
    pub fn render_camera(&self, step: usize, camera: Option<CameraName>, cancel: &AtomicBool) -> Result<()> {
        views(self.stop_with_images(step)?, camera).ok_or_else(|| no_camera(step, camera))?;
        match &self.simulated {
            Some(simulated) if !self.is_rendered(step, camera) => {
                simulated.render_missing(&self.stops(), step, camera, cancel)
            }
            _ => Ok(()),
        }
    }

    /// The main stereo pair of a stop, in fractions of full scale; a simulated one is rendered if missing.
    ///
    /// # Errors
    /// No such stop, or an image that is missing, damaged or not of its camera's size; the sentence names it relative
    /// to the folder, because it becomes part of the step's record, which must not depend on the folder's location.
    pub fn capture(&self, step: usize) -> Result<StereoPair> {
        self.capture_until(step, &AtomicBool::new(false))
    }

    /// As [`Traverse::capture`], but ends soon after `cancel` is set.
    ///
    /// # Errors
    /// As [`Traverse::capture`], and [`Error::Cancelled`].
    pub fn capture_until(&self, step: usize, cancel: &AtomicBool) -> Result<StereoPair> {
        self.capture_pair(step, None, cancel)
    }

    /// As [`Traverse::capture_until`], for the main pair or a further one.
    ///
    /// # Errors
    /// As [`Traverse::capture_until`], a stop without a camera of this name, and a single camera.
    pub fn capture_pair(
        &self,
        step: usize,
        camera: Option<CameraName>,
        cancel: &AtomicBool,
    ) -> Result<StereoPair> {
        let [left, right] = [self.source(step, camera, true)?, self.source(step, camera, false)?];
        if let Some(pair) = self.kept_pair(step, camera) {
            return Ok(StereoPair::clone(&pair));
        }
        let read = || {
            self.render_camera(step, camera, cancel)?;
            Ok(StereoPair {
                left: Arc::new(self.read_image(&left)?),
                right: Arc::new(self.read_image(&right)?),
            })
        };
        let pair = read().map_err(|error| self.without_folder(error))?;
        self.keep_pair(step, camera, &pair);
        Ok(pair)
    }

    /// The left or the right image of a camera at a stop; the other image may be damaged.
    ///
    /// # Errors
    /// As [`Self::capture`], of this image; a stop without a camera of this name, and the right image of a single one.
    pub fn capture_one(
        &self,
        step: usize,
        camera: Option<CameraName>,
        is_left: bool,
    ) -> Result<Arc<GrayImage>> {
        let source = self.source(step, camera, is_left)?;
        if let Some(pair) = self.kept_pair(step, camera) {
            return Ok(Arc::clone(if is_left { &pair.left } else { &pair.right }));
        }
        let named = |error| self.without_folder(error);
        self.render_camera(step, camera, &AtomicBool::new(false)).map_err(named)?;
        let wanted = self.read_image(&source).map(Arc::new).map_err(named)?;
        // The pair is kept, because its other image is usually wanted next.
        let other = self.source(step, camera, !is_left).and_then(|other| self.read_image(&other));
        if let Ok(other) = other.map(Arc::new) {
            let [left, right] = if is_left { [&wanted, &other] } else { [&other, &wanted] };
            let pair = StereoPair { left: Arc::clone(left), right: Arc::clone(right) };
            self.keep_pair(step, camera, &pair);
        }
        Ok(wanted)
    }

    /// An image of a stop by camera and side.
    fn source(&self, step: usize, camera: Option<CameraName>, is_left: bool) -> Result<Source<'_>> {
        let (stop, cameras) = (self.stop_with_images(step)?, &self.cameras[step]);
        let side = if is_left { "left" } else { "right" };
        let Some(name) = camera else {
            let (view, camera) =
                if is_left { (&stop.left, &cameras.left) } else { (&stop.right, &cameras.right) };
            let words = format!("the {side} image of step {step}");
            return Ok(Source { words, field: format!("stops[{step}].{side}.image"), view, camera });
        };
        let place = cameras.further.iter().position(|camera| camera.name == name);
        let k = place.ok_or_else(|| pair::missing(step, name))?;
        let (of_index, FurtherCameras { left, right, .. }) = (&stop.cameras[k], &cameras.further[k]);
        let found = match is_left {
            true => Some((&of_index.left, left)),
            false => of_index.right.as_ref().zip(right.as_ref()),
        };
        let (view, camera) = found.ok_or_else(|| pair::single(step, name))?;
        let words = format!("the {side} image of {name} at step {step}");
        Ok(Source { words, field: format!("stops[{step}].cameras[{k}].{side}.image"), view, camera })
    }

    /// Makes the path in an error relative to the folder.
    fn without_folder(&self, error: Error) -> Error {
        let relative = |path: PathBuf| match path.strip_prefix(&self.folder) {
            Ok(inside) if inside != Path::new("") => inside.to_owned(),
            Ok(_) => PathBuf::from("."),
            Err(_) => path,
        };
        match error {
            Error::Read { path, source } => Error::Read { path: relative(path), source },
            Error::Write { path, source } => Error::Write { path: relative(path), source },
            Error::Format { path, problem } => Error::Format { path: relative(path), problem },
            other => other,
        }
    }

    fn kept_pair(&self, step: usize, camera: Option<CameraName>) -> Option<Arc<StereoPair>> {
        self.stores.of(camera)?.kept(&step, &())
    }

    fn keep_pair(&self, step: usize, camera: Option<CameraName>, pair: &StereoPair) {
        if let Some(store) = self.stores.of(camera) {
            // Only the bytes of the cache are limited.
            store.keep(step, &(), usize::MAX, Arc::new(pair.clone()));
        }
    }

    fn read_image(&self, source: &Source<'_>) -> Result<GrayImage> {
        let Source { words, field, view, camera } = source;
        // Checked again, because a link may have been created since the folder was opened.
        let path = resolve(&self.folder, &view.image)
            .map_err(|problem| Error::format(&self.index_path, format!("{field}: {problem}")))?;
        let named = |error| match error {
            Error::Read { path, source } => Error::format(path, format!("{words} cannot be read ({source})")),
            Error::Format { path, problem } => Error::format(path, format!("{words}: {problem}")),
            other => other,
        };
        let check = |[width, height]: [u32; 2]| {
            let [wanted_width, wanted_height] = camera.size;
            let problem = || {
                format!(
                    "{words} has {width} × {height} pixels, but its camera is for {wanted_width} × {wanted_height}"
                )
            };
            ([width, height] == camera.size).then_some(()).ok_or_else(|| Error::format(&path, problem()))
        };
        // The header first: decoding allocates memory for as many pixels as the file states.
        check(io::png_size(&path).map_err(named)?)?;
        let image = io::read_png_of_size(&path, self.index.full_scale_dn, camera.size).map_err(named)?;
        check(image.dimensions().into())?;
        Ok(image)
    }
}

/// The left and, if there is one, the right view of a stop's camera; `None` if the stop lacks the camera.
pub(super) fn views(stop: &Stop, camera: Option<CameraName>) -> Option<(&View, Option<&View>)> {
    match camera {
        None => Some((&stop.left, Some(&stop.right))),
        Some(name) => stop.camera(name).map(|camera| (&camera.left, camera.right.as_ref())),
    }
}

/// The error of a stop that lacks a camera; the main pair is never missing.
pub(super) fn no_camera(step: usize, camera: Option<CameraName>) -> Error {
    camera.map_or_else(
        || Error::Request(format!("stop {step} has no main pair")),
        |name| pair::missing(step, name),
    )
}
