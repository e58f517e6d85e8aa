//! The camera pairs available to a scenario, on the mast's head or on the body.
//!
//! | rig | left camera | right camera | head or body |
//! |---|---|---|---|
//! | `mer_navcam` | Spirit, label | Spirit, label | Spirit's mast |
//! | `mer_pancam` | Opportunity: C, A, scale | ours | Opportunity's mast |
//! | `mer_front_hazcam` | Opportunity, label (TV2) | ours: the left one 0.10 m along H' | body |
//! | `mer_rear_hazcam` | ours: the front one rotated by 180° about z | the front one, rotated | body |
//! | `table1_pancam`, `table1_navcam` | ours: ideal, f/pixel | ours | Spirit's mast |
//!
//! **Pancam.** For the left camera C and A in the head frame and the effective scale at the centre are known; its O, R and
//! the direction of V are not, so it is linear here: `H = f_x h + c_x A`, `V = f_y v + c_y A` with h level (h ∝ z × A) and
//! v = A × h. The right camera is the left one moved by a rigid transform that makes the axes mirror images: the mean
//! viewing direction is m, from which A is rotated inwards by the toe-in of 1°; the right camera is rotated by −2° about z
//! and placed 0.30 m along n = z × m.
//!
//! **Table I.** 4.8 mm over 1024 px is 4.6875 µm a pixel: f = 16 mm is 3413.3 px, f = 6 mm is 1280 px. The axes are
//! parallel to the head's x; the centres are 0.15 m above the mast's origin, like the rover's own cameras, and half the
//! baseline to each side.
//!
//! A smaller image is the block average of the full one (domain.md 2.1): all widths are 1024 px over a power
//! of two, and heights follow.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | C, A, H, V | `Cahv` | m, –, px, px; head or rover |
//! | f, c | focal length, principal point | px |
//! | m, n | mean viewing direction, direction of the baseline | –, head |
//!
//! Sources: domain.md 2.6, 4.1, 4.3, 5.1 and 15 (TV2); papers.md R25, R42.

use nalgebra::{Translation3, UnitQuaternion};

use crate::scenario::{CameraRig, CameraSettings};
use sightline_geometry::camera::{Cahv, Cahvore, Camera, CameraModel, Imaging, Mast, MastAngles};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Point3, Pose, Vector3};

/// Baseline of the pancams, m (domain.md 5.1).
const PANCAM_BASELINE_M: f64 = 0.30;
/// Angle by which each pancam is turned inwards, deg (domain.md 5.1; that it applies to each camera is ours).
const PANCAM_TOE_IN_DEG: f64 = 1.0;
/// Side of a pixel of the 1/3-inch detector of R42: 4.8 mm over 1024 px, m.
const TABLE1_PIXEL_M: f64 = 4.8e-3 / 1024.0;
/// Height of the cameras above the mast's origin, m (domain.md 4.1).
const HEAD_HEIGHT_M: f64 = 0.15;

/// A mounted pair of cameras.
#[derive(Clone, Debug, PartialEq)]
pub enum Rig {
    /// On the head of a pan and tilt mast.
    Mast(Mast),
    /// Fixed to the body; both cameras in the rover frame.
    Body {
        /// The left camera.
        left: Camera,
        /// The right camera.
        right: Camera,
    },
}

impl Rig {
    /// The rig of the settings, at their image size.
    pub fn new(settings: &CameraSettings) -> Self {
        Self::of(settings.rig, settings.image_size)
    }

    /// A rig at an image size, px of width.
    pub fn of(rig: CameraRig, image_size: u32) -> Self {
        let smaller = |camera: Camera| {
            let factor = (camera.width() / image_size.max(1)).max(1);
            if factor > 1 { camera.downsampled(factor) } else { camera }
        };
        match rig {
            CameraRig::MerFrontHazcam => {
                let (left, right) = front_hazcams();
                Self::Body { left: smaller(left), right: smaller(right) }
            }
            CameraRig::MerRearHazcam => {
                let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
                let turn = Pose::from_parts(Translation3::identity(), turn);
                let (left, right) = front_hazcams();
                Self::Body { left: smaller(left.moved(&turn)), right: smaller(right.moved(&turn)) }
            }
            on_mast => {
                let mast = match on_mast {
                    CameraRig::MerPancam => pancams(),
                    CameraRig::Table1Pancam => table1(16e-3, 0.30),
                    CameraRig::Table1Navcam => table1(6e-3, 0.20),
                    _ => Mast::spirit(),
                };
                Self::Mast(Mast {
                    origin_in_rover: mast.origin_in_rover,
                    left_in_head: smaller(mast.left_in_head),
                    right_in_head: smaller(mast.right_in_head),
                })
            }
        }
    }

