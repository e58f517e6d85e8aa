//! Compares a recorded golden list with the current values.
//!
//! On the recorded CPU type every line must be equal. On another CPU type digests are ignored and two real numbers a and b
//! are equal if |a − b| ≤ 1e-5 · max(1, |a|, |b|); integers and words must still be equal.

use std::collections::HashMap;

use super::sheet::List;

/// Tolerance of real numbers on another CPU type, absolute below 1 and relative above.
const TOLERANCE: f64 = 1e-5;

/// A line in which two lists differ.
#[derive(Debug, PartialEq)]
pub(crate) struct Difference {
    /// The line's name.
    pub(crate) name: String,
    /// Its value in the golden list; `None` for a new line.
    pub(crate) expected: Option<String>,
    /// Its current value; `None` for a missing line.
    pub(crate) actual: Option<String>,
}

/// The lines in which the lists differ, in the golden list's order, new lines last.
pub(crate) fn differences(expected: &List, actual: &List) -> Vec<Difference> {
    let is_same_cpu = expected.cpu == actual.cpu;
    let now: HashMap<&str, &str> = actual.lines.iter().map(|(name, value)| (&**name, &**value)).collect();
    let known: HashMap<&str, ()> = expected.lines.iter().map(|(name, _)| (&**name, ())).collect();
    let changed = expected.lines.iter().filter_map(|(name, value)| {
        let found = now.get(&**name).copied();
        let is_equal = found.is_some_and(|found| are_equal(value, found, is_same_cpu));
        (!is_equal).then(|| Difference {
            name: name.clone(),
            expected: Some(value.clone()),
            actual: found.map(str::to_owned),
        })
    });
    let added =
        actual.lines.iter().filter(|(name, _)| !known.contains_key(&**name)).map(|(name, value)| {
            Difference { name: name.clone(), expected: None, actual: Some(value.clone()) }
        });
    changed.chain(added).collect()
}

fn are_equal(expected: &str, actual: &str, is_same_cpu: bool) -> bool {
    if expected == actual || is_same_cpu {
        return expected == actual;
    }
    let (mut a, mut b) = (expected.split(' '), actual.split(' '));
    match (a.next(), b.next()) {
        (Some("digest"), Some("digest")) => true,
        (Some("real"), Some("real")) => loop {
            match (a.next(), b.next()) {
                (None, None) => return true,
                (Some(a), Some(b)) if are_near(a, b) => {}
                _ => return false,
            }
        },
        _ => false,
    }
}

fn are_near(a: &str, b: &str) -> bool {
    let (Ok(x), Ok(y)) = (a.parse::<f64>(), b.parse::<f64>()) else { return false };
    a == b || (x - y).abs() <= TOLERANCE * x.abs().max(y.abs()).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::super::sheet::{Sheet, Value};
    use super::*;

    fn list(cpu: &str, score: f64, array: &[f32]) -> List {
        let mut sheet = Sheet::default();
        sheet.put("score", score);
        sheet.put("count", 3_usize);
        sheet.put("reason", "ncc 0.51 is below 0.60");
        sheet.put("position", Value::reals([1.0, f64::NAN, f64::INFINITY]));
        sheet.array("window", &[array.len()], array);
        sheet.finish(cpu)
    }

    fn names(expected: &List, actual: &List) -> Vec<String> {
        differences(expected, actual).into_iter().map(|difference| difference.name).collect()
    }

    #[test]
    fn a_list_equals_itself_after_a_file() {
        let numbers = [0.1_f32, -0.0, f32::NAN, 3e-39];
        let written = list("a", 0.1 + 0.2, &numbers);
        let read = List::from_text(&written.to_text("a test")).unwrap();
        assert_eq!(read.cpu, "a");
        assert_eq!(read.lines, written.lines);
        assert_eq!(differences(&read, &written), []);
        let score: f64 = read.lines[0].1.strip_prefix("real ").unwrap().parse().unwrap();
        assert_eq!(score.to_bits(), (0.1_f64 + 0.2).to_bits());
    }

    #[test]
    fn one_bit_fails_on_the_recorded_cpu_only() {
        let next = f64::from_bits(0.3_f64.to_bits() + 1);
        let [known, same, other] = [("a", 0.3), ("a", next), ("b", next)].map(|(c, s)| list(c, s, &[1.0]));
        assert_eq!(names(&known, &same), ["score"]);
        assert_eq!(names(&known, &other), [""; 0]);
    }

    #[test]
    fn a_changed_number_fails_on_every_cpu() {
        let known = list("a", 0.3, &[1.0]);
        assert_eq!(names(&known, &list("a", 0.301, &[1.0])), ["score"]);
        assert_eq!(names(&known, &list("b", 0.301, &[1.0])), ["score"]);
        assert_eq!(names(&known, &list("b", f64::NAN, &[1.0])), ["score"]);
    }

    #[test]
    fn large_numbers_are_compared_relatively() {
        let known = list("a", 1e6, &[1.0]);
        assert_eq!(names(&known, &list("b", 1e6 + 9.0, &[1.0])), [""; 0]);
        assert_eq!(names(&known, &list("b", 1e6 + 11.0, &[1.0])), ["score"]);
    }

    #[test]
    fn a_changed_digest_fails_on_the_recorded_cpu_only() {
        let known = list("a", 0.3, &[1.0, 1.0]);
        let changed = [1.0, 1.000_001];
        let digest = "window.digest".to_owned();
        assert!(names(&known, &list("a", 0.3, &changed)).contains(&digest));
        assert_eq!(names(&known, &list("b", 0.3, &changed)), [""; 0]);
    }

    #[test]
    fn integers_and_words_are_compared_exactly() {
        let known = list("a", 0.3, &[1.0]);
        let mut other = list("b", 0.3, &[1.0]);
        other.lines[1].1 = "int 4".into();
        other.lines[2].1 = "word ncc 0.52 is below 0.60".into();
        assert_eq!(names(&known, &other), ["count", "reason"]);
    }

    #[test]
    fn a_missing_line_and_an_added_line_fail() {
        let known = list("a", 0.3, &[1.0]);
        for cpu in ["a", "b"] {
            let mut other = list(cpu, 0.3, &[1.0]);
            other.lines.remove(1);
            other.lines.push(("novelty".into(), "int 1".into()));
            let found = differences(&known, &other);
            assert_eq!(found[0].name, "count");
            assert_eq!(found[0].actual, None);
            assert_eq!(found[1].name, "novelty");
            assert_eq!(found[1].expected, None);
            assert_eq!(found.len(), 2);
        }
    }

    #[test]
    fn a_number_that_became_absent_fails() {
        let known = list("a", 0.3, &[1.0]);
        let mut other = list("b", 0.3, &[1.0]);
        other.lines[0].1 = "absent".into();
        assert_eq!(names(&known, &other), ["score"]);
    }
}
