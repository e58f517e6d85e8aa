//! Registers one stop to an earlier view: the start, the surfaces, the ray or the draped image, and the evidence.
//!
//! | start | position | attitude | uncertainty |
//! |---|---|---|---|
//! | features of sufficient confidence | by the features | rotation by their motions | their covariance, 0.2° |
//! | dead reckoning | the prediction | by the pose estimates | its covariance and half the basin, `shape_attitude_deg` |
//! | a hand-off, registered to the previous stop | the target's | by the pose estimates | `hand_off_shift_m`, `hand_off_turn_deg` |
//! | a hand-off of a tracked target, registered to the first view | the target's | by the pose estimates | its covariance beyond that view's, and `hand_off_shift_m`; `shape_attitude_deg` |
//!
//! The rover does not move at a hand-off. The surface of the previous stop exists if that stop was registered.
//!
//! Source: R189, R197, R205; the uncertainties of the start are ours.

use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion};

use super::evidence::{Registered, ShapeEvidence};
use super::failure::ShapeFailure;
use super::look::{Look, least_confidence, note, region};
use super::placement::placement;
use super::view::{View, Views};
use super::{carried_ray, drape, gates};
use crate::locate::features::FeatureEvidence;
use crate::locate::tracker::{LocateInput, Sighting};
use sightline_geometry::frames::Point3;
use sightline_vision::registration::{
    Failure, Mesh, Prior, Registration, RegistrationInput, ShapeSettings, register,
};

/// 1σ about each axis of the attitude since the designation by the features, deg: several times their error.
const FEATURES_ATTITUDE_DEG: f64 = 0.2;

/// Returns the target by registration, and the rotation of the rover frame since the view. `None` if it is not used;
/// the reason is in the evidence.
pub(super) fn by_shape(
    input: &LocateInput<'_>,
    views: &Views,
    base: &Sighting<ShapeEvidence>,
    evidence: &mut ShapeEvidence,
) -> Option<(Sighting<ShapeEvidence>, UnitQuaternion<f64>)> {
    // A target not located at the previous stop may be anywhere: it is registered to its first view, like any lost one.
    let is_of_the_stop_before = views.last.as_ref().is_some_and(|last| last.step + 1 == input.place.step);
    let is_hand_off = input.place.is_hand_over && is_of_the_stop_before;
    let Some(view) = (if is_hand_off { &views.last } else { &views.first }) else {
        evidence.missing = Some(ShapeFailure::NoFirstView.to_string());
        return None;
    };
    let tried = match Tried::new(input, base, view, evidence, is_hand_off) {
        Ok(tried) => tried,
        Err(why) => {
            evidence.missing = Some(why.to_string());
            return None;
        }
    };
    let found = &tried.found;
    let settings = &input.settings.shape;
    let mut registered = registered(found, view, (&tried.expected, is_hand_off), &tried.settings);
    let by_surface = || carried(found, view, &tried.mesh, settings.carried_ray);
    let mut target = found.failure.is_none().then(by_surface).flatten();
    if is_hand_off && settings.hand_off_picture && is_left_to_the_picture(found.failure.as_ref()) {
        target = by_picture(input, view, found, &mut registered).or(target);
    }
    if let Some(target) = &target {
        registered.correction_m = Some((target.position - tried.expected).norm());
        registered.ray = target.ray;
        // The rover has not moved since the view of the previous stop, whose surface is the finer one.
        let there = found.fixed_from_moving * target.position;
        evidence.placement = match is_hand_off {
            true => Some(placement(&view.mesh, &there)),
            false if input.place.is_hand_over => Some(placement(&tried.mesh, &target.position)),
            false => None,
        };
    }
    evidence.registration = Some(registered);
    let arrays = evidence.arrays.get_or_default();
    arrays.add(found, [&view.mesh, &tried.mesh], &found.fixed_from_moving.inverse());
    let (overlap, left, right) = (found.agreement[2], &input.pointing.left, &input.pointing.right);
    evidence.view = Some(Arc::new(present_view(input, view.half_width_m, (tried.expected, tried.mesh))));
    let target = target?;
    let sighting = Sighting {
        left_pixel: left.project(&target.position),
        right_pixel: right.project(&target.position),
        position_in_rover: Some(target.position),
        covariance_in_rover: Some(target.covariance),
        confidence: overlap.map_or(0.0, |agreement| agreement.overlap),
        ..Sighting::default()
    };
    Some((sighting, found.fixed_from_moving.rotation.inverse()))
}

