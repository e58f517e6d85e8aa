//! Reasons to reject a registration, each with a sentence for the user.
//!
//! | reason | typical cause |
//! |---|---|
//! | `EmptySurface`, `TooFewTriangles` | stereo has no points there |
//! | `NoOverlap` | the two meshes do not overlap in the sensor's image |
//! | `DoesNotFit` | another rock, or the rock has changed |
//! | `NotEnoughShape` | flat ground, or a smooth boulder: the mesh slides without a larger residual |
//! | `TurnedAway` | the refinement rotated the mesh until it fitted: another rock |
//! | `NotIsolated` | J of the coarse search has two minima |
//! | `AtSearchEdge` | the minimum is outside the search range |
//!
//! The first reason that applies is reported, in this order: without overlap the other numbers are meaningless; a mesh
//! that does not fit has no valid position; without shape all positions fit equally well.
//!
//! Source: ours; R196 for the overlap.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// One of the two surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = RegisteredView)]
pub enum Side {
    /// The target's first view.
    Fixed,
    /// The current view.
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

/// Reason for rejecting a registration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema, thiserror::Error)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum Failure {
    /// A surface has no points near the target.
    #[error("the {side} surface has no points near the target")]
    EmptySurface {
        /// The surface without points.
        side: Side,
    },
    /// A surface has too few triangles near the target.
    #[error("the {side} surface has {triangles} triangles near the target, fewer than {least}")]
    TooFewTriangles {
        /// The surface concerned.
        side: Side,
        /// Its number of triangles.
        triangles: usize,
        /// The least number required.
        least: usize,
    },
    /// Too few pixels are covered by both surfaces.
    #[error("the surfaces share {:.0} % of the target's pixels, less than {:.0} %", .share * 100.0, .least * 100.0)]
    NoOverlap {
        /// Largest overlap of the coarse search, or the overlap of the result; a fraction of the fixed surface's pixels.
        share: f64,
        /// The least fraction required.
        least: f64,
    },
    /// The refinement rotated by more than the start can be in error.
    #[error("the refinement rotated by {:.1}°, more than {:.1}°", .turn_rad.to_degrees(), .limit_rad.to_degrees())]
    TurnedAway {
        /// Rotation from the start, rad.
        turn_rad: f64,
        /// Largest rotation accepted, rad.
        limit_rad: f64,
    },
    /// The shape does not constrain the target in every direction.
    #[error("target uncertainty after registration: {}; the limit is {limit_m:.3} m", sigma_text(.sigma_m))]
    NotEnoughShape {
        /// 1σ in the least constrained direction, m; `None` if that direction is unconstrained.
        sigma_m: Option<f64>,
        /// Largest 1σ accepted, m.
        limit_m: f64,
    },
    /// The surfaces differ by more than their noise.
    #[error(
        "the RMS residual of the surfaces is {misfit:.1} times its predicted σ, more than {limit:.1} times"
    )]
    DoesNotFit {
        /// RMS residual over its predicted σ.
        misfit: f64,
        /// Largest value accepted.
        limit: f64,
    },
    /// The surfaces fit nearly as well elsewhere.
    #[error(
        "the surfaces fit {distance_m:.2} m away nearly as well: {ratio:.2} times the difference, less than {least:.2}"
    )]
    NotIsolated {
        /// Distance between the two minima, m.
        distance_m: f64,
        /// Mean difference at the second minimum over that at the best.
        ratio: f64,
        /// Least ratio accepted.
        least: f64,
    },
    /// The best shift is on the border of the coarse search.
    #[error("the best fit is on the border of the search, {range_m:.2} m from the start")]
    AtSearchEdge {
        /// Half range of the search, m.
        range_m: f64,
    },
}

fn sigma_text(sigma_m: &Option<f64>) -> String {
    sigma_m
        .map_or_else(|| "unlimited along one direction".to_owned(), |sigma_m| format!("{sigma_m:.3} m (1σ)"))
}
