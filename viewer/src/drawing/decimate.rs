//! Decimation of long drives to the resolution of the screen, so that the cost of a frame does not depend on the number of
//! steps.
//!
//! A curve keeps the first, lowest, highest and last of its values in each of [`COLUMNS`] columns, which draws the same
//! pixels as all of them (the M4 aggregation of Jugel, Jerzak, Hackenbroich and Markl 2014). Positions on a map are taken
//! evenly along the drive.

use std::collections::HashSet;

/// Columns of a curve, each two pixels wide in the widest plot.
pub(crate) const COLUMNS: usize = 600;

/// Maximum number of marks on one curve: more would touch.
pub(crate) const MARKS: usize = 400;

/// Maximum number of positions of a path on a map.
pub(crate) const PLACES: usize = 1000;

/// Maximum number of ellipses on a map.
pub(crate) const ELLIPSES: usize = 100;

/// Cells along the longer side of a path: more than the pixels of a map would not be distinguishable.
pub(crate) const CELLS: f64 = 512.0;

/// The points needed to draw a curve; `points` are in ascending x.
pub(crate) fn curve(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return points };
    if points.len() <= 4 * COLUMNS {
        return points;
    }
    let (left, span) = (first[0], (last[0] - first[0]).max(f64::MIN_POSITIVE));
    let column = |point: &[f64; 2]| (((point[0] - left) / span * COLUMNS as f64) as usize).min(COLUMNS - 1);
    let mut kept = Vec::with_capacity(4 * COLUMNS);
    for column in points.chunk_by(|a, b| column(a) == column(b)) {
        let by_value = |a: &(usize, &[f64; 2]), b: &(usize, &[f64; 2])| a.1[1].total_cmp(&b.1[1]);
        let lowest = column.iter().enumerate().min_by(by_value).map_or(0, |(at, _)| at);
        let highest = column.iter().enumerate().max_by(by_value).map_or(0, |(at, _)| at);
        let mut at = vec![0, lowest, highest, column.len() - 1];
        at.sort_unstable();
        at.dedup();
        kept.extend(at.into_iter().map(|at| column[at]));
    }
    kept
}

/// The marks of a curve: all of them, or none if they would touch, where the line suffices.
pub(crate) fn marks(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    if points.len() <= MARKS { points } else { Vec::new() }
}

/// At most `limit` items, evenly chosen, including the first and the last.
pub(crate) fn evenly<T>(all: &[T], limit: usize) -> impl Iterator<Item = &T> {
    let count = all.len().min(limit);
    (0..count).map(move |k| if count < 2 { &all[0] } else { &all[k * (all.len() - 1) / (count - 1)] })
}

/// The pieces of a path, without repeated segments: a rover that drives to and fro would draw the same segments many
/// times.
///
/// Two segments are equal if their ends are in the same cells of a grid of [`CELLS`] cells over the longer side of the
/// path.
pub(crate) fn path(points: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let side = |axis: usize| {
        let (low, high) =
            points.iter().fold((f64::MAX, f64::MIN), |(low, high), p| (low.min(p[axis]), high.max(p[axis])));
        high - low
    };
    let cell_size = side(0).max(side(1)).max(f64::MIN_POSITIVE) / CELLS;
    let cell = |point: &[f64; 2]| point.map(|v| (v / cell_size).round() as i64);
    let mut drawn = HashSet::new();
    let mut pieces: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut is_going_on = false;
    for pair in points.windows(2) {
        let (from, to) = (cell(&pair[0]), cell(&pair[1]));
        let is_new = from != to && drawn.insert((from.min(to), from.max(to)));
        match pieces.last_mut().filter(|_| is_going_on) {
            Some(piece) if is_new => piece.push(pair[1]),
            _ if is_new => pieces.push(pair.to_vec()),
            _ => {}
        }
        // Standing still does not end a piece; a segment that is already drawn does.
        is_going_on = is_new || is_going_on && from == to;
    }
    if pieces.is_empty() && !points.is_empty() {
        pieces.push(vec![points[0]]);
    }
    pieces
}

/// A note that not all steps are drawn; `None` if all are.
pub(crate) fn words(count: usize, limit: usize) -> Option<String> {
    (count > limit).then(|| format!("{limit} of {count} steps are drawn"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_keeps_its_ends_and_every_peak() {
        let points: Vec<[f64; 2]> =
            (0..100_000).map(|k| [k as f64, if k == 54_321 { 9.0 } else { (k % 7) as f64 }]).collect();
        let thin = curve(points.clone());
        assert!(thin.len() <= 4 * COLUMNS, "{}", thin.len());
        assert_eq!((thin.first(), thin.last()), (points.first(), points.last()));
        assert!(thin.contains(&[54_321.0, 9.0]), "one peak among a hundred thousand");
        assert!(thin.windows(2).all(|pair| pair[0][0] < pair[1][0]), "in order, none twice");
        // Every column has the extent of all of its points.
        let column = |point: &[f64; 2]| ((point[0] / 99_999.0 * 600.0) as usize).min(599);
        for column in thin.chunk_by(|a, b| column(a) == column(b)) {
            assert!(column.iter().any(|p| p[1] == 0.0) && column.iter().any(|p| p[1] >= 6.0));
        }
    }

    #[test]
    fn short_curves_stay_as_they_are() {
        let points: Vec<[f64; 2]> = (0..1000).map(|k| [k as f64, 1.0]).collect();
        assert_eq!(curve(points.clone()), points);
        assert_eq!(curve(Vec::new()), Vec::<[f64; 2]>::new());
        assert_eq!((marks(points).len(), marks(vec![[0.0, 0.0]; 400]).len()), (0, 400));
    }

    #[test]
    fn a_way_is_drawn_once_however_often_it_is_driven() {
        let to_and_fro: Vec<[f64; 2]> =
            (0..10_000).map(|k: i32| [0.0, f64::from(4 - (k % 8 - 4).abs())]).collect();
        assert_eq!(path(&to_and_fro), [(0..5).map(|k| [0.0, f64::from(k)]).collect::<Vec<_>>()]);
        let standing = vec![[3.0, 4.0]; 1000];
        assert_eq!(path(&standing), [vec![[3.0, 4.0]]]);
        let straight: Vec<[f64; 2]> = (0..100).map(|k| [f64::from(k), 0.0]).collect();
        assert_eq!(
            path(&straight),
            std::slice::from_ref(&straight),
            "nothing of a drive without returns is left out"
        );
        // A detour from a driven segment is a separate piece.
        let detour = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        assert_eq!(path(&detour), [vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]], vec![[1.0, 0.0], [1.0, 1.0]]]);
        assert_eq!(path(&[]), Vec::<Vec<[f64; 2]>>::new());
    }

    #[test]
    fn places_are_taken_evenly_with_both_ends() {
        let all: Vec<usize> = (0..10_000).collect();
        let some: Vec<usize> = evenly(&all, 100).copied().collect();
        assert_eq!((some.len(), some[0], some[99]), (100, 0, 9_999));
        assert!(some.windows(2).all(|pair| (100..=102).contains(&(pair[1] - pair[0]))));
        assert_eq!(evenly(&all[..3], 100).count(), 3);
        assert_eq!((evenly(&all, 1).count(), evenly(&all[..0], 5).count()), (1, 0));
        assert_eq!(words(10_000, 100).as_deref(), Some("100 of 10000 steps are drawn"));
        assert_eq!(words(100, 100), None);
    }
}