/// The view of this stop with the expected target; `locate` replaces its position and covariance by the final ones.
fn present_view(input: &LocateInput<'_>, half_width_m: f64, (expected, mesh): (Point3, Mesh)) -> View {
    View {
        step: input.place.step,
        site_from_rover: *input.site_from_rover,
        position_in_rover: expected,
        covariance_in_rover: input.prediction.covariance_in_rover,
        ray: None,
        half_width_m,
        mesh,
        left: input.pointing.left.clone(),
        image: Arc::clone(&input.capture.pair.left),
    }
}

/// A registration with an earlier view, used or not.
struct Tried {
    found: Registration,
    /// The current surface.
    mesh: Mesh,
    /// The expected target, m, current rover frame.
    expected: Point3,
    settings: ShapeSettings,
}

impl Tried {
    /// # Errors
    /// If the stop has too little surface.
    fn new(
        input: &LocateInput<'_>,
        base: &Sighting<ShapeEvidence>,
        view: &View,
        evidence: &mut ShapeEvidence,
        is_hand_off: bool,
    ) -> Result<Self, ShapeFailure> {
        let own = &input.settings.shape;
        let begin = Start::new(input, base, view, evidence.features.as_deref(), is_hand_off);
        let expected = begin.position;
        let sigma_m = begin.prior.target_m2.symmetric_eigenvalues().max().max(0.0).sqrt();
        let search_m = own.search_m(sigma_m, view.half_width_m);
        let settings = ShapeSettings { search_half_range_m: Some(search_m), ..own.registration() };
        let cameras = [&input.pointing.left, &input.pointing.right];
        let look = Look {
            capture: input.capture,
            cameras,
            shared: input.shared,
            settings: input.settings,
            cancel: input.cancel,
        };
        let surface = look.surface(&expected)?;
        let mesh = surface.mesh(&region(expected, view.half_width_m, &settings), own);
        note(evidence, &surface, &mesh);
        let registration = RegistrationInput {
            fixed: &view.mesh,
            moving: &mesh,
            start_fixed_from_moving: &view.start_from(begin.fixed_from_moving, &expected),
            target_in_fixed: &view.position_in_rover,
            half_width_m: view.half_width_m,
            prior: Some(begin.prior).filter(|_| own.shape_prior),
            sensor: None,
            cancel: input.cancel,
        };
        let found = register(&registration, &settings);
        Ok(Self { found, mesh, expected, settings })
    }
}

/// The expected target before the registration.
struct Start {
    /// Position, m, current rover frame.
    position: Point3,
    /// Rotation from the current rover frame to that of the earlier view.
    fixed_from_moving: UnitQuaternion<f64>,
    /// Uncertainty of both.
    prior: Prior,
}

impl Start {
    /// By the features if their confidence suffices, else by dead reckoning; at a hand-off, by the rover not moving.
    fn new(
        input: &LocateInput<'_>,
        base: &Sighting<ShapeEvidence>,
        view: &View,
        features: Option<&FeatureEvidence>,
        is_hand_off: bool,
    ) -> Self {
        let settings = &input.settings.shape;
        let prediction = input.prediction;
        // Wheel slip and gyro errors exceed their model; beyond the basin the registration would fail anyway (R155).
        let basin_m2 = (view.half_width_m / 2.0).powi(2);
        let by_poses = view.turn_to(input.site_from_rover);
        if is_hand_off {
            let target_m2 = Matrix3::identity() * settings.hand_off_shift_m.powi(2);
            let prior = Prior { target_m2, attitude_rad: settings.hand_off_turn_deg.to_radians() };
            return Self { position: prediction.position_in_rover, fixed_from_moving: by_poses, prior };
        }
        let is_tracked = input.place.is_hand_over && input.was_found;
        let by_prediction = match is_tracked {
            true => {
                let added = added_since(view, &by_poses, &prediction.covariance_in_rover);
                added + Matrix3::identity() * settings.hand_off_shift_m.powi(2)
            }
            false => prediction.covariance_in_rover + Matrix3::identity() * basin_m2,
        };
        let by_features = base.position_in_rover.zip(base.covariance_in_rover);
        let carried = features.and_then(|features| features.carried);
        match by_features.zip(carried).filter(|_| base.confidence >= least_confidence(input)) {
            Some(((position, target_m2), carried)) => Self {
                position,
                fixed_from_moving: carried.now_from_first.inverse(),
                prior: Prior { target_m2, attitude_rad: FEATURES_ATTITUDE_DEG.to_radians() },
            },
            None => Self {
                position: prediction.position_in_rover,
                fixed_from_moving: by_poses,
                prior: Prior {
                    target_m2: by_prediction,
                    attitude_rad: settings.shape_attitude_deg.to_radians(),
                },
            },
        }
    }
}

