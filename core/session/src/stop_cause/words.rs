//! Motions and endings of a drive in words.

use sightline_rover::driving::{Ending, Motion};

use crate::format::number;

/// A motion in words.
pub fn motion(motion: &Motion) -> String {
    let side = |value: f64| if value > 0.0 { "right" } else { "left" };
    match *motion {
        Motion::Turn { angle_rad } => {
            format!("turn {}° {}", number(angle_rad.abs().to_degrees()), side(angle_rad))
        }
        Motion::Arc { length_m, curvature_per_m } => {
            let way = if length_m < 0.0 { "back" } else { "ahead" };
            let length = format!("{} m {way}", number(length_m.abs()));
            // Radii above 1 km are shown as straight.
            if curvature_per_m.abs() < 1e-3 {
                return length;
            }
            format!("{length}, radius {} m {}", number(1.0 / curvature_per_m.abs()), side(curvature_per_m))
        }
    }
}

/// The ending of a drive as a sentence.
pub(super) fn ended(ending: &Ending) -> String {
    let reason = super::super::why::words::capitalised(ending.reason.word());
    match (&ending.detail, ending.value, ending.limit) {
        (Some(detail), ..) => format!("{reason}: {detail}."),
        (None, Some(value), Some(limit)) => format!("{reason}: {}, limit {}.", number(value), number(limit)),
        (None, ..) => format!("{reason}."),
    }
}

/// A length in m, or in cm below 1 m.
pub(super) fn metres(value_m: f64) -> String {
    if value_m.abs() < 1.0 { format!("{:.1} cm", 100.0 * value_m) } else { format!("{value_m:.2} m") }
}

/// Numbers after their noun: "stop 3", "stops 3 and 4", "stops 3, 4 and 7".
pub(super) fn listed(noun: &str, numbers: &[usize]) -> String {
    let words: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    match words.split_last() {
        None => format!("no {noun}"),
        Some((last, [])) => format!("{noun} {last}"),
        Some((last, others)) => format!("{noun}s {} and {last}", others.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_are_told_in_words() {
        let arc = |length_m, curvature_per_m| motion(&Motion::Arc { length_m, curvature_per_m });
        assert_eq!(arc(0.83, 0.05), "0.830 m ahead, radius 20 m right");
        assert_eq!(arc(-0.2, 0.0), "0.200 m back");
        assert_eq!(motion(&Motion::Turn { angle_rad: -0.5 }), "turn 28.65° left");
    }

    #[test]
    fn numbers_are_listed_behind_their_noun() {
        assert_eq!(listed("stop", &[3]), "stop 3");
        assert_eq!(listed("stop", &[3, 4, 7]), "stops 3, 4 and 7");
    }
}
