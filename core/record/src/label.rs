//! Labels of quantities and fields: their names in words, and their units with the frame that the name ends with.

use super::Unit;

/// The frames that a name may end with.
const FRAMES: [&str; 2] = ["rover", "site"];

/// The name in words, without unit and frame: `second_peak.distance_px` becomes “second peak distance”,
/// `position_in_rover` becomes “position”.
pub fn label(name: &str, unit: Unit) -> String {
    let (name, _) = frame(name);
    let name = name.strip_suffix(unit.word()).and_then(|rest| rest.strip_suffix('_')).unwrap_or(name);
    name.replace(['_', '.'], " ")
}

/// The unit's symbol, followed by the frame if the name ends with one: `m, rover`.
pub fn unit_label(name: &str, unit: Unit) -> String {
    match (unit.symbol(), frame(name).1) {
        (symbol, None) => symbol.to_owned(),
        ("", Some(frame)) => frame.to_owned(),
        (symbol, Some(frame)) => format!("{symbol}, {frame}"),
    }
}

fn frame(name: &str) -> (&str, Option<&'static str>) {
    let found = FRAMES.into_iter().find_map(|frame| {
        let rest = name.strip_suffix(frame)?.strip_suffix("_in_")?;
        Some((rest, Some(frame)))
    });
    found.unwrap_or((name, None))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_has_neither_unit_nor_frame() {
        assert_eq!(label("gap_m", Unit::Metre), "gap");
        assert_eq!(label("covariance_px2", Unit::SquarePixel), "covariance");
        assert_eq!(label("second_peak.distance_px", Unit::Pixel), "second peak distance");
        assert_eq!(label("covariance_in_rover", Unit::SquareMetre), "covariance");
        assert_eq!(label("left_pixel", Unit::Pixel), "left pixel");
        assert_eq!(label("stereo_1", Unit::One), "stereo");
        assert_eq!(unit_label("covariance_in_rover", Unit::SquareMetre), "m², rover");
        assert_eq!(unit_label("initial_position_in_site", Unit::Metre), "m, site");
        assert_eq!(unit_label("approach_in_rover", Unit::One), "rover");
        assert_eq!(unit_label("score", Unit::One), "");
    }
}
