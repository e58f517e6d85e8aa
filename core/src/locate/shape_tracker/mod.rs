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
//! One stop's registration is in `register_stop`; what the arm is told at the end in `placement`.
//!
//! Source: D§2, D§4; R146, R154, R187–R206.

pub mod carried_ray;
pub mod drape;
pub mod evidence;
mod half_width;
mod register_stop;
pub mod placement;
pub mod rows;
pub mod settings;
pub mod surface;
pub mod view;

pub use evidence::ShapeEvidence;
pub use settings::{ShapeTrackerSettings, ShapeUse};

#[cfg(test)]
mod recorded_tests;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use self::register_stop::by_shape;
use self::surface::StopSurface;
use self::view::View;
use super::features::FeatureLocator;
use super::features::anchor::Carried;
use super::shape::{Mesh, Region, ShapeSettings, region_radius_m};
use super::template::TemplateLocator;
use super::{DesignateInput, Evidence, LocateInput, Located, Locator, store};
use crate::camera::Camera;
use crate::frames::Point3;
use crate::stages::capture::Capture;

/// The rock is measured on the surface this far around the target, m.
const MEASURED_WITHIN_M: f64 = 0.9;
/// Half the width of what cannot be measured, m (R200).
const HALF_WIDTH_M: f64 = 0.25;

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
