//! Reads and checks a scenario: the range of every setting, and whether its drive is possible on flat ground.

use std::path::Path;

use crate::rover::plan::planned;
use crate::scenario::range::{MAX_SEED, within};
use crate::scenario::{Course, Scenario};
use crate::toml_text;
use sightline_geometry::error::{Error, Result};

/// Largest number of characters in a scenario's name.
const NAME_LIMIT: usize = 200;

impl Scenario {
    /// Reads and checks a scenario. `path` appears only in the error message, beside key and allowed range.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        let scenario: Self = toml_text::read(text).map_err(|problem| Error::format(path, problem))?;
        scenario.validate().map_err(|problem| Error::format(path, problem.to_string()))?;
        Ok(scenario)
    }

    /// Rejects settings from which no world can be built, naming the first bad one. The ranges keep sizes finite and
    /// geometry possible; they permit scenarios that are implausible on Mars.
    pub fn validate(&self) -> Result<()> {
        self.validate_name()?;
        if self.seed > MAX_SEED {
            return Err(Error::setting("seed", format!("{} is above 2^53", self.seed)));
        }
        self.terrain.validate()?;
        self.rocks.validate()?;
        self.texture.validate()?;
        self.sun.validate()?;
        self.camera.validate()?;
        self.drive.validate()?;
        if self.drive.course == Course::Moves {
            // Whether a move is possible depends on the moves before it: check the plan on flat ground.
            planned(&self.drive)?;
        }
        self.rover.validate()?;
        self.events.validate()?;
        self.fiducials.iter().enumerate().try_for_each(|(index, fiducial)| fiducial.validate(index))?;
        let error = &self.odometry_error;
        within("odometry_error.along_fraction", error.along_fraction, 0.0, 1.0)?;
        within("odometry_error.across_fraction", error.across_fraction, 0.0, 1.0)?;
        within("odometry_error.attitude_deg", error.attitude_deg, 0.0, 10.0)?;
        self.targets.validate()
    }

    fn validate_name(&self) -> Result<()> {
        let length = self.name.chars().count();
        let problem = match () {
            () if self.name.trim().is_empty() => "is empty".to_owned(),
            () if length > NAME_LIMIT => format!("has {length} characters"),
            () if self.name.chars().any(char::is_control) => "has a control character".to_owned(),
            () => return Ok(()),
        };
        let wanted = format!("must have 1 to {NAME_LIMIT} characters, none of them a control character");
        Err(Error::setting("name", format!("{problem}, but it {wanted}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::RockSettings;

    #[test]
    fn a_scenario_survives_toml() {
        let mut scenario = Scenario::demo();
        scenario.sun.azimuth_deg = -33.25;
        let read = Scenario::from_toml(&scenario.to_toml(), Path::new("scenario.toml"));
        assert_eq!(read.unwrap(), scenario);
    }

    #[test]
    fn names_are_short_and_printable() {
        let named = |name: &str| Scenario { name: name.to_owned(), ..Scenario::demo() }.validate();
        for wrong in ["", "  ", "a\0b", "two\nlines", &"x".repeat(201)] {
            assert!(named(wrong).unwrap_err().to_string().starts_with("setting name: "), "{wrong:?}");
        }
        assert!(named(&"ö".repeat(200)).is_ok());
    }

    #[test]
    fn the_number_of_stops_and_of_placed_rocks_is_bounded() {
        let one = "[[drive.moves]]\nkind = \"forward\"\ndistance_m = 0.1\nstops = 200\n";
        let drive = |moves: usize| format!("[drive]\ncourse = \"moves\"\n{}", one.repeat(moves));
        let refused = |text: &str| Scenario::from_toml(text, Path::new("s.toml")).unwrap_err().to_string();
        let many = refused(&drive(11));
        assert!(many.contains("drive.moves") && many.contains("2200 stops"), "{many}");
        let rock = "[[rocks.placed]]\nx_m = 1.0\ny_m = 1.0\ndiameter_m = 0.1\nheight_m = 0.1\n";
        assert!(refused(&rock.repeat(1001)).contains("rocks.placed"));
    }

    #[test]
    fn what_is_left_out_takes_its_default() {
        let read =
            Scenario::from_toml("seed = 9\n[sun]\nelevation_deg = 20.0\n", Path::new("s.toml")).unwrap();
        assert_eq!((read.seed, read.sun.elevation_deg), (9, 20.0));
        assert_eq!(read.rocks, RockSettings::default());
    }

    #[test]
    fn unknown_and_impossible_settings_are_refused_by_name() {
        let refused =
            |text: &str| Scenario::from_toml(text, Path::new("s.toml")).expect_err("refused").to_string();
        let unknown = refused("seed = 2\n[sun]\nheight_deg = 3.0\n");
        assert!(
            unknown.starts_with("s.toml: line 3: sun.height_deg: unknown field `height_deg`"),
            "{unknown}"
        );
        assert!(!unknown.contains('\n'), "one sentence: {unknown}");
        assert!(refused("[sun]\nelevation_deg = -3.0\n").contains("sun.elevation_deg"));
        assert!(refused("[camera]\nimage_size = 1000\n").contains("camera.image_size"));
        assert!(refused("[drive]\nend_distance_m = nan\n").contains("drive.end_distance_m"));
        let cover = refused("[rocks]\narea_fraction = -0.1\n");
        assert!(
            ["s.toml", "rocks.area_fraction", "0 to 0.4"].iter().all(|part| cover.contains(part)),
            "{cover}"
        );
        let below =
            "[[fiducials]]\nkind = \"sphere\"\nx_m = 0.0\ny_m = 0.0\nheight_m = -1.0\nradius_m = 0.1\n";
        assert!(refused(below).contains("fiducials[0].height_m"));
    }
}
