//! The shape tracker, and the combined one: `surface` → `mesh` → `coarse_register` → `refine_register` → `carried_ray`
//! (Deans et al. 2005, D§2 and D§4).
//!
//! | tracker | on the way | at the last stop of a camera pair | where another pair takes over |
//! |---|---|---|---|
//! | `shape` | registered to the first view, stop by stop (R189) | alike | registered to the last view of the old pair |
//! | `combined` | features (R154) | features, then registered to the first view | alike |
//!
//! ```text
//! start            the target by features or by dead reckoning, the attitude by the pose estimates      (R197)
//! registration     x = T⁻¹ x_first                                   Σ = Σ_reg + R⁻¹ Σ_first R
//! carried ray      x = where the designation's line of sight, carried by T, meets the present surface
//! ```
//! At a hand-off the last image is draped over its surface and found in the new camera's image (`drape`), which holds the
//! target where flat faces let it slide. What features add up on the way is gone at the end, and with the ray so is the error of the first range. A
//! registration that fails says why and leaves the target to the features, where those are sure; where other cameras
//! took over there are no features to fall back upon.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | T, R | `Registration::fixed_from_moving` and its rotation | rover frames of the two stops |
//! | x_first, Σ_first | `View::position_in_rover`, `View::covariance_in_rover` | m, m², rover frame of the first view |
//! | Σ_reg | `Registration::covariance_in_moving` | m² |
//!
//! Source: D§2, D§4; R146, R154, R187–R206.

pub mod carried_ray;
pub mod drape;
pub mod evidence;
mod half_width;
pub mod rows;
pub mod settings;
pub mod surface;
pub mod view;

pub use evidence::ShapeEvidence;
pub use settings::{ShapeTrackerSettings, ShapeUse};

#[cfg(test)]
mod tests;

use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion};

use self::evidence::Registered;
use self::surface::StopSurface;
use self::view::View;
use super::features::anchor::Carried;
use super::features::{FeatureEvidence, FeatureLocator};
use super::shape::{
    Failure, Mesh, Prior, Region, Registration, RegistrationInput, ShapeSettings, region_radius_m, register,
};
use super::template::TemplateLocator;
use super::{DesignateInput, Evidence, LocateInput, Located, Locator, store};
use crate::camera::Camera;
use crate::frames::Point3;
use crate::stages::capture::Capture;

/// The rock is measured on the surface this far around the target, m.
const MEASURED_WITHIN_M: f64 = 0.9;
/// Half the width of what cannot be measured, m (R200).
const HALF_WIDTH_M: f64 = 0.25;
/// Attitude since the designation as the features carry it, 1σ about each axis, deg: several times what they err by.
const FEATURES_ATTITUDE_DEG: f64 = 0.2;

/// The target by the shape of its surroundings at every stop (Deans et al. 2005).
#[derive(Clone, Copy, Debug)]
pub struct ShapeLocator;

/// Features on the way, the shape at the end (Deans et al. 2005, D§4).
#[derive(Clone, Copy, Debug)]
pub struct CombinedLocator;

impl Locator for ShapeLocator {
    fn designate(&self, input: &DesignateInput<'_>) -> Located {
        let mut located = TemplateLocator.designate(input);
        let mut evidence = ShapeEvidence::default();
        if let Evidence::Template(designation) = std::mem::take(&mut located.evidence) {
            evidence.designation = Some(designation);
        }
        first_view(input, &located, &mut evidence);
        // Without a first view no later stop can be registered to it.
        if let Some(missing) = evidence.missing.clone() {
            located = Located { missing: Some(missing), ..Located::default() };
        }
        located.evidence = Evidence::Shape(Box::new(evidence));
        located
    }

    fn locate(&self, input: &LocateInput<'_>) -> Located {
        let why = "the shape tracker asks the shape at every stop".to_owned();
        locate(input, None, Some(why.clone()), why)
    }
}

