//! The fixed drive followed by its features: a grid of them that moves by a few pixels from stop to stop.

use std::sync::Arc;

use nalgebra::{Matrix3, Matrix6};
use sightline_geometry::estimate::ransac::Refit;
use sightline_geometry::frames::{Pixel, Point3};
use sightline_session::step::RunStep;
use sightline_session::summary::summarise;
use sightline_track::locate::features::FeatureEvidence;
use sightline_track::locate::features::evidence::{
    AnchorTried, Bootstrapped, CLOUD_COLUMNS, Detected, FeatureColumn, FittedMotion, MatchedFeatures, Table,
};
use sightline_track::locate::{Evidence, gate_kinds};
use sightline_track::settings::{Settings, TrackerKind};
use sightline_track::trace::{ArrayName, StepKind};
use sightline_vision::image::{GrayImage, npy};

use crate::cache::{Item, Key, StepKey};
use crate::state::State;
use crate::tables;
use crate::tests::fixture;

/// Features of the left image.
pub(crate) const FEATURES: usize = 60;
/// Number of triangulated features: all but every fourth.
pub(crate) const POINTS: usize = 45;
/// Number of features matched with the earlier stop: the first of the triangulated ones.
pub(crate) const MATCHES: usize = 30;
/// Number of inliers: all but every fifth match.
pub(crate) const INLIERS: usize = 24;
/// Number of bootstrap sets.
const SETS: usize = 40;
/// Position of the target, m, rover frame.
const POSITION: [f64; 3] = [6.0, 0.4, 0.2];

/// A session with one target and its run by features, at `step`, with all data of that step loaded.
pub(crate) fn at_step(context: &egui::Context, step: usize) -> State {
    let mut state = fixture::at_step(context, step);
    let traces: Vec<RunStep> = (0..fixture::STOPS - 1).map(trace).collect();
    if let Some(session) = &mut state.session {
        let run = &mut session.targets[0].runs[0];
        run.settings = Settings { tracker: TrackerKind::Features, ..Settings::default() };
        run.rows = traces.iter().map(RunStep::row).collect();
        run.summary = summarise(&traces);
    }
    let Some(trace) = traces.into_iter().nth(step) else { return state };
    let key = StepKey { session: "s1".to_owned(), target: 0, run: 0, step };
    for name in [ArrayName::FEATURES, ArrayName::CLOUD] {
        let Some(view) = trace.array(name) else { continue };
        let [width, height] = view.size();
        let array = GrayImage::from_raw(width, height, view.values().to_vec()).unwrap();
        let table = tables::Table::from_npy(name, &npy::encode(&array).unwrap()).unwrap();
        state.cache.store(Key::Array(key.clone(), name), Ok(Item::Table(Arc::new(table))), 0.0);
    }
    fixture::load(&mut state, trace);
    state
}

/// The record of a step: the designation by point stereo, then motions from the one or two previous stops.
pub(crate) fn trace(step: usize) -> RunStep {
    let mut trace = fixture::trace(step);
    let located = trace.located_mut().unwrap();
    let is_pick = step == 0;
    let designation = match std::mem::take(&mut located.evidence) {
        Evidence::Template(evidence) if is_pick => Some(evidence),
        _ => None,
    };
    let mut evidence = FeatureEvidence { designation, detect: Some(detected()), ..Default::default() };
    evidence.table = table(step).into();
    if !is_pick {
        located.confidence = 0.354;
        evidence.anchors =
            (0..step).rev().take(2).map(|earlier| anchor(earlier, earlier + 1 == step)).collect();
        evidence.match_features = Some(MatchedFeatures {
            from_step: step - 1,
            then: 50,
            now: POINTS,
            matches: MATCHES,
            prior_given_up: false,
        });
        evidence.fit_motion = Some(fitted());
        evidence.bootstrap = Some(Bootstrapped {
            sets: SETS,
            covariance: Matrix6::identity() * 1e-6,
            sigma_translation_m: [0.001, 0.002, 0.003],
            sigma_rotation_deg: [0.05, 0.06, 0.07],
        });
        evidence.cloud = cloud().into();
        located.covariance_in_rover = Some(Matrix3::from_diagonal(&nalgebra::Vector3::new(4e-4, 1e-4, 1e-4)));
    }
    located.evidence = Evidence::Features(Box::new(evidence));
    if let StepKind::Tracked { judge: verdict, .. } = &mut trace.kind {
        let confidence = gate_kinds().into_iter().find(|kind| kind.name == "confidence").unwrap();
        verdict.gates = vec![confidence.judge(Some(0.354), 0.5)];
    }
    trace
}

