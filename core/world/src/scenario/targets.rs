//! The rule that chooses the targets.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::range::within;
use sightline_geometry::error::Result;

/// Choice of targets among the pixels that satisfy the window rule; module `targets` defines each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Arrangement {
    /// Drawn by the seed around the targets' centre.
    #[default]
    Drawn,
    /// In straight, evenly spaced rows on the large rock (R110).
    Rows,
    /// On the large rock, some on an occluding boundary (R119).
    Face,
    /// The centre of the visible part of the rock at the targets' centre.
    Centre,
    /// One target on each placed rock, at the centre of its visible part (R209).
    Placed,
}

/// The rule that chooses targets; module `targets` defines it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TargetRule {
    /// Number of targets.
    pub count: u32,
    /// Choice among the pixels that satisfy the window rule (drawn).
    pub arrangement: Arrangement,
    /// Rows of the arrangement `rows` (2: Kim09 §5.1).
    pub rows: u32,
    /// Number of targets of the arrangement `face` that are on an occluding boundary (1: Kim09 §5.2).
    pub boundary: u32,
    /// Largest distance of a target's surface point from the targets' centre, m.
    pub radius_m: f64,
    /// Side of the square window on which the rule is tested, px of this image (21: ours; reduce it together with the
    /// image, 11 at 512 and 7 at 256, or few windows are even enough).
    pub window_px: u32,
    /// Largest fraction of the window in shadow (0.20: ours).
    pub shadow_fraction: f64,
    /// Largest range of depth inside the window, relative to the distance (0.10: ours).
    pub depth_range_fraction: f64,
    /// Whether targets must be on rocks, off their occluding boundaries (true: Kim09 §5.2).
    pub on_rocks: bool,
    /// Smallest fraction of the window that is on the same rock as the target (0.90, ours).
    pub same_rock_fraction: f64,
    /// Largest angle between normal and line of sight, at the first and at the last stop, in 90 % of the window,
    /// degrees (70, ours): a face seen edge-on is no place to drive to.
    pub incidence_deg: f64,
}

impl Default for TargetRule {
    fn default() -> Self {
        Self {
            count: 20,
            arrangement: Arrangement::Drawn,
            rows: 2,
            boundary: 1,
            radius_m: 1.6,
            window_px: 21,
            shadow_fraction: 0.20,
            depth_range_fraction: 0.10,
            on_rocks: true,
            same_rock_fraction: 0.90,
            incidence_deg: 70.0,
        }
    }
}

impl TargetRule {
    /// Number of targets that a world must offer to be usable: `count`, or at most 1 for the arrangement `centre`.
    pub fn wanted(&self) -> u32 {
        if self.arrangement == Arrangement::Centre { self.count.min(1) } else { self.count }
    }

    pub(crate) fn validate(&self) -> Result<()> {
        within("targets.rows", f64::from(self.rows), 1.0, 100.0)?;
        within("targets.boundary", f64::from(self.boundary), 0.0, 10_000.0)?;
        within("targets.count", f64::from(self.count), 0.0, 10_000.0)?;
        within("targets.radius_m", self.radius_m, 0.05, 20.0)?;
        within("targets.window_px", f64::from(self.window_px), 1.0, 201.0)?;
        within("targets.shadow_fraction", self.shadow_fraction, 0.0, 1.0)?;
        within("targets.same_rock_fraction", self.same_rock_fraction, 0.0, 1.0)?;
        within("targets.incidence_deg", self.incidence_deg, 0.0, 90.0)?;
        within("targets.depth_range_fraction", self.depth_range_fraction, 0.0, 10.0)
    }
}
