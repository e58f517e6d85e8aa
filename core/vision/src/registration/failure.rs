//! Why a registration is not to be used, as a named reason and a sentence.
//!
//! | reason | what a person would see |
//! |---|---|
//! | `EmptySurface`, `TooFewTriangles` | stereo found nothing there |
//! | `NoOverlap` | the two meshes lie side by side |
//! | `DoesNotFit` | another rock, or the rock has changed |
//! | `NotEnoughShape` | flat ground, or a smooth boulder: the mesh slides without getting worse |
//! | `TurnedAway` | the refinement turned the mesh until something fitted: another rock |
//! | `NotIsolated` | the coarse surface has two valleys |
//! | `AtSearchEdge` | the valley goes on beyond the search |
//!
//! The first that applies is given, in this order: without overlap nothing else means anything; what does not
//! fit has no place; without shape every place fits alike.
//!
//! Source: ours; R196 for the overlap.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Which of the two surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = RegisteredView)]
pub enum Side {
    /// The target's first view.
    Fixed,
    /// The present view.
    Moving,
}

impl std::fmt::Display for Side {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Fixed => "fixed",
            Self::Moving => "moving",
        })
    }
}

/// Why a registration is not to be used; its text is a sentence for a person.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema, thiserror::Error)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum Failure {
    /// A surface has no points near the target.
    #[error("the {side} surface has no points near the target")]
    EmptySurface {
        /// Which.
        side: Side,
    },
    /// A surface has too few triangles near the target.
    #[error("the {side} surface has {triangles} triangles near the target, fewer than {least}")]
    TooFewTriangles {
        /// Which.
        side: Side,
        /// How many it has.
        triangles: usize,
        /// How many are needed.
        least: usize,
    },
    /// The surfaces do not cover enough of the same pixels.
    #[error("the surfaces share {:.0} % of the target's pixels, less than {:.0} %", .share * 100.0, .least * 100.0)]
    NoOverlap {
        /// The largest share that any position gives, or that of the result.
        share: f64,
        /// What is needed.
        least: f64,
    },
    /// The refinement turned farther than the start can be off.
    #[error("the refinement rotated by {:.1}°, more than {:.1}°", .turn_rad.to_degrees(), .limit_rad.to_degrees())]
    TurnedAway {
        /// By how much, rad.
        turn_rad: f64,
        /// How much is allowed, rad.
        limit_rad: f64,
    },
    /// The shape lets the target slide.
    #[error("target uncertainty after registration: {}; the limit is {limit_m:.3} m", sigma_text(.sigma_m))]
    NotEnoughShape {
        /// 1σ in the weakest direction, m; none where nothing holds it.
        sigma_m: Option<f64>,
        /// What is needed, m.
        limit_m: f64,
    },
    /// The surfaces differ by more than their noise.
    #[error(
        "the RMS residual of the surfaces is {misfit:.1} times its predicted σ, more than {limit:.1} times"
    )]
    DoesNotFit {
        /// How many times.
        misfit: f64,
        /// How many are allowed.
        limit: f64,
    },
    /// The surfaces fit nearly as well elsewhere.
    #[error(
        "the surfaces fit {distance_m:.2} m away nearly as well: {ratio:.2} times the difference, less than {least:.2}"
    )]
    NotIsolated {
        /// How far away, m.
        distance_m: f64,
        /// The other's mean difference over that of the best.
        ratio: f64,
        /// What is needed.
        least: f64,
    },
    /// The best place is on the border of the coarse search.
    #[error("the best fit is on the border of the search, {range_m:.2} m from the start")]
    AtSearchEdge {
        /// How far the search goes, m.
        range_m: f64,
    },
}

fn sigma_text(sigma_m: &Option<f64>) -> String {
    sigma_m
        .map_or_else(|| "unlimited along one direction".to_owned(), |sigma_m| format!("{sigma_m:.3} m (1σ)"))
}