impl Locator for CombinedLocator {
    fn designate(&self, input: &DesignateInput<'_>) -> Located {
        let mut located = FeatureLocator.designate(input);
        let mut evidence = ShapeEvidence::default();
        if let Evidence::Features(features) = std::mem::take(&mut located.evidence) {
            evidence.features = Some(features);
        }
        first_view(input, &located, &mut evidence);
        located.evidence = Evidence::Shape(Box::new(evidence));
        located
    }

    fn locate(&self, input: &LocateInput<'_>) -> Located {
        if input.place.is_hand_over {
            let why = "other cameras take over here".to_owned();
            return locate(input, None, Some(why.clone()), why);
        }
        let by_features = FeatureLocator.locate(input);
        let is_lost =
            by_features.position_in_rover.is_none() || by_features.confidence < least_confidence(input);
        let asked = match input.settings.shape.shape_use {
            _ if input.place.is_last_of_pair => Some("this is the last stop of these cameras"),
            ShapeUse::EveryStop => Some("the shape is asked at every stop"),
            ShapeUse::WhenLost if is_lost => Some("the features lost the target"),
            ShapeUse::AtEnd | ShapeUse::WhenLost => None,
        };
        let why =
            asked.unwrap_or("on the way the features are followed; the shape is asked at the last stop");
        locate(input, Some(by_features), asked.map(str::to_owned), why.to_owned())
    }
}

fn least_confidence(input: &LocateInput<'_>) -> f64 {
    let limits = &input.settings.limits;
    if input.lost_count > 0 { limits.confidence_return } else { limits.confidence_min }
}

/// Measures the surface of the designation.
fn first_view(input: &DesignateInput<'_>, located: &Located, evidence: &mut ShapeEvidence) {
    evidence.why = "the surface of the designation is what later stops are registered to".to_owned();
    let (Some(position), Some(covariance)) = (located.position_in_rover, located.covariance_in_rover) else {
        return;
    };
    let cameras = [input.left, input.right];
    let look = Look { capture: input.capture, cameras, shared: input.shared, settings: input.settings };
    let settings = &input.settings.shape;
    let surface = match look.surface(&position) {
        Ok(surface) => surface,
        Err(why) => {
            evidence.missing = Some(why);
            return;
        }
    };
    let measured = || {
        let region = Region { centre: position, radius_m: MEASURED_WITHIN_M };
        half_width::half_width_m(&surface.mesh(&region, settings), &position)
    };
    let half_width_m = match settings.shape_half_width_m {
        given if given > 0.0 => given,
        _ => measured().unwrap_or(HALF_WIDTH_M),
    };
    let mesh = surface.mesh(&region(position, half_width_m, &settings.registration()), settings);
    note(evidence, &surface, &mesh);
    let needed = settings.shape_triangles_min as usize;
    if mesh.triangles.len() < needed {
        evidence.missing = Some(format!(
            "dense stereo finds too little surface around the target: {} triangles, {needed} are needed",
            mesh.triangles.len()
        ));
        return;
    }
    evidence.view = Some(Arc::new(View {
        step: input.step,
        site_from_rover: *input.site_from_rover,
        position_in_rover: position,
        covariance_in_rover: covariance,
        ray: input.left.ray(input.pixel),
        half_width_m,
        mesh,
        left: input.left.clone(),
        image: Arc::clone(&input.capture.pair.left),
    }));
}

/// A stop as dense stereo needs it.
#[derive(Clone, Copy)]
struct Look<'a> {
    capture: &'a Capture,
    cameras: [&'a Camera; 2],
    shared: Option<store::Shared<'a>>,
    settings: &'a crate::settings::Settings,
}

impl Look<'_> {
    /// The surface of the stop around a target; a sentence where there is none.
    fn surface(&self, target: &Point3) -> Result<Arc<StopSurface>, String> {
        let distance_m = (target - self.cameras[0].model.centre()).norm();
        let stereo = self.settings.shape.stereo(distance_m);
        let find = || StopSurface::measure(&self.capture.pair, self.cameras, &stereo);
        store::surface(self.shared, &stereo, find).map_err(|error| format!("no surface: {error}"))
    }
}

fn region(centre: Point3, half_width_m: f64, settings: &ShapeSettings) -> Region {
    Region { centre, radius_m: region_radius_m(half_width_m, settings, 0.0) }
}

