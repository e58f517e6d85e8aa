//! The three ways to specify a target (K§3, R16–R19), each converted to a pixel of a stop's left image.
//!
//! | way | given | the target's pixel |
//! |---|---|---|
//! | 1 (R16) | pixel, with the mast angles of its image if known | the pixel |
//! | 2 (R17) | point in the rover frame of the stop | its projection into the left image |
//! | 3 (R18) | point in the site frame | the same, by the estimated pose of the stop |
//!
//! Point stereo then gives the 3-D position in the same way for all three (R19). A replayed drive keeps its recorded
//! pointing: a point outside the image is rejected with the angles that would centre it, and mast angles other than those
//! of the stop's image refer to another image, so that the pixel is rejected.
//!
//! A given 3-D point need not be on the surface that stereo measures: [`Named::gap_m`] is the distance between them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::pair::{self, StopPair};
use crate::pipeline::Stops;
use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_track::target::Designation;
use sightline_track::trace::StepTrace;

/// Mast angles that differ by less name the same image: the mast's resolution (domain.md 4.4), rad.
const SAME_ANGLES_RAD: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// A target as specified by the user; exactly one of pixel and points is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// The pair of the stop in which it is designated and tracked; the main pair if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraName>,
    /// Its position in the left image, px.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pixel: Option<Pixel>,
    /// The mast angles at which that image was taken; those of the stop if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast: Option<MastAngles>,
    /// Its position in the rover frame of the stop, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_in_rover: Option<[f64; 3]>,
    /// Its position in the site frame, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_in_site: Option<[f64; 3]>,
}

/// A target specification converted to a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Named {
    /// The stop and the pixel.
    pub designation: Designation,
    /// The given point in the rover frame of the stop, m; `None` if a pixel was given.
    pub point_in_rover: Option<Point3>,
}

impl Named {
    /// Distance between the point that stereo found and the given point, m; `None` for a pixel.
    pub fn gap_m(&self, first: &StepTrace) -> Option<f64> {
        self.point_in_rover.map(|point| (first.update.target.position_in_rover - point).norm())
    }
}

impl Place {
    /// A pixel of the stop's own left image.
    pub fn of_pixel(pixel: Pixel) -> Self {
        Self { pixel: Some(pixel), ..Self::default() }
    }

    /// Converts to a pixel of the left image of `step`.
    ///
    /// # Errors
    /// [`Error::Target`] if not exactly one of pixel and points is given, the stop or its pair does not exist,
    /// the point is outside the image, or the pixel is one of another image.
    pub fn name(&self, stops: &dyn Stops, step: usize) -> Result<Named> {
        let count = stops.stop_count();
        if step >= count {
            return Err(Error::Target(format!("step {step} does not exist: the traverse has {count} stops")));
        }
        let pair = pair::of_stop(stops, step, self.camera).map_err(pair::as_target)?;
        let (pixel, point_in_rover) = match (self.pixel, self.point_in_rover, self.point_in_site) {
            (Some(pixel), None, None) => {
                self.check_angles(pair.mast_angles, step)?;
                (pixel, None)
            }
            (None, Some(point), None) => self.project(stops, &pair, step, Point3::from(point))?,
            (None, None, Some(point)) => {
                let rover_from_site = stops.site_from_rover(step).inverse();
                self.project(stops, &pair, step, rover_from_site * Point3::from(point))?
            }
            _ => {
                return Err(Error::Target(
                    "give exactly one of pixel, point_in_rover and point_in_site".to_owned(),
                ));
            }
        };
        let designation = Designation { step, pixel, camera: self.camera };
        Ok(Named { designation, point_in_rover })
    }

    fn check_angles(&self, taken: Option<MastAngles>, step: usize) -> Result<()> {
        let Some(given) = self.mast else { return Ok(()) };
        let Some(taken) = taken else {
            return Err(Error::Target(format!(
                "mast: the recording does not know the mast angles of step {step}; leave them out"
            )));
        };
        let turn_rad = (given.azimuth_rad - taken.azimuth_rad + std::f64::consts::PI)
            .rem_euclid(std::f64::consts::TAU)
            - std::f64::consts::PI;
        let tilt_rad = given.elevation_rad - taken.elevation_rad;
        if turn_rad.abs() <= SAME_ANGLES_RAD && tilt_rad.abs() <= SAME_ANGLES_RAD {
            return Ok(());
        }
        Err(Error::Target(format!(
            "mast: the left image of step {step} was taken at {}, not at {}; the pixel is one of another image",
            words(taken),
            words(given)
        )))
    }

    fn project(
        &self,
        stops: &dyn Stops,
        pair: &StopPair<'_>,
        step: usize,
        point: Point3,
    ) -> Result<(Pixel, Option<Point3>)> {
        if self.mast.is_some() {
            return Err(Error::Target("mast: only a pixel is given with mast angles".to_owned()));
        }
        if !point.iter().all(|coordinate| coordinate.is_finite()) {
            return Err(Error::Target("the coordinates of a point must be numbers".to_owned()));
        }
        let left = pair.left;
        let pixel = left.project(&point).filter(|p| p.is_inside(left.width(), left.height()));
        if let Some(pixel) = pixel {
            return Ok((pixel, Some(point)));
        }
        // The mast is pointed for the main pair only.
        let mast = stops.mast().filter(|_| self.camera.is_none());
        let centring = mast.and_then(|mast| mast.point_left_centre_at(&point));
        let hint = centring.map_or_else(String::new, |angles| {
            let taken =
                pair.mast_angles.map_or_else(String::new, |a| format!("; it was taken at {}", words(a)));
            format!(": the mast would have to point at {}{taken}", words(angles))
        });
        Err(Error::Target(format!(
            "the point ({:.2}, {:.2}, {:.2}) m in the rover frame is not in the left image of step {step}{hint}",
            point.x, point.y, point.z
        )))
    }
}

fn words(angles: MastAngles) -> String {
    format!(
        "azimuth {:.2} and elevation {:.2} degrees",
        angles.azimuth_rad.to_degrees(),
        angles.elevation_rad.to_degrees()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mast_angles_of_the_image_are_taken_and_those_of_another_are_refused() {
        let place = |azimuth_rad: f64| Place {
            mast: Some(MastAngles { azimuth_rad, elevation_rad: -0.2 }),
            ..Place::of_pixel(Pixel::new(1.0, 1.0))
        };
        let taken = Some(MastAngles { azimuth_rad: 3.13, elevation_rad: -0.2 });
        assert!(place(3.1302).check_angles(taken, 4).is_ok());
        // The same direction, one revolution further.
        assert!(place(3.1302 - std::f64::consts::TAU).check_angles(taken, 4).is_ok());
        let message = place(3.0).check_angles(taken, 4).unwrap_err().to_string();
        assert!(message.contains("step 4") && message.contains("another image"), "{message}");
    }
}
