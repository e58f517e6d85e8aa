//! The shape tracker, and the combined one: `surface` → `coarse_register` → `refine_register` → `carried_ray`
//! (Deans et al. 2005, D§2 and D§4).
//!
//! | tracker | during the drive | at the last stop of a camera pair | at a hand-off |
//! |---|---|---|---|
//! | `shape` | registered to the first view, stop by stop (R189) | as during the drive | registered to the last view of the old pair |
//! | `combined` | features (R154) | features, then registered to the first view | as `shape` |
//!
//! ```text
//! start            the target by features or by dead reckoning, the attitude by the pose estimates      (R197)
//! registration     x = T⁻¹ x_first                                   Σ = Σ_reg + R⁻¹ Σ_first R
//! carried ray      x = intersection of the designation's line of sight, carried by T, with the current surface
//! ```
//! At a hand-off the last image is draped over its surface and matched in the new camera's image (`drape`), which
//! constrains the target where flat faces let it slide. The registration at the end removes the error that the
//! features accumulated, and the ray that of the first range. A registration that fails reports why and leaves the
//! target to the features if their confidence suffices; at a hand-off there are no features to fall back on.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | T, R | `Registration::fixed_from_moving` and its rotation | rover frames of the two stops |
//! | x_first, Σ_first | `View::position_in_rover`, `View::covariance_in_rover` | m, m², rover frame of the first view |
//! | Σ_reg | `Registration::covariance_in_moving` | m² |
//!
//! The registration of one stop is in `register_stop`, the instrument-placement target in `placement`.
//!
//! Source: D§2, D§4; R146, R154, R187–R206.

pub mod carried_ray;
pub mod drape;
pub mod evidence;
pub mod failure;
mod gates;
mod half_width;
mod look;
mod register_stop;
pub mod placement;
pub mod rows;
pub mod settings;
pub mod surface;
pub mod view;

pub use evidence::ShapeEvidence;
pub use settings::{ShapeTrackerSettings, ShapeUse};

use std::sync::Arc;

use self::register_stop::by_shape;
use serde::{Deserialize, Serialize};

use self::failure::ShapeFailure;
use self::look::{Look, least_confidence, note, region};
use self::view::{View, Views};
use super::features::anchor::{Anchors, Carried};
use super::features::{self, FeatureEvidence, FeatureTracker};
use super::template::TemplateTracker;
use super::tracker::{Accepted, DesignateInput, GateInput, LocateInput, Sighting, Tracker};
use crate::gate::{Gate, GateKind};
use sightline_vision::registration::Region;

/// The rock is measured on the surface within this distance of the target, m.
const MEASURED_WITHIN_M: f64 = 0.9;
/// Half width of a rock that cannot be measured, m (R200).
const HALF_WIDTH_M: f64 = 0.25;

/// Locates the target by the shape of its surroundings at every stop (Deans et al. 2005).
#[derive(Clone, Copy, Debug)]
pub struct ShapeTracker;

/// Locates the target by features during the drive and by the shape at the end (Deans et al. 2005, D§4).
#[derive(Clone, Copy, Debug)]
pub struct CombinedTracker;

/// The memory of the combined tracker.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CombinedMemory {
    /// The stops from which a motion can be measured.
    pub features: Anchors,
    /// The views that later stops are registered to.
    pub views: Views,
}

impl Tracker for ShapeTracker {
    type Memory = Views;
    type Evidence = ShapeEvidence;

    const GATES: &'static [GateKind] = &gates::GATES;
    const STEPS: &'static [&'static str] = &["surface", "coarse_register", "refine_register", "carried_ray"];

    fn designate(&self, input: &DesignateInput<'_>) -> (Sighting<ShapeEvidence>, Option<Views>) {
        let (by_template, _) = TemplateTracker.designate(input);
        let (mut found, designation) = by_template.replace(ShapeEvidence::default());
        let mut evidence =
            ShapeEvidence { designation: Some(Box::new(designation)), ..ShapeEvidence::default() };
        first_view(input, &found, &mut evidence);
        // Without a first view no later stop can be registered to it.
        if let Some(missing) = evidence.missing.clone() {
            found = Sighting::nothing(missing, ShapeEvidence::default());
        }
        let memory = found.position_in_rover.map(|_| remembered(Views::default(), &evidence));
        (Sighting { evidence, ..found }, memory)
    }

    fn locate(&self, input: &LocateInput<'_>, memory: &Views) -> Sighting<ShapeEvidence> {
        let why = "the shape tracker registers the surface at every stop".to_owned();
        locate(input, memory, None, Some(why.clone()), why)
    }

    fn gates(&self, evidence: &ShapeEvidence, _: &GateInput<'_>) -> Vec<Gate> {
        gates::of_registration(evidence.checks())
    }

    fn remember(&self, memory: Views, evidence: &ShapeEvidence, _: &Accepted<'_>) -> Views {
        remembered(memory, evidence)
    }
}

impl Tracker for CombinedTracker {
    type Memory = CombinedMemory;
    type Evidence = ShapeEvidence;