fn note(evidence: &mut ShapeEvidence, surface: &StopSurface, mesh: &Mesh) {
    evidence.surface = Some(surface.seen(mesh));
    evidence.arrays.disparities = surface.shown_disparities();
    evidence.arrays.ranges = surface.shown_ranges();
}

/// The target at a later stop, by the shape where `asked` says why, else by what the features say.
fn locate(input: &LocateInput<'_>, base: Option<Located>, asked: Option<String>, why: String) -> Located {
    let mut evidence = ShapeEvidence { why, ..ShapeEvidence::default() };
    let mut base = base.unwrap_or_default();
    if let Evidence::Features(features) = std::mem::take(&mut base.evidence) {
        evidence.features = Some(features);
    }
    let by_shape = asked.and_then(|_| by_shape(input, &base, &mut evidence));
    let is_sure = base.position_in_rover.is_some() && base.confidence >= least_confidence(input);
    evidence.is_judged_by_shape = by_shape.is_some() || evidence.registration.is_some() && !is_sure;
    let mut located = match by_shape {
        Some(found) => {
            if let Some(features) = evidence.features.as_mut() {
                let now_from_first = features.carried.map(|carried| carried.now_from_first);
                let renewed = found.position_in_rover.zip(found.covariance_in_rover).zip(now_from_first);
                features.carried = renewed.map(|((position, covariance), now_from_first)| Carried {
                    now_from_first,
                    ..Carried::designated(position, covariance)
                });
            }
            found
        }
        None if base.position_in_rover.is_some() => base,
        None => {
            let missing = evidence.registration.as_ref().and_then(|found| found.reason.clone());
            let missing = missing.or_else(|| evidence.missing.clone()).or(base.missing);
            Located { missing, ..Located::default() }
        }
    };
    if let Some(view) = evidence.view.take() {
        evidence.view =
            located.position_in_rover.zip(located.covariance_in_rover).map(|(position, covariance)| {
                let there = View::clone(&view);
                Arc::new(View { position_in_rover: position, covariance_in_rover: covariance, ..there })
            });
    }
    located.evidence = Evidence::Shape(Box::new(evidence));
    located
}

/// The target by registration; none where that is not to be used, and why is in the evidence.
fn by_shape(input: &LocateInput<'_>, base: &Located, evidence: &mut ShapeEvidence) -> Option<Located> {
    let views = &input.target.views;
    let is_hand_off = input.place.is_hand_over && views.last.is_some();
    let Some(view) = (if is_hand_off { &views.last } else { &views.first }) else {
        evidence.missing = Some("the surface of the first view is not known".to_owned());
        return None;
    };
    let settings = &input.settings.shape;
    let begin = Start::new(input, base, view, evidence.features.as_deref(), is_hand_off);
    let expected = begin.position;
    let sigma_m = begin.prior.target_m2.symmetric_eigenvalues().max().max(0.0).sqrt();
    let search_m = settings.search_m(sigma_m, view.half_width_m);
    let registration = ShapeSettings { search_half_range_m: Some(search_m), ..settings.registration() };
    let cameras = [&input.pointing.left, &input.pointing.right];
    let look = Look { capture: input.capture, cameras, shared: input.shared, settings: input.settings };
    let surface = match look.surface(&expected) {
        Ok(surface) => surface,
        Err(why) => {
            evidence.missing = Some(why);
            return None;
        }
    };
    let mesh = surface.mesh(&region(expected, view.half_width_m, &registration), settings);
    note(evidence, &surface, &mesh);
    let start = view.start_from(begin.fixed_from_moving, &expected);
    let found = register(
        &RegistrationInput {
            fixed: &view.mesh,
            moving: &mesh,
            start_fixed_from_moving: &start,
            target_in_fixed: &view.position_in_rover,
            half_width_m: view.half_width_m,
            prior: Some(begin.prior).filter(|_| settings.shape_prior),
            sensor: None,
        },
        &registration,
    );
    let mut target =
        (found.failure.is_none()).then(|| carried(&found, view, &mesh, settings.carried_ray)).flatten();
    let mut registered = registered(&found, view, (&expected, is_hand_off), &registration);
    if is_hand_off && settings.hand_off_picture && is_left_to_the_picture(found.failure.as_ref()) {
        target = by_picture(input, view, &found, &mut registered).or(target);
    }
    if let Some(target) = &target {
        registered.correction_m = Some((target.position - expected).norm());
        registered.ray = target.ray;
    }
    evidence.registration = Some(registered);
    evidence.arrays.add(&found, [&view.mesh, &mesh], &found.fixed_from_moving.inverse());
    // Kept with the position that this stop ends with.
    evidence.view = Some(Arc::new(View {
        step: input.place.step,
        site_from_rover: *input.site_from_rover,
        position_in_rover: expected,
        covariance_in_rover: input.prediction.covariance_in_rover,
        ray: None,
        half_width_m: view.half_width_m,
        mesh,
        left: cameras[0].clone(),
        image: Arc::clone(&input.capture.pair.left),
    }));
    let target = target?;
    Some(Located {
        left_pixel: cameras[0].project(&target.position),
        right_pixel: cameras[1].project(&target.position),
        position_in_rover: Some(target.position),
        covariance_in_rover: Some(target.covariance),
        confidence: found.agreement[2].map_or(0.0, |agreement| agreement.overlap),
        ..Located::default()
    })
}

