//! Nearest descriptors (R158, R161).
//!
//! ```text
//! |a − b|² = |a|² + |b|² − 2 a·b          ratio = |q − nearest| / |q − second nearest|
//! ```
//! All numbers are whole and below 2²⁴: the distances are exact.

use rayon::prelude::*;

use super::Descriptor;

/// The two nearest of a set; squared Euclidean distances. Of equal ones the lower index counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Neighbours {
    /// Index of the nearest.
    pub nearest: u32,
    /// Its squared distance.
    pub distance2: u32,
    /// That of the second nearest, where there is one.
    pub second_distance2: Option<u32>,
}

/// A pair of descriptors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Index into the one set.
    pub query: u32,
    /// Index into the other.
    pub train: u32,
    /// Euclidean distance.
    pub distance: f32,
    /// This distance over that of the second nearest (1 where both are 0), where there is one.
    pub ratio: Option<f32>,
}

/// Which nearest neighbours are matches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MatchSettings {
    /// Greatest ratio of the distances to the nearest and the second nearest; Lowe: 0.8. Without a second nearest there is
    /// nothing to doubt the match.
    pub ratio_max: Option<f64>,
    /// Whether each must be the other's nearest.
    pub mutual: bool,
}

/// The nearest neighbours in `train` of each of `query`; none where `train` is empty.
pub fn nearest(query: &[Descriptor], train: &[Descriptor]) -> Vec<Option<Neighbours>> {
    nearest_where(query, train, |_, _| true)
}

/// The nearest neighbours among those that `allowed` (index into `query`, index into `train`) lets through.
pub fn nearest_where(
    query: &[Descriptor],
    train: &[Descriptor],
    allowed: impl Fn(usize, usize) -> bool + Sync,
) -> Vec<Option<Neighbours>> {
    let of_one = |(q, descriptor): (usize, &Descriptor)| {
        let mut best: Option<Neighbours> = None;
        for (t, other) in train.iter().enumerate().filter(|(t, _)| allowed(q, *t)) {
            let distance2 = distance2(descriptor, other);
            best = Some(match best {
                None => Neighbours { nearest: t as u32, distance2, second_distance2: None },
                Some(best) if distance2 < best.distance2 => {
                    Neighbours { nearest: t as u32, distance2, second_distance2: Some(best.distance2) }
                }
                Some(best) => {
                    let second = best.second_distance2.map_or(distance2, |second| second.min(distance2));
                    Neighbours { second_distance2: Some(second), ..best }
                }
            });
        }
        best
    };
    query.par_iter().enumerate().map(of_one).collect()
}

/// |a − b|².
pub fn distance2(a: &Descriptor, b: &Descriptor) -> u32 {
    a.iter().zip(b).map(|(&a, &b)| u32::from(a.abs_diff(b)).pow(2)).sum()
}

/// The matches of two sets, in the order of `query`.
pub fn matches(query: &[Descriptor], train: &[Descriptor], settings: &MatchSettings) -> Vec<Match> {
    let back = settings.mutual.then(|| nearest(train, query));
    select(&nearest(query, train), back.as_deref(), settings)
}

/// The matches among the pairs that `allowed` (index into `query`, index into `train`) lets through.
pub fn matches_where(
    query: &[Descriptor],
    train: &[Descriptor],
    settings: &MatchSettings,
    allowed: impl Fn(usize, usize) -> bool + Sync,
) -> Vec<Match> {
    let back = settings.mutual.then(|| nearest_where(train, query, |t, q| allowed(q, t)));
    select(&nearest_where(query, train, &allowed), back.as_deref(), settings)
}

/// The neighbours that the settings let through.
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
