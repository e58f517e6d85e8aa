//! The fraction of a pixel that three sums tell.
//!
//! ```text
//! δ = (S₋ − S₊) / (2 (max(S₋, S₊) − S₀))
//! ```

/// From −½ to ½, by the sums of the disparity before, the best one, and the one after.
#[inline(always)]
pub(super) fn fraction([before, best, after]: [u16; 3]) -> f32 {
    let (before, after) = (f32::from(before) - f32::from(best), f32::from(after) - f32::from(best));
    let steeper = before.max(after);
    if steeper > 0.0 { (before - after) / (2.0 * steeper) } else { 0.0 }
}
