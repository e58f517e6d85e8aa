//! The suspension: six wheels on rockers and bogies, settled on the ground and its rocks (`footing.rs`).
//!
//! **Mechanism.** On each side a rocker carries the front wheel and, behind, the pivot of a bogie with the middle and the
//! rear wheel. The differential keeps the body at the mean of the two rockers' pitch: the rockers' angles against the body
//! are equal and opposite. All pivots rotate about the body's y axis.
//!
//! ```text
//! front  = P + Ry(ρ)(f − P)        bogie pivot B = P + Ry(ρ)(b − P)
//! middle = B + Ry(ρ + β)(m − b)    rear          = B + Ry(ρ + β)(r − b)       ρ_left = −ρ_right
//! ```
//!
//! **Contact.** A wheel is a thin disc in the plane of the body's forward and down axes. Its clearance is the minimum
//! height of its underside over the ground:
//! `c = min over θ of g(p_x, p_y) − p_z, p = axle + R (cos θ · down + sin θ · forward)`, the minimum of samples every two
//! degrees, refined by golden section between that sample's neighbours. A disc bridges gaps narrower than itself and meets
//! a step before its axle does. Six clearances vanish for six unknowns: lift, roll, pitch, ρ, β_left, β_right. They are
//! found by `u ← u − γ J⁻¹ c` with the lifts J of a level rover; γ = 1 at first, and less if full steps oscillate on rough
//! ground. The unknowns with the smallest clearances are returned; if a wheel oscillates between two stones, these may be
//! up to 1 mm instead of 0.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | g | `ground_z_m` | m, site frame, down |
//! | P, b; f, m, r | `ROCKER_PIVOT_M`, `BOGIE_PIVOT_M`; axles of the wheels | m, rover frame |
//! | ρ, β | `rocker_rad`, `bogie_rad` | rad, positive lifts the front of the arm |
//! | R | `WHEEL_RADIUS_M` | m |
//! | c | clearance | m, down: positive above the ground |
//!
//! Frames: site and rover. Sources: domain.md 5.4 (wheels), 1.4 (angles); the pivots are ours: each wheel of
//! a side carries a third of its load.

use nalgebra::{Matrix6, Rotation3, Translation3, Vector6};

use crate::ground::level::MEAN_GROUND_Z_M;
use sightline_geometry::frames::{Point3, Pose, Vector3, attitude_from_roll_pitch_yaw};

/// Radius of a wheel, m (domain.md 5.4).
pub(crate) const WHEEL_RADIUS_M: f64 = 0.13;
/// Width of a wheel, m (ours; used for body and tracks only, the contact is that of a thin disc).
pub(crate) const WHEEL_WIDTH_M: f64 = 0.16;
/// Positions of the wheels in the rover frame (x, y), m: front, middle, rear, each left and right (domain.md 5.4).
pub(crate) const WHEELS_M: [[f64; 2]; 6] =
    [[0.70, -0.53], [0.70, 0.53], [0.0, -0.60], [0.0, 0.60], [-0.70, -0.53], [-0.70, 0.53]];
/// Height of the axles in the rover frame on flat ground, m.
pub(crate) const AXLE_Z_M: f64 = MEAN_GROUND_Z_M - WHEEL_RADIUS_M;
/// The pivot of a rocker (x, z) in the rover frame, m.
pub(crate) const ROCKER_PIVOT_M: [f64; 2] = [0.0, 0.0];
/// The pivot of a bogie (x, z) in the rover frame with the suspension level, m.
pub(crate) const BOGIE_PIVOT_M: [f64; 2] = [-0.35, 0.10];

/// Samples of the underside to either side of the body's down axis, in steps of two degrees.
const UNDERSIDE_STEPS: i32 = 40;
/// Sampling step of the underside, rad.
const UNDERSIDE_STEP_RAD: f64 = std::f64::consts::PI / 90.0;
/// Iterations of the golden section: two sampling steps shrink to 1e-7 rad, the height to rounding.
const NARROWINGS: usize = 28;
/// Fraction of an interval that a golden section keeps.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// The suspension is settled when no wheel is farther than this off the ground, m.
const SETTLED_M: f64 = 1e-12;
/// If a wheel oscillates between two contacts, the best iterate is accepted if no wheel is farther off the ground than
/// this, m: the height of a stone's edge that may hide between two samples of an underside.
const SWINGING_M: f64 = 1e-3;
/// Largest number of corrections.
const MOST_STEPS: usize = 300;
/// γ from a given correction on: reduced if a wheel oscillates between two contacts, as beside stones on a slope.
const PARTS: [(usize, f64); 3] = [(0, 1.0), (40, 0.4), (140, 0.15)];

