//! The cases of the golden lists: pairs of drive and configuration.

use sightline_session::step::RunStep;
use sightline_session::track;
use sightline_track::presets::{Preset, preset};
use sightline_track::settings::{Settings, parse_assignment};
use sightline_track::target::Designation;

use super::drives::{Drive, DriveName};
use super::extract;
use super::sheet::Sheet;

/// One golden list.
pub(crate) struct Case {
    /// The name of its file.
    pub(crate) name: &'static str,
    /// The drive.
    pub(crate) drive: DriveName,
    /// The preset.
    pub(crate) preset: &'static str,
    /// Changes to the preset, as `key=value`.
    changes: &'static [&'static str],
    /// Maximum number of stops that are tracked.
    stops_max: usize,
}

const fn case(name: &'static str, drive: DriveName, preset: &'static str) -> Case {
    Case { name, drive, preset, changes: &[], stops_max: 5 }
}

/// A variant of the template tracker: three stops suffice to show its differences.
const fn variant(name: &'static str, preset: &'static str) -> Case {
    Case { name, drive: DriveName::Approach, preset, changes: &[], stops_max: 3 }
}

/// Parts that no preset enables: the height term, and the gates that are off by default.
const OPTIONAL_PARTS: &[&str] = &[
    "height_weight=0.3",
    "left_right_max_px=1",
    "second_peak_ratio_max=0.99",
    "match_sigma_max_px=0.5",
    "edge_distance_min_px=2",
];

/// All cases.
pub(crate) const CASES: &[Case] = &[
    case("approach-sightline", DriveName::Approach, "sightline"),
    case("approach-ncc-scale-roll", DriveName::Approach, "ncc-scale-roll"),
    variant("approach-ncc-scale-roll-affine", "ncc-scale-roll-affine"),
    variant("approach-coarse-to-fine", "coarse-to-fine"),
    variant("approach-klt-affine", "klt-affine"),
    variant("approach-sdog", "sdog"),
    variant("approach-drift-correction", "drift-correction"),
    variant("approach-homography", "homography"),
    variant("approach-scale-roll-search", "scale-roll-search"),
    Case {
        name: "approach-three-templates",
        drive: DriveName::Approach,
        preset: "three-templates",
        // With the default, this short drive never renews its template, so that only one exists.
        changes: &["template_update=every_update"],
        stops_max: 4,
    },
    variant("approach-half-pixel", "half-pixel"),
    Case {
        name: "approach-optional-parts",
        drive: DriveName::Approach,
        preset: "sightline",
        changes: OPTIONAL_PARTS,
        stops_max: 3,
    },
    case("approach-features", DriveName::Approach, "features"),
    case("approach-features-paper", DriveName::Approach, "features-paper"),
    case("damaged-sightline", DriveName::Damaged, "sightline"),
    case("damaged-features", DriveName::Damaged, "features"),
    case("heading-jump-sightline", DriveName::HeadingJump, "sightline"),
    case("heading-jump-features-paper", DriveName::HeadingJump, "features-paper"),
    case("hand-off-shape", DriveName::HandOff, "shape"),
    case("hand-off-combined", DriveName::HandOff, "combined"),
    case("hand-off-combined-paper", DriveName::HandOff, "combined-paper"),
    case("street-sightline", DriveName::Street, "sightline"),
    case("street-features", DriveName::Street, "features"),
    case("opportunity-sightline", DriveName::Opportunity, "sightline"),
    case("spirit-ncc-scale-roll", DriveName::Spirit, "ncc-scale-roll"),
];

impl Case {
    /// The title of the list, one line.
    pub(crate) fn title(&self) -> String {
        let changes = self.changes.iter().map(|change| format!(", {change}")).collect::<String>();
        format!("drive {:?}, preset {}{changes}", self.drive, self.preset)
    }

    /// Tracks the drive's target and returns the numbers of every stop.
    ///
    /// # Panics
    /// If the preset or a change does not exist.
    pub(crate) fn compute(&self, drive: &Drive) -> Sheet {
        let settings = self.settings();
        let folder = drive.traverse.folder().display().to_string();
        let designation = Designation::new(0, drive.pixel);
        let mut sheet = Sheet::default();
        let stops = drive.traverse.stop_count().min(self.stops_max);
        sheet.put("stops", stops);
        sheet.put("designated_px", drive.pixel);
        let first = match track::designate(&drive.traverse, designation, &settings) {
            Ok(first) => first,
            Err(refusal) => {
                sheet.put("refused", refusal.to_string());
                return sheet;
            }
        };
        extract::step(&mut sheet, &first, &folder);
        let mut last: Option<RunStep> = None;
        for _ in 1..stops {
            let next = track::advance(&drive.traverse, &first, last.as_ref().unwrap_or(&first), &settings);
            extract::step(&mut sheet, &next, &folder);
            last = Some(next);
        }
        sheet
    }

    fn settings(&self) -> Settings {
        let parsed = self.changes.iter().map(|text| parse_assignment(text).expect("an assignment"));
        let settings = preset(self.preset).and_then(Preset::settings).expect("a known preset");
        settings.with(&parsed.collect()).expect("changes of existing settings")
    }
}