    /// The left and the right camera in the rover frame; without angles a mast points level and ahead.
    pub fn cameras_in_rover(&self, angles: Option<MastAngles>) -> (Camera, Camera) {
        let ahead = MastAngles { azimuth_rad: 0.0, elevation_rad: 0.0 };
        match self {
            Self::Mast(mast) => mast.cameras_in_rover(angles.unwrap_or(ahead)),
            Self::Body { left, right } => (left.clone(), right.clone()),
        }
    }

    /// The mast angles that project a point (rover frame, m) onto the centre of the left image; `None` for a rig on the
    /// body, which cannot be pointed.
    ///
    /// # Errors
    /// A point that the mast cannot be pointed at.
    pub fn point_at(&self, target_in_rover: &Point3) -> Result<Option<MastAngles>> {
        match self {
            Self::Body { .. } => Ok(None),
            Self::Mast(mast) => mast.point_left_centre_at(target_in_rover).map(Some).ok_or_else(|| {
                let [x, y, z] = [target_in_rover.x, target_in_rover.y, target_in_rover.z];
                Error::Request(format!(
                    "the mast cannot look at ({x:.3}, {y:.3}, {z:.3}) m of the rover frame"
                ))
            }),
        }
    }
}

/// A linear camera without roll in a frame whose z points down; `focal_px` along x and y.
fn ideal(centre: Point3, axis: Vector3, focal_px: [f64; 2], size: [u32; 2]) -> Camera {
    let horizontal = Vector3::z().cross(&axis).normalize();
    let vertical = axis.cross(&horizontal);
    let [cx, cy] = size.map(|side| (f64::from(side) - 1.0) / 2.0);
    let model = Cahv::as_printed(
        centre,
        axis,
        horizontal * focal_px[0] + axis * cx,
        vertical * focal_px[1] + axis * cy,
    );
    Camera::new(CameraModel::Cahv(model), size[0], size[1])
}

/// Opportunity's pancams (header).
fn pancams() -> Mast {
    let axis = Vector3::new(0.9997607, 0.0218501, -0.0011336).normalize();
    let left_in_head =
        ideal(Point3::new(0.0280598, -0.1358995, -0.155257), axis, [3628.2, 3629.2], [1024, 1024]);
    let turn = |angle_deg: f64| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle_deg.to_radians());
    let middle = turn(-PANCAM_TOE_IN_DEG) * axis;
    let aside = Vector3::z().cross(&middle).normalize();
    let inwards = turn(-2.0 * PANCAM_TOE_IN_DEG);
    let centre = left_in_head.model.centre();
    let shift = centre.coords + aside * PANCAM_BASELINE_M - inwards * centre.coords;
    let right_in_head = left_in_head.moved(&Pose::from_parts(Translation3::from(shift), inwards));
    Mast { origin_in_rover: Point3::new(0.45729, 0.02605, -1.0962), left_in_head, right_in_head }
}

/// Opportunity's front hazcams in the rover frame: TV2 and its copy 0.10 m along H'.
fn front_hazcams() -> (Camera, Camera) {
    let at = |centre: Point3| {
        let linear = Cahv::as_printed(
            centre,
            Vector3::new(0.703447, -0.005161, 0.710729),
            Vector3::new(351.362, 452.204, 353.494),
            Vector3::new(35.8065, -1.75143, 682.705),
        );
        let model = Cahvore::normalised(
            linear,
            Vector3::new(0.704402, -0.006062, 0.709775),
            [3e-6, -0.012015, -0.007525],
            [0.001442, 0.001522, 0.000483],
            (Imaging::General, 0.37),
        );
        Camera::new(CameraModel::Cahvore(model), 1024, 1024)
    };
    (at(Point3::new(0.609331, -0.041064, -0.233849)), at(Point3::new(0.6098595, 0.0589344, -0.2336460)))
}