/// The angles of the suspension's joints, left and right, rad; positive lifts the front of the arm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SuspensionAngles {
    /// The rockers against the body; equal and opposite.
    pub rocker_rad: [f64; 2],
    /// The bogies against their rockers.
    pub bogie_rad: [f64; 2],
}

/// The rover settled on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Pose of the rover.
    pub site_from_rover: Pose,
    /// The angles of the suspension.
    pub angles: SuspensionAngles,
    /// Contact points of the wheels with the ground, site frame, m, in the order of [`WHEELS_M`].
    pub contacts_in_site: [Point3; 6],
}

/// The centres of the wheels in the rover frame, m, in the order of [`WHEELS_M`].
pub(crate) fn axles_in_rover(angles: &SuspensionAngles) -> [Point3; 6] {
    std::array::from_fn(|wheel| {
        let [x, y] = WHEELS_M[wheel];
        let side = wheel % 2;
        let pivot = Point3::new(ROCKER_PIVOT_M[0], y, ROCKER_PIVOT_M[1]);
        let bogie = Point3::new(BOGIE_PIVOT_M[0], y, BOGIE_PIVOT_M[1]);
        let level = Point3::new(x, y, AXLE_Z_M);
        let rocker = Rotation3::from_axis_angle(&Vector3::y_axis(), angles.rocker_rad[side]);
        if wheel < 2 {
            return pivot + rocker * (level - pivot);
        }
        let arm = Rotation3::from_axis_angle(&Vector3::y_axis(), angles.bogie_rad[side]);
        pivot + rocker * (bogie - pivot + arm * (level - bogie))
    })
}

/// The unknowns of the search: lift, m; roll, pitch, left rocker, left and right bogie, rad.
type Unknowns = Vector6<f64>;

/// Lift of each wheel of a level rover per unit of each unknown, m/m or m/rad.
fn lifts() -> Matrix6<f64> {
    Matrix6::from_fn(|wheel, unknown| {
        let [x, y] = WHEELS_M[wheel];
        let is_left = wheel % 2 == 0;
        let is_front = wheel < 2;
        // A bogie's angle is relative to its rocker, so the rocker rotates all wheels of its side.
        let arm_m = x - ROCKER_PIVOT_M[0];
        match unknown {
            0 => 1.0,
            1 => -y,
            2 => x,
            3 => {
                if is_left {
                    arm_m
                } else {
                    -arm_m
                }
            }
            _ if !is_front && is_left == (unknown == 4) => x - BOGIE_PIVOT_M[0],
            _ => 0.0,
        }
    })
}

fn angles_of(unknowns: &Unknowns) -> SuspensionAngles {
    SuspensionAngles { rocker_rad: [unknowns[3], -unknowns[3]], bogie_rad: [unknowns[4], unknowns[5]] }
}