fn detected() -> Detected {
    let (left, right) = (FEATURES, FEATURES + 2);
    Detected { left, right, stereo_matches: POINTS + 3, points: POINTS, median_range_m: Some(5.5) }
}

fn anchor(step: usize, chosen: bool) -> AnchorTried {
    let missing = (!chosen).then(|| "fewer than three matches".to_owned());
    let sigma_m = chosen.then_some(0.021);
    AnchorTried { step, matches: MATCHES, inliers: INLIERS, confidence: 0.354, sigma_m, missing, chosen }
}

fn fitted() -> FittedMotion {
    FittedMotion {
        translation_m: [-1.0, 0.01, 0.002],
        roll_pitch_yaw_deg: [0.1, -0.2, 1.5],
        inliers: INLIERS,
        rms_m: 0.008,
        median_m: 0.006,
        consensus_by_draw: (0..20).map(|draw| 3 + draw * 7 % 20).collect(),
        refits: vec![Refit { inliers: 23, rms_m: 0.009 }, Refit { inliers: 24, rms_m: 0.008 }],
        correction_m: 0.05,
    }
}

/// A grid of features; scales are from 1 to 4 px, residuals of inliers from 1 to 24 mm, those of outliers 0.3 m.
fn table(step: usize) -> Table {
    let mut values = vec![f32::NAN; FEATURES * FeatureColumn::COUNT];
    let (mut points, mut inliers) = (0, 0);
    for (i, row) in values.chunks_exact_mut(FeatureColumn::COUNT).enumerate() {
        let mut set = |column: FeatureColumn, value: f32| row[column as usize] = value;
        let (x, y) = (100.0 + 80.0 * (i % 10) as f32, 200.0 + 100.0 * (i / 10) as f32);
        set(FeatureColumn::X, x);
        set(FeatureColumn::Y, y);
        set(FeatureColumn::Sigma, 1.0 + (i % 4) as f32);
        set(FeatureColumn::Orientation, 0.1 * i as f32);
        if i % 4 == 3 {
            continue;
        }
        set(FeatureColumn::RightX, x - 58.0);
        set(FeatureColumn::RightY, y + 0.5);
        set(FeatureColumn::Range, 4.0 + 0.05 * i as f32);
        points += 1;
        if step == 0 || points > MATCHES {
            continue;
        }
        let is_inlier = points % 5 != 0;
        inliers += usize::from(is_inlier);
        set(FeatureColumn::ThenX, x - if is_inlier { 12.0 } else { 90.0 });
        set(FeatureColumn::ThenY, y - 6.0);
        set(FeatureColumn::MovedX, x - if is_inlier { 0.5 } else { 70.0 });
        set(FeatureColumn::MovedY, y + 0.25);
        set(FeatureColumn::Residual, if is_inlier { 0.001 * inliers as f32 } else { 0.3 });
        set(FeatureColumn::Inlier, f32::from(u8::from(is_inlier)));
    }
    Table { columns: FeatureColumn::COUNT as u32, values }
}

/// A spiral about the target.
fn cloud() -> Table {
    let [x, y, z] = POSITION;
    let values = (0..SETS).flat_map(|i| {
        let (sin, cos) = (0.7 * i as f64).sin_cos();
        let reach = 0.0005 * i as f64;
        let at = Point3::new(x + reach * cos, y + reach * sin, z);
        let pixel = fixture::PIXEL.offset(200.0 * reach * cos, 200.0 * reach * sin);
        [at.x, at.y, at.z, pixel.x, pixel.y].map(|v| v as f32)
    });
    Table { columns: CLOUD_COLUMNS as u32, values: values.collect() }
}

/// Pixel of the first inlier.
pub(crate) const FIRST_INLIER: Pixel = Pixel::new(100.0, 200.0);
