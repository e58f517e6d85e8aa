//! The camera whose images are shown: the main pair, or a further camera of the stop.
//!
//! By default it is the camera of the selected target. A choice of the user lasts as long as the target is selected.

use sightline_api::wire::StopCameraView;
use sightline_geometry::camera::{Camera, CameraName};
use sightline_session::compare::RunName;
use sightline_session::step::RunStep;

use crate::cache::{ImageSide, Key};
use crate::drawing::view2d::View2d;
use crate::state::State;

/// The user's choice of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ChosenCamera {
    /// The target that was selected at the time.
    target: Option<usize>,
    /// The camera; `None`: the main pair.
    camera: Option<CameraName>,
}

impl State {
    /// The camera whose images are shown; `None`: the main pair.
    pub fn camera(&self) -> Option<CameraName> {
        let chosen = self.chosen_camera.filter(|chosen| chosen.target == self.cursor.target);
        chosen.map_or_else(|| self.camera_of_target(), |chosen| chosen.camera)
    }

    /// The camera for the link; `None` if it is the selected target's own, `Some(None)`: the main pair.
    pub(crate) fn camera_to_link(&self) -> Option<Option<CameraName>> {
        Some(self.camera()).filter(|camera| *camera != self.camera_of_target())
    }

    /// Shows another camera, with its images fitted to their panels.
    pub(crate) fn choose_camera(&mut self, camera: Option<CameraName>) {
        if camera != self.camera() {
            self.fit_images();
        }
        self.chosen_camera = Some(ChosenCamera { target: self.cursor.target, camera });
    }

    /// Fits the images to their panels; a zoom and an aim in another camera's pixels are meaningless.
    pub(crate) fn fit_images(&mut self) {
        (self.views.left, self.views.right) = (View2d::Fit, View2d::Fit);
        self.trackability.aim = None;
    }

    fn camera_of_target(&self) -> Option<CameraName> {
        self.target().and_then(|target| target.designation.camera)
    }

    /// The camera in which the target of a run is tracked.
    pub(crate) fn camera_of(&self, run: RunName) -> Option<CameraName> {
        self.run_named(run).and_then(|(target, _)| target.designation.camera)
    }

    /// Whether the images are of the camera in which the selected target is tracked.
    pub(crate) fn shows_targets_camera(&self) -> bool {
        self.camera() == self.camera_of_target()
    }

    /// The record of the cursor's step; `None` unless the images are of the target's camera.
    pub(crate) fn trace_on_image(&self) -> Option<&RunStep> {
        self.trace().filter(|_| self.shows_targets_camera())
    }

    /// A further camera of a stop; `None` if the stop lacks it.
    pub(crate) fn further_camera(&self, step: usize, name: CameraName) -> Option<&StopCameraView> {
        self.traverse.as_ref()?.stops.get(step)?.cameras.iter().find(|camera| camera.name == name)
    }

    /// Width and height of the left image of the cursor's stop, px; `None` without an image.
    pub(crate) fn left_size(&self) -> Option<[u32; 2]> {
        match self.camera() {
            None => self.stop().map(|stop| stop.left_size),
            Some(name) => self.further_camera(self.cursor.step, name).map(|camera| camera.left_size),
        }
    }

    /// Why the camera has no such image at the cursor's stop, as a sentence; `None` if it has one.
    pub(crate) fn lacks_image(&self, side: ImageSide) -> Option<String> {
        let (step, name) = (self.cursor.step, self.camera()?);
        self.stop()?;
        let Some(camera) = self.further_camera(step, name) else {
            return Some(format!("Step {step} has no camera {name}. Choose another camera above."));
        };
        let is_missing = side == ImageSide::Right && camera.right_size.is_none();
        is_missing.then(|| {
            format!("The camera {name} of step {step} is a single one: it has no right image, and no target can be tracked in it.")
        })
    }

    /// The cache key of an image of a stop; `None` if the stop lacks it.
    pub(crate) fn image_key_in(
        &self,
        step: usize,
        camera: Option<CameraName>,
        side: ImageSide,
    ) -> Option<Key> {
        let traverse = self.traverse.as_ref()?.id.clone();
        if let Some(name) = camera {
            let found = self.further_camera(step, name)?;
            if side == ImageSide::Right {
                found.right_size?;
            }
        }
        Some(Key::Image { traverse, step, side, camera })
    }

    /// The left and right cameras of the images that are shown, in the rover frame; `None` until loaded or without a right
    /// camera.
    pub fn stereo_cameras(&self) -> Option<(&Camera, &Camera)> {
        if let Some(pointing) = self.trace_on_image().map(|trace| &trace.point_mast) {
            return Some((&pointing.left, &pointing.right));
        }
        let stop = self.cache.stop(&self.stop_detail_key(self.cursor.step)?).ready()?;
        match self.camera() {
            None => Some((&stop.left, &stop.right)),
            Some(name) => {
                let camera = stop.cameras.iter().find(|camera| camera.name == name)?;
                Some((&camera.left, camera.right.as_ref()?))
            }
        }
    }
}
