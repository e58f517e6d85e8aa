//! The built-in scenarios, as readable TOML: the papers' experiments and their difficulties.
//!
//! Each file in `library/` contains only the settings that differ from the defaults, with a description that names
//! the requirement it stages (R…) and the assumptions made. A scenario's name is the name of its file.

use std::path::Path;

use crate::scenario::Scenario;
use sightline_geometry::error::{Error, Result};

/// A scenario's name and its TOML.
const FILES: &[(&str, &str)] = &[
    ("approach-10", include_str!("library/approach-10.toml")),
    ("obstacles-10", include_str!("library/obstacles-10.toml")),
    ("navcam-wedges", include_str!("library/navcam-wedges.toml")),
    ("no-safe-path", include_str!("library/no-safe-path.toml")),
    ("false-obstacle", include_str!("library/false-obstacle.toml")),
    ("approach-5", include_str!("library/approach-5.toml")),
    ("sideways-70", include_str!("library/sideways-70.toml")),
    ("turn-in-place", include_str!("library/turn-in-place.toml")),
    ("slope-flat", include_str!("library/slope-flat.toml")),
    ("slope-shallow", include_str!("library/slope-shallow.toml")),
    ("slope-steep", include_str!("library/slope-steep.toml")),
    ("slope-oblique", include_str!("library/slope-oblique.toml")),
    ("stuck", include_str!("library/stuck.toml")),
    ("ramp-25", include_str!("library/ramp-25.toml")),
    ("own-tracks", include_str!("library/own-tracks.toml")),
    ("picket-fence", include_str!("library/picket-fence.toml")),
    ("featureless", include_str!("library/featureless.toml")),
    ("passing-roll-30", include_str!("library/passing-roll-30.toml")),
    ("checkout-1", include_str!("library/checkout-1.toml")),
    ("checkout-2", include_str!("library/checkout-2.toml")),
    ("checkout-3", include_str!("library/checkout-3.toml")),
    ("checkout-4", include_str!("library/checkout-4.toml")),
    ("occlusion", include_str!("library/occlusion.toml")),
    ("self-shadow", include_str!("library/self-shadow.toml")),
    ("moving-object", include_str!("library/moving-object.toml")),
    ("low-texture", include_str!("library/low-texture.toml")),
    ("clouds", include_str!("library/clouds.toml")),
    ("moving-sun", include_str!("library/moving-sun.toml")),
    ("sky-full-frame", include_str!("library/sky-full-frame.toml")),
    ("sky-subframe", include_str!("library/sky-subframe.toml")),
    ("five-targets", include_str!("library/five-targets.toml")),
    ("k9-5", include_str!("library/k9-5.toml")),
    ("k9-7.5", include_str!("library/k9-7.5.toml")),
    ("k9-10", include_str!("library/k9-10.toml")),
    ("k9-day", include_str!("library/k9-day.toml")),
    ("k9-day-shadow", include_str!("library/k9-day-shadow.toml")),
    ("heading-jump", include_str!("library/heading-jump.toml")),
];

/// The scenario that a new user starts with: its name in the library …
pub const FIRST: &str = "heading-jump";
/// … and the name of its traverse.
pub const FIRST_NAME: &str = "a heading that jumps";

/// The names of the library's scenarios, in listing order.
pub fn names() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}

/// The TOML text of a scenario, with its comments; `None` for an unknown name.
pub fn toml(name: &str) -> Option<&'static str> {
    FILES.iter().find(|(known, _)| *known == name).map(|(_, toml)| *toml)
}

/// A scenario of the library.
///
/// # Errors
/// An unknown name; the message lists the known ones.
pub fn scenario(name: &str) -> Result<Scenario> {
    let text = toml(name).ok_or_else(|| {
        let known = names().collect::<Vec<_>>().join(", ");
        Error::setting("scenario", format!("{name} is not in the library, which has {known}"))
    })?;
    Scenario::from_toml(text, Path::new(&format!("{name}.toml")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scenario_of_the_library_is_valid_described_and_named_apart() {
        let mut known = std::collections::HashSet::new();
        for name in names() {
            let scenario = scenario(name).expect(name);
            assert!(
                known.insert(scenario.name.clone()),
                "{name}: another scenario is called {}",
                scenario.name
            );
            assert!(scenario.description.len() > 40, "{name}: say what it stages");
        }
    }

    #[test]
    fn the_first_scenario_has_sixty_stops_and_the_name_by_which_it_is_known() {
        let first = scenario(FIRST).unwrap();
        assert_eq!(first.name, FIRST_NAME);
        let drive = &first.drive;
        let stops = crate::rover::approach::distances_m(
            drive.start_distance_m,
            drive.end_distance_m,
            drive.step_fraction,
        );
        assert_eq!(stops.len(), 60);
    }

    #[test]
    fn a_name_that_is_not_there_is_refused_with_those_that_are() {
        let message = scenario("mars").expect_err("refused").to_string();
        assert!(message.contains("mars") && message.contains("approach-5"), "{message}");
    }
}