/// The clearance of a wheel, m, and the point of its underside with this clearance, site frame.
fn contact(
    ground_z_m: &dyn Fn(f64, f64) -> f64,
    site_from_rover: &Pose,
    axle_in_rover: &Point3,
) -> (f64, Point3) {
    let axle = site_from_rover * axle_in_rover;
    let forward = site_from_rover * Vector3::x() * WHEEL_RADIUS_M;
    let down = site_from_rover * Vector3::z() * WHEEL_RADIUS_M;
    let at = |angle_rad: f64| {
        let (sine, cosine) = angle_rad.sin_cos();
        let point = axle + down * cosine + forward * sine;
        (ground_z_m(point.x, point.y) - point.z, point)
    };
    let mut least = (at(0.0), 0.0);
    for step in -UNDERSIDE_STEPS..=UNDERSIDE_STEPS {
        let angle_rad = f64::from(step) * UNDERSIDE_STEP_RAD;
        let found = at(angle_rad);
        if found.0 < least.0.0 {
            least = (found, angle_rad);
        }
    }
    let (mut low, mut high) = (least.1 - UNDERSIDE_STEP_RAD, least.1 + UNDERSIDE_STEP_RAD);
    let mut best = least.0;
    let (mut left, mut right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut at_left, mut at_right) = (at(left), at(right));
    for _ in 0..NARROWINGS {
        if at_left.0 < at_right.0 {
            (high, right, at_right) = (right, left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = at(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = at(right);
        }
        let nearer = if at_left.0 < at_right.0 { at_left } else { at_right };
        if nearer.0 < best.0 {
            best = nearer;
        }
    }
    best
}

/// Settles the rover with its frame's origin above x, y (site frame, m) and heading `yaw_rad`.
///
/// `ground_z_m` returns z of the ground at a point of the site frame, m, positive down. `None` if the suspension does not
/// settle: on ground with steps higher than a wheel can rest against.
pub(crate) fn settle(
    ground_z_m: &dyn Fn(f64, f64) -> f64,
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
) -> Option<Stand> {
    let unknowns_from_clearances = lifts().try_inverse()?;
    let mut unknowns = Unknowns::zeros();
    unknowns[0] = MEAN_GROUND_Z_M - ground_z_m(x_m, y_m);
    let mut nearest: Option<(f64, Stand)> = None;
    for step in 0..MOST_STEPS {
        let attitude = attitude_from_roll_pitch_yaw(unknowns[1], unknowns[2], yaw_rad);
        let site_from_rover = Pose::from_parts(Translation3::new(x_m, y_m, -unknowns[0]), attitude);
        let angles = angles_of(&unknowns);
        let touched = axles_in_rover(&angles).map(|axle| contact(ground_z_m, &site_from_rover, &axle));
        let clearances = Vector6::from_fn(|wheel, _| touched[wheel].0);
        let worst_m = clearances.amax();
        if nearest.as_ref().is_none_or(|(least_m, _)| worst_m < *least_m) {
            let contacts_in_site = touched.map(|(_, point)| point);
            nearest = Some((worst_m, Stand { site_from_rover, angles, contacts_in_site }));
        }
        if worst_m <= SETTLED_M {
            break;
        }
        let part = PARTS.iter().rfind(|(from, _)| step >= *from).map_or(1.0, |(_, part)| *part);
        unknowns -= unknowns_from_clearances * clearances * part;
    }
    nearest.filter(|(worst_m, _)| *worst_m <= SWINGING_M).map(|(_, stand)| stand)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::terrain::Terrain;
    use crate::scenario::TerrainSettings;

    fn roll_pitch(stand: &Stand) -> (f64, f64) {
        let (roll, pitch, _) = stand.site_from_rover.rotation.euler_angles();
        (roll, pitch)
    }

    #[test]
    fn on_flat_ground_the_frame_is_as_high_as_the_label_says() {
        let stand = settle(&|_, _| 1.25, 3.0, -2.0, 0.7).unwrap();
        let position = stand.site_from_rover.translation.vector;
        assert!((position - Vector3::new(3.0, -2.0, 1.25 - 0.294)).norm() < 1e-12, "{position}");
        assert_eq!(stand.angles, SuspensionAngles::default());
        assert!(stand.contacts_in_site.iter().all(|point| (point.z - 1.25).abs() < 1e-12));
    }

    #[test]
    fn on_a_tilted_plane_roll_and_pitch_are_the_planes() {
        for (a, b, yaw_rad) in [(0.1, 0.0, 0.0), (-0.3, 0.2, 0.6), (0.25, 0.3, -2.0)] {
            let plane = |x: f64, y: f64| a * x + b * y + 0.4;
            let stand = settle(&plane, 1.0, 2.0, yaw_rad).unwrap();
            let down = Vector3::new(-a, -b, 1.0).normalize();
            let tilt = (stand.site_from_rover * Vector3::z()).cross(&down).norm();
            assert!(tilt < 1e-9, "{tilt}");
            let (_, _, yaw) = stand.site_from_rover.rotation.euler_angles();
            assert!((yaw - yaw_rad).abs() < 1e-12);
            let origin = stand.site_from_rover.translation.vector;
            let height_m = (plane(1.0, 2.0) - origin.z) * down.z;
            assert!((height_m - 0.294).abs() < 1e-9, "{height_m}");
            assert!(stand.angles.rocker_rad.iter().chain(&stand.angles.bogie_rad).all(|v| v.abs() < 1e-9));
        }
    }

    #[test]
    fn a_rock_under_one_front_wheel_gives_the_angles_of_the_levers() {
        // A spherical cap 1 mm high under the left front wheel, which rolls over its top. To first order:
        // left rocker p_l = h/1.05 + φ/30, right rocker p_r = −φ/30, φ = h/3.32, pitch = (p_l + p_r)/2.
        let (h, radius_m) = (1e-3, 0.4);
        let rock = |x: f64, y: f64| {
            let off = (x - 0.70).powi(2) + (y + 0.53).powi(2);
            -((radius_m * radius_m - off).max(0.0).sqrt() - (radius_m - h)).max(0.0)
        };
        let stand = settle(&rock, 0.0, 0.0, 0.0).unwrap();
        let (roll, pitch) = roll_pitch(&stand);
        assert!((roll / (h / 3.32) - 1.0).abs() < 5e-3, "{roll}");
        assert!((pitch / (h / 2.1) - 1.0).abs() < 5e-3, "{pitch}");
        let rocker = h / 2.1 + roll / 30.0;
        assert!((stand.angles.rocker_rad[0] / rocker - 1.0).abs() < 5e-3);
        assert_eq!(stand.angles.rocker_rad[0], -stand.angles.rocker_rad[1]);
        // The bogies stay on the level ground, except for the roll: −φ/10 and +φ/10 from it.
        let bogies = [-0.1 * roll - h / 1.05 - roll / 30.0, 0.1 * roll + roll / 30.0];
        for (bogie, expected) in stand.angles.bogie_rad.iter().zip(bogies) {
            assert!((bogie - expected).abs() < 5e-3 * h, "{bogie} {expected}");
        }
    }

    #[test]
    fn front_wheels_on_a_ledge_pitch_the_rockers_alone() {
        let h = 0.20;
        let stand = settle(&|x, _| if x > 0.35 { -h } else { 0.0 }, 0.0, 0.0, 0.0).unwrap();
        // The bogies are level, so their pivots are 0.194 m above the ground; the front axles 0.13 m + h.
        let arm = (1.05f64, AXLE_Z_M - BOGIE_PIVOT_M[1]);
        let radius_m = arm.0.hypot(arm.1);
        let pitch = arm.1.atan2(arm.0) - ((arm.1 - h) / radius_m).asin();
        let (roll, measured) = roll_pitch(&stand);
        assert!((measured - pitch).abs() < 1e-9 && roll.abs() < 1e-12, "{measured} {pitch}");
        for side in 0..2 {
            assert!((stand.angles.bogie_rad[side] + pitch).abs() < 1e-9);
            assert!(stand.angles.rocker_rad[side].abs() < 1e-9);
        }
    }

    #[test]
    fn on_rough_ground_every_wheel_touches_and_none_sinks_in() {
        let settings = TerrainSettings { rms_at_1m_m: 0.1, ..TerrainSettings::default() };
        let terrain = Terrain::new(&settings, [-3.0, 6.0], [-4.0, 4.0], 4);
        let ground = |x: f64, y: f64| terrain.z_at(x, y);
        for k in 0..24 {
            let k = f64::from(k);
            let stand = settle(&ground, 0.2 * k - 1.0, (k * 0.7).sin(), k).unwrap();
            for (axle, contact) in axles_in_rover(&stand.angles).iter().zip(stand.contacts_in_site) {
                assert!((contact.z - ground(contact.x, contact.y)).abs() < 1e-9);
                let least_m = (-800..=800)
                    .map(|tenth| {
                        let (sine, cosine) = (f64::from(tenth) * 0.1).to_radians().sin_cos();
                        let rim = axle + Vector3::new(sine, 0.0, cosine) * WHEEL_RADIUS_M;
                        let point = stand.site_from_rover * rim;
                        ground(point.x, point.y) - point.z
                    })
                    .fold(f64::INFINITY, f64::min);
                // Cells of 2 cm let a second contact hide between two samples of the search, by less than this.
                assert!(least_m > -2e-4, "{least_m}");
            }
        }
    }

    #[test]
    fn a_wheel_meets_a_step_before_its_axle_does() {
        // The edge of a 5 cm step is 6 cm ahead of the axles of the front wheels of a level rover.
        let step = |x: f64, _: f64| if x > 0.76 { -0.05 } else { 0.0 };
        let stand = settle(&step, 0.0, 0.0, 0.0).unwrap();
        let axle = stand.site_from_rover * axles_in_rover(&stand.angles)[0];
        let to_edge = (0.76 - axle.x).hypot(-0.05 - axle.z);
        // The disc rests against the edge.
        assert!((to_edge - 0.13).abs() < 1e-6, "{to_edge}");
        assert!(-axle.z > 0.14, "{}", axle.z);
    }
}