/// Where the target is thought to be before it is registered.
struct Start {
    /// Position, m, present rover frame.
    position: Point3,
    /// How the present rover frame is turned in that of the earlier view.
    fixed_from_moving: UnitQuaternion<f64>,
    /// How well both are known.
    prior: Prior,
}

impl Start {
    /// By the features where they are sure, else by dead reckoning; where cameras change, by the rover that stands still.
    fn new(
        input: &LocateInput<'_>,
        base: &Located,
        view: &View,
        features: Option<&FeatureEvidence>,
        is_hand_off: bool,
    ) -> Self {
        let settings = &input.settings.shape;
        let prediction = input.prediction;
        let by_poses = view.turn_to(input.site_from_rover);
        if is_hand_off {
            let target_m2 = Matrix3::identity() * settings.hand_off_shift_m.powi(2);
            let prior = Prior { target_m2, attitude_rad: settings.hand_off_turn_deg.to_radians() };
            return Self { position: prediction.position_in_rover, fixed_from_moving: by_poses, prior };
        }
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
                    target_m2: prediction.covariance_in_rover,
                    attitude_rad: settings.shape_attitude_deg.to_radians(),
                },
            },
        }
    }
}

/// Whether a picture may decide: the surfaces fit, though they may let the target slide.
const fn is_left_to_the_picture(failure: Option<&Failure>) -> bool {
    matches!(
        failure,
        None | Some(
            Failure::NotEnoughShape { .. } | Failure::NotIsolated { .. } | Failure::AtSearchEdge { .. }
        )
    )
}

/// The target in the present image by the earlier one draped over the surface; none where it is not found.
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
            registered.add_picture(draped, &covariance, settings.hand_off_score_min);
            let covariance = covariance + view_covariance(found, view);
            Some(CarriedTarget { position, covariance, ray: None })
        }
        Err(why) => {
            registered.draped_missing = Some(why);
            None
        }
    }
}

/// The covariance that the target had in the earlier view, turned into the present rover frame, m².
fn view_covariance(found: &Registration, view: &View) -> Matrix3<f64> {
    let turn = found.fixed_from_moving.rotation.inverse().to_rotation_matrix();
    turn.matrix() * view.covariance_in_rover * turn.matrix().transpose()
}

/// A target that a registration carried here.
struct CarriedTarget {
    position: Point3,
    covariance: Matrix3<f64>,
    ray: Option<carried_ray::RayMeeting>,
}

/// The target in the present rover frame; none where the registration has no covariance.
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

/// A registration in numbers.
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
        checks: evidence::checks(found, view.half_width_m, settings),
        failure: found.failure,
        reason: found.failure.map(|failure| failure.to_string()),
    }
}
