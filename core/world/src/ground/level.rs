//! The level of the site: the height of its mean ground.

/// Height of the mean plane at the origin, m, site frame: flat ground in the rover frame (domain.md 1.3).
pub(crate) const MEAN_GROUND_Z_M: f64 = 0.294;
