//! Fiducials: objects of known shape in the scene, for people and tests; trackers do not use them (R181).

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::range::within;
use sightline_geometry::error::Result;

/// An object of known shape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Fiducial {
    /// A flat board of bright and dark squares, 1 cm thick, facing the first stop when `yaw_deg` is 0.
    Checkerboard {
        /// x of its centre, m ahead of the targets' centre.
        x_m: f64,
        /// y of its centre, m to the right of the targets' centre.
        y_m: f64,
        /// Height of its centre above the mean ground, m.
        height_m: f64,
        /// Rotation about the vertical, degrees clockwise from above.
        #[serde(default)]
        yaw_deg: f64,
        /// Tilt backwards, degrees: at 90 the board is flat on the ground and faces up.
        #[serde(default)]
        tilt_deg: f64,
        /// Side of a square, m.
        square_m: f64,
        /// Squares along its width.
        columns: u32,
        /// Squares along its height.
        rows: u32,
    },
    /// A white ball.
    Sphere {
        /// x of its centre, m ahead of the targets' centre.
        x_m: f64,
        /// y of its centre, m to the right of the targets' centre.
        y_m: f64,
        /// Height of its centre above the mean ground, m.
        height_m: f64,
        /// Radius, m.
        radius_m: f64,
    },
}

impl Fiducial {
    pub(crate) fn validate(&self, index: usize) -> Result<()> {
        let key = |field: &str| format!("fiducials[{index}].{field}");
        let place = |x_m: f64, y_m: f64, height_m: f64| -> Result<()> {
            within(&key("x_m"), x_m, -100.0, 100.0)?;
            within(&key("y_m"), y_m, -100.0, 100.0)?;
            within(&key("height_m"), height_m, 0.0, 100.0)
        };
        match *self {
            Self::Checkerboard { x_m, y_m, height_m, yaw_deg, tilt_deg, square_m, columns, rows } => {
                place(x_m, y_m, height_m)?;
                within(&key("yaw_deg"), yaw_deg, -360.0, 360.0)?;
                within(&key("tilt_deg"), tilt_deg, -180.0, 180.0)?;
                within(&key("square_m"), square_m, 0.001, 10.0)?;
                within(&key("columns"), f64::from(columns), 1.0, 1000.0)?;
                within(&key("rows"), f64::from(rows), 1.0, 1000.0)
            }
            Self::Sphere { x_m, y_m, height_m, radius_m } => {
                place(x_m, y_m, height_m)?;
                within(&key("radius_m"), radius_m, 0.001, 50.0)
            }
        }
    }
}