/// Returns the target's covariance beyond that of its view, m²: both include the error of the designation.
fn added_since(
    view: &View,
    fixed_from_moving: &UnitQuaternion<f64>,
    covariance_in_rover: &Matrix3<f64>,
) -> Matrix3<f64> {
    let turn = fixed_from_moving.inverse().to_rotation_matrix();
    let common = turn * view.covariance_in_rover * turn.transpose();
    let added = (covariance_in_rover - common).symmetric_eigen();
    let axes = added.eigenvectors;
    axes * Matrix3::from_diagonal(&added.eigenvalues.map(|variance| variance.max(0.0))) * axes.transpose()
}

/// Whether a draped image may decide: the surfaces match, but may let the target slide.
const fn is_left_to_the_picture(failure: Option<&Failure>) -> bool {
    matches!(
        failure,
        None | Some(
            Failure::NotEnoughShape { .. } | Failure::NotIsolated { .. } | Failure::AtSearchEdge { .. }
        )
    )
}

/// Locates the target by the earlier image, draped over the surface and matched in the current one; `None` if that fails.
fn by_picture(
    input: &LocateInput<'_>,
    view: &View,
    found: &Registration,
    registered: &mut Registered,
) -> Option<CarriedTarget> {
    let settings = &input.settings.shape;
    let covariance = &found.covariance_in_moving?;
    let drape = drape::DrapeInput {
        view,
        fixed_from_moving: &found.fixed_from_moving,
        registered: &found.target_in_moving,
        covariance,
        camera: &input.pointing.left,
        image: &input.capture.pair.left,
        window_px: settings.hand_off_window_px,
        score_min: settings.hand_off_score_min,
    };
    match drape::drape(&drape) {
        Ok((position, covariance, draped)) => {
            gates::add_picture(
                &mut registered.checks,
                draped.score,
                &covariance,
                settings.hand_off_score_min,
            );
            registered.add_picture(draped);
            let covariance = covariance + view_covariance(found, view);
            Some(CarriedTarget { position, covariance, ray: None })
        }
        Err(why) => {
            registered.draped_missing = Some(why.to_string());
            None
        }
    }
}

/// The target's covariance in the earlier view, rotated into the current rover frame, m².
fn view_covariance(found: &Registration, view: &View) -> Matrix3<f64> {
    let turn = found.fixed_from_moving.rotation.inverse().to_rotation_matrix();
    turn.matrix() * view.covariance_in_rover * turn.matrix().transpose()
}

/// A target located by a registration.
struct CarriedTarget {
    position: Point3,
    covariance: Matrix3<f64>,
    ray: Option<carried_ray::RayMeeting>,
}

/// The target in the current rover frame; `None` if the registration has no covariance.
fn carried(found: &Registration, view: &View, mesh: &Mesh, with_ray: bool) -> Option<CarriedTarget> {
    let covariance = found.covariance_in_moving? + view_covariance(found, view);
    let registered = found.target_in_moving;
    let met = view.ray.as_ref().filter(|_| with_ray).and_then(|ray| {
        let (fixed_from_moving, half_width_m) = (&found.fixed_from_moving, view.half_width_m);
        carried_ray::meet(
            &carried_ray::Carried { ray, fixed_from_moving, registered, covariance, half_width_m },
            mesh,
        )
    });
    Some(met.map_or(CarriedTarget { position: registered, covariance, ray: None }, |met| CarriedTarget {
        position: met.position,
        covariance: met.covariance,
        ray: Some(met.meeting),
    }))
}

/// Summarises a registration for the evidence.
fn registered(
    found: &Registration,
    view: &View,
    (expected, is_hand_off): (&Point3, bool),
    settings: &ShapeSettings,
) -> Registered {
    let sigmas_m = found.covariance_in_moving.map(|covariance| {
        let mut squares: [f64; 3] = covariance.symmetric_eigenvalues().into();
        squares.sort_by(|a, b| b.total_cmp(a));
        squares.map(|square| square.max(0.0).sqrt())
    });
    Registered {
        to_step: view.step,
        is_hand_off,
        method: settings.method,
        half_width_m: view.half_width_m,
        sensor_side_m: found.sensor.map(|sensor| sensor.pixel_m(1.0) * sensor.width as f64),
        start_in_rover: expected.coords.into(),
        correction_m: None,
        coarse_shift_m: found.coarse.best.map(|best| best.shift_m),
        search_m: settings.search_half_range_m.unwrap_or(view.half_width_m),
        mean_m: found.agreement.map(|agreement| agreement.map(|agreement| agreement.mean_m)),
        evaluations: found.path.last().map_or(0, |step| step.evaluations),
        turn_deg: found.turn_rad.to_degrees(),
        sigmas_m,
        ray: None,
        draped: None,
        draped_missing: None,
        checks: gates::checks(found, view.half_width_m, settings),
        failure: found.failure,
        reason: found.failure.map(|failure| failure.to_string()),
    }
}
