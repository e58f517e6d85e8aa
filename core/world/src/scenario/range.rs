//! The ranges of settings: the check of a number, and the largest seed.

use sightline_geometry::error::{Error, Result};

/// Largest seed that every reader of the file represents exactly (TOML has 63 bits, a browser 53).
pub(crate) const MAX_SEED: u64 = 1 << 53;

/// Rejects a value outside `[low, high]`, or NaN.
pub(crate) fn within(key: &str, value: f64, low: f64, high: f64) -> Result<()> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(Error::setting(key, format!("{value} is outside {low} to {high}")))
}
