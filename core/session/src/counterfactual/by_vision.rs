//! Tries the prediction by visual odometry, for a step whose pose is not corrected by it: odometry was off, only checked the
//! slip, or refused its motion. The motion is measured on the recorded images.
//!
//! The prediction moves in the left image only; its range and its covariance stay unchanged.

use super::trials::{Reach, Trials};
use super::{Finding, Moved};
use crate::step::RunStep;
use crate::track::Drive;
use crate::why::odometry::refusal;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Pose};
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryMode, OdometryPreset};
use sightline_track::settings::Changes;

/// Whether the pose of a step is not already corrected by visual odometry.
pub(super) fn applies(recorded: &RunStep) -> bool {
    recorded.step > 0 && recorded.odometry.as_deref().is_none_or(|measured| !measured.corrects)
}

/// Computes the step with the prediction by visual odometry; `None` if the goal is not reached.
pub(super) fn look<D: Drive>(trials: &mut Trials<'_, D>, cancel: Cancel<'_>) -> Result<Option<Finding>> {
    let recorded = trials.base.recorded;
    let Some(from) = recorded.point_mast.predicted_left else { return Ok(None) };
    let Some((motion, because)) = motion(trials.drive(), recorded, cancel)? else { return Ok(None) };
    let Some(to) = predicted(trials.drive(), recorded, &motion) else { return Ok(None) };
    let Some(trace) = trials.run(&Changes::new(), Some(to))? else { return Ok(None) };
    Ok((trials.reach(&trace) > Reach::Not).then(|| {
        let half_px = f64::from(trials.base.settings.template.search_window_px) / 2.0;
        let relative = from.distance(to) / half_px;
        trials.finding(Vec::new(), Some(Moved { from, to, because }), relative, (&trace, 1))
    }))
}

/// The motion by visual odometry (rover frame after from before), and its source as a clause.
fn motion<D: Drive>(drive: &D, recorded: &RunStep, cancel: Cancel<'_>) -> Result<Option<(Pose, String)>> {
    if let Some(measured) = recorded.odometry.as_deref() {
        let because = match refusal(measured) {
            Some(reason) => format!("the prediction by the refused visual odometry: {reason}"),
            None => "the prediction by visual odometry, which only checks the slip in this drive".to_owned(),
        };
        return Ok(measured.update.after_from_before.map(|motion| (motion.to_pose(), because)));
    }
    let how = (OdometryMode::Full, OdometryPreset::Sightline);
    match MeasuredMotion::measure(drive, recorded.step, None, how, cancel) {
        Err(Error::Cancelled) => Err(Error::Cancelled),
        // The images of the previous stop cannot be read.
        Err(_) => Ok(None),
        Ok(measured) => {
            let because = "the prediction by visual odometry, which is off in this drive";
            Ok(measured.update.accepted_motion().map(|motion| (motion, because.to_owned())))
        }
    }
}

/// Projects the predicted position into the left image, after this motion from the estimated pose of the previous stop.
/// `None` outside the image.
fn predicted<D: Drive>(drive: &D, recorded: &RunStep, after_from_before: &Pose) -> Option<Pixel> {
    let in_site = recorded.prediction()?.position_in_site;
    let before = drive.site_from_rover(recorded.step - 1).inverse() * in_site;
    let camera = &recorded.point_mast.left;
    let pixel = camera.project(&(after_from_before * before))?;
    let [width, height] = [camera.width(), camera.height()].map(f64::from);
    let is_inside = (0.0..width).contains(&pixel.x) && (0.0..height).contains(&pixel.y);
    is_inside.then_some(pixel)
}
