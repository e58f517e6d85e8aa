//! The motion by visual odometry against that of wheels and gyro, axis by axis.
//!
//! ```text
//! p = −Rᵀ t,  Σ_p = Rᵀ Σ_τ R,  Σ_θ = Rᵀ Σ_ω R      (R, t) = after_from_before
//! ```
//! Both motions are in the rover frame of the previous stop: x ahead, y to the right, z down. The covariance of the update
//! is that of a small motion (τ, ω) in the rover frame after the motion, so that it is rotated back.

use egui::{Grid, Ui};
use nalgebra::Matrix3;
use sightline_geometry::frames::{Pose, PoseRecord};
use sightline_rover::visual_odometry::MeasuredMotion;

use crate::theme;

/// One axis of the motion, cm or degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    /// Name and unit.
    pub(super) name: &'static str,
    /// By visual odometry; `None` if it estimated no motion.
    pub(super) vision: Option<f64>,
    /// By wheels and gyro.
    pub(super) wheels: f64,
    /// 1σ of the motion by visual odometry; `None` without a motion.
    pub(super) sigma: Option<f64>,
}

const NAMES: [&str; 6] = ["ahead, cm", "right, cm", "down, cm", "roll, °", "pitch, °", "yaw, °"];

/// The axes of a motion from a stop whose estimated pose is `before`.
pub(super) fn axes(measured: &MeasuredMotion, before: &Pose) -> [Axis; 6] {
    let wheels = numbers(&(before.inverse() * measured.wheels_site_from_rover.to_pose()));
    let motion = measured.update.after_from_before.map(PoseRecord::to_pose);
    let vision = motion.map(|motion| numbers(&motion.inverse()));
    let sigmas = motion.zip(measured.update.covariance).map(|(motion, covariance)| {
        let turn = motion.rotation.to_rotation_matrix();
        let sigmas = |at: usize, factor: f64| {
            let block: Matrix3<f64> = covariance.fixed_view::<3, 3>(at, at).into_owned();
            let turned = turn.transpose() * block * turn;
            turned.diagonal().map(|variance| factor * variance.max(0.0).sqrt())
        };
        let (ways, angles) = (sigmas(0, 100.0), sigmas(3, 1_f64.to_degrees()));
        [ways.x, ways.y, ways.z, angles.x, angles.y, angles.z]
    });
    std::array::from_fn(|k| Axis {
        name: NAMES[k],
        vision: vision.map(|vision| vision[k]),
        wheels: wheels[k],
        sigma: sigmas.map(|sigmas| sigmas[k]),
    })
}

/// Translation in cm, then roll, pitch and yaw in degrees.
fn numbers(before_from_after: &Pose) -> [f64; 6] {
    let way = before_from_after.translation.vector * 100.0;
    let (roll, pitch, yaw) = before_from_after.rotation.euler_angles();
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(f64::to_degrees);
    [way.x, way.y, way.z, roll, pitch, yaw]
}

/// Shows the axes as a table.
pub(super) fn show(ui: &mut Ui, axes: &[Axis; 6]) {
    ui.label(theme::title("motion, rover frame of the stop before"));
    Grid::new("odometry motion").num_columns(5).striped(true).spacing([12.0, 1.0]).show(ui, |ui| {
        for head in ["", "vision", "wheels, gyro", "difference", "1σ"] {
            ui.label(theme::note(head));
        }
        ui.end_row();
        for axis in axes {
            ui.label(theme::label(axis.name).size(12.0));
            let digits = if axis.name.ends_with("cm") { 2 } else { 3 };
            let number = |value: Option<f64>| match value {
                // Without the sign of a rounded zero.
                Some(value) if value.abs() < 0.5 * 0.1_f64.powi(digits as i32) => format!("{:.digits$}", 0.0),
                Some(value) => format!("{value:+.digits$}"),
                None => "–".to_owned(),
            };
            ui.label(theme::number(number(axis.vision)));
            ui.label(theme::number(number(Some(axis.wheels))));
            ui.label(theme::number(number(axis.vision.map(|vision| vision - axis.wheels))));
            let sigma = axis.sigma.map_or_else(|| "–".to_owned(), |sigma| format!("{sigma:.digits$}"));
            ui.label(theme::number(sigma));
            ui.end_row();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::odometry::measured;

    #[test]
    fn the_axes_are_those_of_the_frame_before_with_turned_deviations() {
        // 50 cm by the wheels along x, of which a fifth is slip; a turn of 90° to the right by visual odometry.
        let before = Pose::translation(3.0, 1.0, 0.0);
        let [ahead, right, .., yaw] = axes(&measured(&before, 0.2, 90.0, true), &before);
        assert!(
            (ahead.vision.unwrap() - 40.0).abs() < 1e-9 && (ahead.wheels - 50.0).abs() < 1e-9,
            "{ahead:?}"
        );
        assert!(right.vision.unwrap().abs() < 1e-9 && right.wheels.abs() < 1e-9, "{right:?}");
        assert!((yaw.vision.unwrap() - 90.0).abs() < 1e-9 && yaw.wheels.abs() < 1e-9, "{yaw:?}");
        // 3 mm along x of the frame after the motion, which is y of the frame before it.
        assert!((right.sigma.unwrap() - 0.3).abs() < 1e-9 && (ahead.sigma.unwrap() - 0.1).abs() < 1e-9);
    }
}
