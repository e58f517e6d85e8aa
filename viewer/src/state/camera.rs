//! The camera of a stop whose images are shown: the main pair, or a further camera by its name.
//!
//! The images follow the target that is selected until a person chooses another camera; the choice ends with the selection.

use sightline_api::wire::StopCameraView;
use sightline_geometry::camera::{Camera, CameraName};
use sightline_session::compare::RunName;
use sightline_session::step::RunStep;

use crate::cache::{Eye, Key};
use crate::drawing::view2d::View2d;
use crate::state::State;

/// A camera that a person chose while a target was selected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ChosenCamera {
    /// The target that was selected.
    target: Option<usize>,
    /// The camera; the main pair for `None`.
    camera: Option<CameraName>,
}

impl State {
    /// The camera whose images are shown; `None`: the main pair.
    pub fn camera(&self) -> Option<CameraName> {
        let chosen = self.chosen_camera.filter(|chosen| chosen.target == self.cursor.target);
        chosen.map_or_else(|| self.camera_of_target(), |chosen| chosen.camera)
    }

    /// The camera that a person chose for the selected target, where it is not that of the target.
    pub(crate) fn camera_to_link(&self) -> Option<Option<CameraName>> {
        Some(self.camera()).filter(|camera| *camera != self.camera_of_target())
    }

    /// Shows the images of another camera, in full.
    pub(crate) fn choose_camera(&mut self, camera: Option<CameraName>) {
        if camera != self.camera() {
            self.fit_images();
        }
        self.chosen_camera = Some(ChosenCamera { target: self.cursor.target, camera });
    }

    /// Shows the images in full, because a view of another camera means nothing in them.
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

    /// Whether the images that are shown are those in which the selected target is tracked.
    pub(crate) fn shows_targets_camera(&self) -> bool {
        self.camera() == self.camera_of_target()
    }

    /// What the cursor's step saw and decided, where it belongs on the images that are shown.
    pub(crate) fn trace_on_image(&self) -> Option<&RunStep> {
        self.trace().filter(|_| self.shows_targets_camera())
    }

    /// The further camera of a stop by its name.
    pub(crate) fn further_camera(&self, step: usize, name: CameraName) -> Option<&StopCameraView> {
        self.traverse.as_ref()?.stops.get(step)?.cameras.iter().find(|camera| camera.name == name)
    }

    /// Width and height of the left image of the cursor's stop, px; `None` where it has none.
    pub(crate) fn left_size(&self) -> Option<[u32; 2]> {
        match self.camera() {
            None => self.stop().map(|stop| stop.left_size),
            Some(name) => self.further_camera(self.cursor.step, name).map(|camera| camera.left_size),
        }
    }

    /// Why the cursor's stop has no such image of the camera that is shown, as a sentence; `None` where it has it.
    pub(crate) fn lacks_image(&self, eye: Eye) -> Option<String> {
        let (step, name) = (self.cursor.step, self.camera()?);
        self.stop()?;
        let Some(camera) = self.further_camera(step, name) else {
            return Some(format!("Step {step} has no camera {name}. Choose another camera above."));
        };
        let is_missing = eye == Eye::Right && camera.right_size.is_none();
        is_missing.then(|| {
            format!("The camera {name} of step {step} is a single one: it has no right image, and no target can be tracked in it.")
        })
    }

    /// The name of an image of a stop in any camera; `None` where the stop lacks it.
    pub(crate) fn image_key_in(&self, step: usize, camera: Option<CameraName>, eye: Eye) -> Option<Key> {
        let traverse = self.traverse.as_ref()?.id.clone();
        if let Some(name) = camera {
            let found = self.further_camera(step, name)?;
            if eye == Eye::Right {
                found.right_size?;
            }
        }
        Some(Key::Image { traverse, step, eye, camera })
    }

    /// The two cameras of the cursor's step that is shown, in the rover frame, once they are here.
    pub fn eyes(&self) -> Option<(&Camera, &Camera)> {
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