    const GATES: &'static [GateKind] = &gates::WITH_CONFIDENCE;
    const STEPS: &'static [&'static str] = &[
        "detect",
        "match_features",
        "triangulate",
        "fit_motion",
        "bootstrap",
        "surface",
        "coarse_register",
        "refine_register",
        "carried_ray",
    ];

    fn designate(&self, input: &DesignateInput<'_>) -> (Sighting<ShapeEvidence>, Option<CombinedMemory>) {
        let (by_features, anchors) = FeatureTracker.designate(input);
        let (found, features) = by_features.replace(ShapeEvidence::default());
        let mut evidence = ShapeEvidence { features: Some(Box::new(features)), ..ShapeEvidence::default() };
        first_view(input, &found, &mut evidence);
        let memory = anchors
            .map(|features| CombinedMemory { features, views: remembered(Views::default(), &evidence) });
        (Sighting { evidence, ..found }, memory)
    }

    fn locate(&self, input: &LocateInput<'_>, memory: &CombinedMemory) -> Sighting<ShapeEvidence> {
        if input.place.is_hand_over {
            let why = "hand-off to other cameras at this stop".to_owned();
            return locate(input, &memory.views, None, Some(why.clone()), why);
        }
        let by_features = FeatureTracker.locate(input, &memory.features);
        let is_lost =
            by_features.position_in_rover.is_none() || by_features.confidence < least_confidence(input);
        let asked = match input.settings.shape.shape_use {
            _ if input.place.is_last_of_pair => Some("last stop with these cameras"),
            ShapeUse::EveryStop => Some("the surface is registered at every stop"),
            ShapeUse::WhenLost if is_lost => Some("the features lost the target"),
            ShapeUse::AtEnd | ShapeUse::WhenLost => None,
        };
        let why = asked
            .unwrap_or("features follow the target on the way; the surface is registered at the last stop");
        locate(input, &memory.views, Some(by_features), asked.map(str::to_owned), why.to_owned())
    }

    fn gates(&self, evidence: &ShapeEvidence, input: &GateInput<'_>) -> Vec<Gate> {
        match evidence.features.is_some() && !evidence.is_judged_by_shape {
            true => vec![features::gates::confidence(input)],
            false => gates::of_registration(evidence.checks()),
        }
    }

    fn remember(
        &self,
        memory: CombinedMemory,
        evidence: &ShapeEvidence,
        update: &Accepted<'_>,
    ) -> CombinedMemory {
        let features = match evidence.features.as_deref() {
            Some(features) => FeatureTracker.remember(memory.features, features, update),
            None => memory.features,
        };
        CombinedMemory { features, views: remembered(memory.views, evidence) }
    }
}

/// Adds the view of this stop if its surface was measured.
fn remembered(views: Views, evidence: &ShapeEvidence) -> Views {
    match &evidence.view {
        Some(view) => views.with(Arc::clone(view)),
        None => views,
    }
}

/// Measures the surface of the designation.
fn first_view(input: &DesignateInput<'_>, located: &Sighting<ShapeEvidence>, evidence: &mut ShapeEvidence) {
    evidence.why = "later stops are registered to the surface at the designation".to_owned();
    let (Some(position), Some(covariance)) = (located.position_in_rover, located.covariance_in_rover) else {
        return;
    };
    let cameras = [input.left, input.right];
    let look = Look {
        capture: input.capture,
        cameras,
        shared: input.shared,
        settings: input.settings,
        cancel: input.cancel,
    };
    let settings = &input.settings.shape;
    let surface = match look.surface(&position) {
        Ok(surface) => surface,
        Err(why) => {
            evidence.missing = Some(why.to_string());
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
        let failure = ShapeFailure::TooLittleSurface { triangles: mesh.triangles.len(), needed };
        evidence.missing = Some(failure.to_string());
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

/// Locates the target at a later stop: by the shape if `asked` is the reason to do so, otherwise by the features.
fn locate(
    input: &LocateInput<'_>,
    views: &Views,
    base: Option<Sighting<FeatureEvidence>>,
    asked: Option<String>,
    why: String,
) -> Sighting<ShapeEvidence> {
    let mut evidence = ShapeEvidence { why, ..ShapeEvidence::default() };
    let (base, features) = match base {
        Some(base) => {
            let (base, features) = base.replace(ShapeEvidence::default());
            (base, Some(Box::new(features)))
        }
        None => (Sighting::default(), None),
    };
    evidence.features = features;
    let asked = asked.filter(|_| !input.cancel.is_requested());
    let by_shape = asked.and_then(|_| by_shape(input, views, &base, &mut evidence));
    let is_sure = base.position_in_rover.is_some() && base.confidence >= least_confidence(input);
    evidence.is_judged_by_shape = by_shape.is_some() || evidence.registration.is_some() && !is_sure;
    let located = match by_shape {
        Some((found, turn)) => {
            if let Some(features) = evidence.features.as_mut() {
                // The features continue from the registered position, even if they had lost the target.
                let now_from_first = features.carried.map_or(turn, |carried| carried.now_from_first);
                let renewed = found.position_in_rover.zip(found.covariance_in_rover);
                features.carried = renewed.map(|(position, covariance)| Carried {
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
            Sighting { missing, ..Sighting::default() }
        }
    };
    if let Some(view) = evidence.view.take() {
        evidence.view =
            located.position_in_rover.zip(located.covariance_in_rover).map(|(position, covariance)| {
                let there = View::clone(&view);
                Arc::new(View { position_in_rover: position, covariance_in_rover: covariance, ..there })
            });
    }
    Sighting { evidence, ..located }
}
