//! Matching of descriptors by their nearest neighbours (R158, R161).
//!
//! ```text
//! |a − b|² = Σ (a_i − b_i)²               ratio = |q − nearest| / |q − second nearest|
//! ```
//! Distances are exact integers. Without a constraint they are computed by a product of matrices (`products`); with one,
//! which usually leaves few pairs, one by one.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::{Descriptor, products};

/// The two nearest neighbours in a set; squared Euclidean distances. Of equal ones the lower index counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbours {
    /// Index of the nearest neighbour.
    pub nearest: u32,
    /// Squared distance of the nearest.
    pub distance2: u32,
    /// Squared distance of the second nearest; `None` in a set of one.
    pub second_distance2: Option<u32>,
}

/// A pair of descriptors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Index into the query set.
    pub query: u32,
    /// Index into the train set.
    pub train: u32,
    /// Euclidean distance.
    pub distance: f32,
    /// Distance over that of the second nearest (1 if both are 0); `None` without a second.
    pub ratio: Option<f32>,
}

/// Criteria for a nearest neighbour to be a match.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MatchSettings {
    /// Largest ratio of the distances to the nearest and the second nearest (Lowe: 0.8); `None`: no limit. A match
    /// without a second nearest passes.
    pub ratio_max: Option<f64>,
    /// Whether each must be the other's nearest neighbour.
    pub mutual: bool,
}

/// The nearest neighbours in `train` of each of `query`; `None` if `train` is empty.
pub fn nearest(query: &[Descriptor], train: &[Descriptor]) -> Vec<Option<Neighbours>> {
    products::nearest(query, train)
}

/// The nearest neighbours among the pairs that `allowed` (index into `query`, index into `train`) accepts.
pub fn nearest_where(
    query: &[Descriptor],
    train: &[Descriptor],
    allowed: impl Fn(usize, usize) -> bool + Sync,
) -> Vec<Option<Neighbours>> {
    let of_one = |(q, query): (usize, &Descriptor)| {
        let among: Vec<usize> = (0..train.len()).filter(|&t| allowed(q, t)).collect();
        Arch::new().dispatch(Among { query, train, among: &among })
    };
    query.par_iter().enumerate().map(of_one).collect()
}

/// Finds the nearest neighbours of a query among some of the train descriptors, one by one.
struct Among<'a> {
    query: &'a Descriptor,
    train: &'a [Descriptor],
    among: &'a [usize],
}

impl WithSimd for Among<'_> {
    type Output = Option<Neighbours>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        let Self { query, train, among } = self;
        let mut found: Option<Neighbours> = None;
        for &t in among {
            let distance2 = distance2(query, &train[t]);
            let (nearest, second) = (t as u32, found.map(|found| found.distance2));
            found = Some(match found {
                Some(found) if distance2 >= found.distance2 => {
                    let second = found.second_distance2.map_or(distance2, |second| second.min(distance2));
                    Neighbours { second_distance2: Some(second), ..found }
                }
                _ => Neighbours { nearest, distance2, second_distance2: second },
            });
        }
        found
    }
}

/// |a − b|², at most 128 · 255². Wrapping arithmetic, because checks of an impossible overflow would prevent vectorisation.
#[inline(always)]
pub fn distance2(a: &Descriptor, b: &Descriptor) -> u32 {
    let mut sum = 0_i32;
    for (&a, &b) in a.iter().zip(b) {
        let difference = i32::from(i16::from(a).wrapping_sub(i16::from(b)));
        sum = sum.wrapping_add(difference.wrapping_mul(difference));
    }
    sum.cast_unsigned()
}

/// The matches between two sets, in the order of `query`.
pub fn matches(query: &[Descriptor], train: &[Descriptor], settings: &MatchSettings) -> Vec<Match> {
    let back = settings.mutual.then(|| nearest(train, query));
    select(&nearest(query, train), back.as_deref(), settings)
}

/// The matches among the pairs that `allowed` (index into `query`, index into `train`) accepts.
pub fn matches_where(
    query: &[Descriptor],
    train: &[Descriptor],
    settings: &MatchSettings,
    allowed: impl Fn(usize, usize) -> bool + Sync,
) -> Vec<Match> {
    let back = settings.mutual.then(|| nearest_where(train, query, |t, q| allowed(q, t)));
    select(&nearest_where(query, train, &allowed), back.as_deref(), settings)
}

/// Selects the neighbours that pass the settings.
fn select(
    neighbours: &[Option<Neighbours>],
    back: Option<&[Option<Neighbours>]>,
    settings: &MatchSettings,
) -> Vec<Match> {
    let candidate = |(query, neighbours): (usize, &Option<Neighbours>)| {
        let Neighbours { nearest, distance2, second_distance2 } = (*neighbours)?;
        let returns = |back: &[Option<Neighbours>]| {
            back[nearest as usize].is_some_and(|back| back.nearest as usize == query)
        };
        let distance = f64::from(distance2).sqrt();
        let ratio = second_distance2
            .map(|second| if second == 0 { 1.0 } else { distance / f64::from(second).sqrt() });
        let is_distinct = settings.ratio_max.zip(ratio).is_none_or(|(most, ratio)| ratio <= most);
        (is_distinct && back.is_none_or(returns)).then(|| Match {
            query: query as u32,
            train: nearest,
            distance: distance as f32,
            ratio: ratio.map(|ratio| ratio as f32),
        })
    };
    neighbours.iter().enumerate().filter_map(candidate).collect()
}

#[cfg(test)]
#[path = "matching_tests.rs"]
mod tests;