/// The ideal pair of Kim et al.'s Table I on Spirit's mast (header).
fn table1(focal_m: f64, baseline_m: f64) -> Mast {
    let focal_px = focal_m / TABLE1_PIXEL_M;
    let at =
        |y_m: f64| ideal(Point3::new(0.0, y_m, -HEAD_HEIGHT_M), Vector3::x(), [focal_px; 2], [1024, 768]);
    Mast {
        origin_in_rover: Mast::spirit().origin_in_rover,
        left_in_head: at(-0.5 * baseline_m),
        right_in_head: at(0.5 * baseline_m),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::frames::Pixel;

    const ALL: [CameraRig; 6] = [
        CameraRig::MerNavcam,
        CameraRig::MerPancam,
        CameraRig::MerFrontHazcam,
        CameraRig::MerRearHazcam,
        CameraRig::Table1Pancam,
        CameraRig::Table1Navcam,
    ];

    fn rig(rig: CameraRig, image_size: u32) -> Rig {
        Rig::new(&CameraSettings { rig, image_size, ..CameraSettings::default() })
    }

    /// The angle between the rays of two pixels, deg.
    fn angle_deg(camera: &Camera, a: Pixel, b: Pixel) -> f64 {
        let chord = (camera.ray(a).unwrap().direction - camera.ray(b).unwrap().direction).norm();
        (2.0 * (0.5 * chord).asin()).to_degrees()
    }

    #[test]
    fn fields_of_view_and_baselines_are_the_published_ones() {
        // Degrees edge to edge: domain.md 2.6; R42 and E2 for the two of Table I.
        let expected = [
            (45.88, 45.88, 0.200345, [1024, 1024]),
            (16.06, 16.06, 0.30, [1024, 1024]),
            (125.6, 125.6, 0.10, [1024, 1024]),
            (125.6, 125.6, 0.10, [1024, 1024]),
            (17.1, 12.8, 0.30, [1024, 768]),
            (43.6, 33.4, 0.20, [1024, 768]),
        ];
        for (kind, (wide, high, baseline_m, size)) in ALL.into_iter().zip(expected) {
            let (left, right) = rig(kind, 1024).cameras_in_rover(None);
            assert_eq!((left.size, right.size), (size, size));
            let middle = left.centre_pixel();
            let [w, h] = size.map(f64::from);
            let across = angle_deg(&left, Pixel::new(-0.5, middle.y), Pixel::new(w - 0.5, middle.y));
            let down = angle_deg(&left, Pixel::new(middle.x, -0.5), Pixel::new(middle.x, h - 0.5));
            assert!((across - wide).abs() < 0.06 && (down - high).abs() < 0.06, "{kind:?} {across} {down}");
            let baseline = (left.model.centre() - right.model.centre()).norm();
            assert!((baseline - baseline_m).abs() < 1e-4, "{kind:?} {baseline}");
        }
    }

    #[test]
    fn the_pancams_look_inwards_by_one_degree_each() {
        let (left, right) = rig(CameraRig::MerPancam, 1024).cameras_in_rover(None);
        let along = (right.model.centre() - left.model.centre()).normalize();
        for (camera, sign) in [(&left, 1.0), (&right, -1.0)] {
            let inwards_deg = (sign * camera.model.axis().dot(&along)).asin().to_degrees();
            assert!((inwards_deg - 1.0).abs() < 1e-5, "{inwards_deg}");
        }
        assert!((left.model.axis().z - right.model.axis().z).abs() < 1e-12);
    }

    #[test]
    fn table_one_pairs_have_equal_rows_and_the_disparity_of_their_range() {
        for (kind, focal_px, baseline_m) in
            [(CameraRig::Table1Pancam, 16.0 / 0.0046875, 0.30), (CameraRig::Table1Navcam, 1280.0, 0.20)]
        {
            let (left, right) = rig(kind, 1024).cameras_in_rover(None);
            let depth_m = 10.0;
            let point = left.model.centre() + Vector3::new(depth_m, 0.5, 0.3);
            let (l, r) = (left.project(&point).unwrap(), right.project(&point).unwrap());
            assert!((l.y - r.y).abs() < 1e-9);
            assert!((l.x - r.x - focal_px * baseline_m / depth_m).abs() < 1e-9);
        }
    }

    #[test]
    fn a_mast_puts_the_point_on_the_left_centre_and_a_body_points_nothing() {
        for kind in ALL {
            for size in [1024, 256] {
                let rig = rig(kind, size);
                let target = Point3::new(6.0, -1.5, 0.2);
                let angles = rig.point_at(&target).unwrap();
                let (left, _) = rig.cameras_in_rover(angles);
                assert_eq!(left.width(), size);
                if kind.is_on_body() {
                    assert!(angles.is_none());
                } else {
                    assert!(left.project(&target).unwrap().distance(left.centre_pixel()) < 1e-9);
                }
            }
        }
        let refusal = rig(CameraRig::MerNavcam, 1024).point_at(&Point3::new(f64::NAN, 0.0, 0.0)).unwrap_err();
        assert!(refusal.to_string().contains("cannot look at"));
    }

    #[test]
    fn every_pixel_of_the_hazcams_and_of_the_blurs_reach_has_a_ray() {
        // Corners of pixels two (at 128 px) and three (at 1024 px) beyond the image: a blur of 0.6 px takes less than 1e-5
        // from farther away.
        for (size, margin) in [(128, 2.5), (1024, 3.5)] {
            let (left, right) = rig(CameraRig::MerFrontHazcam, size).cameras_in_rover(None);
            let ends = [-margin, f64::from(size) - 1.0 + margin];
            for (x, y) in ends.iter().flat_map(|x| ends.iter().map(move |y| (*x, *y))) {
                assert!(left.ray(Pixel::new(x, y)).is_some() && right.ray(Pixel::new(x, y)).is_some());
            }
        }
    }
}
