//! The fraction of a pixel that three sums tell.
//!
//! ```text
//! δ = (S₋ − S₊) / (2 (max(S₋, S₊) − S₀))        two lines of equal slope through the three
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | S₋, S₀, S₊ | `before`, `best`, `after`: sums at d₁ − 1, d₁, d₁ + 1 | bits |
//! | δ | [`fraction`] | px |
//!
//! Departure from JPL's parabola (domain.md 7, step 4): bits that differ grow about as the distance does, not as its square,
//! and a parabola would draw disparities to whole pixels. The sums of paths draw them there as well, since a step of one
//! disparity has its price. Semi-global matching therefore takes the fraction from the costs themselves, summed over some
//! pixels of the row ([`three_along_row`]); where these have their least elsewhere, the sums of the paths remain (ours).

/// Half of the pixels of a row over which costs are summed.
const HALF: usize = 4;

/// From −½ to ½ px, by the sums of the disparity before, the best one, and the one after.
#[inline(always)]
pub(super) fn fraction([before, best, after]: [u16; 3]) -> f32 {
    let (before, after) = (f32::from(before) - f32::from(best), f32::from(after) - f32::from(best));
    let steeper = before.max(after);
    if steeper > 0.0 { (before - after) / (2.0 * steeper) } else { 0.0 }
}

/// Costs of the disparities before, at and after the place `index`, summed over pixels of the row beside `x`; `costs` are those
/// of the row, `cells` for each of its `width` pixels. `None` where the middle is not the least.
#[inline(always)]
pub(super) fn three_along_row(
    costs: &[u8],
    [width, cells]: [usize; 2],
    x: usize,
    index: usize,
) -> Option<[u16; 3]> {
    if index == 0 || index + 1 >= cells {
        return None;
    }
    let mut three = [0u16; 3];
    for u in x.saturating_sub(HALF)..(x + HALF + 1).min(width) {
        let cells = &costs[u * cells + index - 1..][..3];
        for k in 0..3 {
            three[k] = three[k].wrapping_add(u16::from(cells[k]));
        }
    }
    (three[1] <= three[0] && three[1] <= three[2]).then_some(three)
}
