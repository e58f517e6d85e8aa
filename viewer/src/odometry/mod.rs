//! Visual odometry of a stop: the measured motion against that of wheels and gyro, its gates, the slip over the stops, and
//! the corners on the left images of the stop and the previous one.

pub(crate) mod corners;
mod motion;
pub(crate) mod panel;
mod slip;

use sightline_api::wire::StopOdometry;
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryMode};

use crate::cache::{ImageSide, Key, Slot};
use crate::command::Layer;
use crate::driving::pause;
use crate::state::State;

impl State {
    /// The odometry of the cursor's stop with its corners.
    pub(crate) fn stop_odometry(&self) -> Slot<'_, StopOdometry> {
        self.odometry_key().map_or(Slot::Absent, |key| self.cache.odometry(&key))
    }

    /// The cache key of the odometry of the cursor's stop; `None` if it was not measured.
    fn odometry_key(&self) -> Option<Key> {
        let step = self.cursor.step;
        self.measured_motion(step)?;
        Some(Key::Odometry { traverse: self.traverse.as_ref()?.id.clone(), step })
    }

    /// Adds the corners of the cursor's stop and their images, if a visible panel or a layer shows them.
    pub(crate) fn add_odometry_items(&self, keys: &mut Vec<Key>) {
        let is_on_image = self.shows(Layer::Odometry) && self.odometry_on_image().is_some();
        if !(self.wants_odometry || is_on_image) {
            return;
        }
        let Some(key) = self.odometry_key() else { return };
        keys.push(key);
        if self.wants_odometry {
            let step = self.cursor.step;
            let camera = self.measured_motion(step).and_then(|measured| measured.camera);
            let images = step.checked_sub(1).into_iter().chain([step]);
            keys.extend(images.filter_map(|step| self.image_key_in(step, camera, ImageSide::Left)));
        }
    }

    /// The motion to the cursor's stop, if it was measured in the camera that is shown.
    pub(crate) fn odometry_on_image(&self) -> Option<&MeasuredMotion> {
        self.measured_motion(self.cursor.step).filter(|measured| measured.camera == self.camera())
    }

    /// Why the cursor's stop has no odometry, and how to get it; `None` if it has one.
    pub(crate) fn missing_odometry(&self) -> Option<String> {
        let step = self.cursor.step;
        if self.traverse.is_none() {
            return Some(self.missing_target());
        }
        if self.measured_motion(step).is_some() {
            return None;
        }
        if step == 0 {
            let next = self.next_step_words("to see one");
            return Some(format!("The drive begins at step 0: no motion led there.{next}"));
        }
        if let Some(halt) = self.halt().filter(|_| self.lacks_images_yet(step)) {
            return Some(pause::not_computed(halt.before));
        }
        if !self.is_on_commands() {
            return Some(
                "This drive was recorded without visual odometry. It runs in drives on commands: pick a target and begin one in the panel Drive."
                    .to_owned(),
            );
        }
        let command =
            self.drive().and_then(|drive| drive.steering.as_ref()).map(|steering| &steering.command);
        Some(match command.map(|command| command.odometry) {
            Some(OdometryMode::Off) => format!(
                "Visual odometry is off: the pose of step {step} is that of wheels and gyro. Switch it on in the panel Drive and branch."
            ),
            _ => format!("Step {step} has no odometry: the drive came there without it."),
        })
    }
}
