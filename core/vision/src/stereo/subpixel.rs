//! The fraction of a disparity, from the sums of three neighbouring disparities.
//!
//! ```text
//! δ = (S₋ − S₊) / (2 (max(S₋, S₊) − S₀))        two lines of equal slope through the three
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | S₋, S₀, S₊ | `before`, `best`, `after`: sums at d₁ − 1, d₁, d₁ + 1 | bits |
//! | δ | [`fraction`] | px |
//!
//! Departure from JPL's parabola (domain.md 7, step 4): the number of differing bits grows about linearly with the
//! distance, not with its square, and a parabola would bias disparities towards whole pixels. The sums of paths have the
//! same bias, because a step of one disparity has a penalty. Semi-global matching therefore computes the fraction from
//! the costs themselves, summed over some pixels of the row ([`three_along_row`]); if these have their minimum
//! elsewhere, the sums of the paths are used (ours).

/// Half of the number of pixels over which costs are summed.
const HALF: usize = 4;

/// Returns −½ to ½ px, from the sums of the disparity before, the best one, and the one after.
#[inline(always)]
pub(super) fn fraction([before, best, after]: [u16; 3]) -> f32 {
    let (before, after) = (f32::from(before) - f32::from(best), f32::from(after) - f32::from(best));
    let steeper = before.max(after);
    if steeper > 0.0 { (before - after) / (2.0 * steeper) } else { 0.0 }
}

/// Costs of the disparities before, at and after `index`, summed over pixels of the row around `x`; `costs` are those of
/// the row, `cells` for each of its `width` pixels. `None` if the middle one is not the least, or at either end of the
/// range.
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
