//! The panels by name, with their constant facts. A panel's contents are in its own file, behind the trait
//! [`crate::panels::panel::Panel`]; the list in [`crate::panels::list`] says which file has which panel.

use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Constant facts about a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct About {
    /// Identifier in stored arrangements, `snake_case`. It never changes: stored pages must keep opening.
    pub name: &'static str,
    /// Title of the tab.
    pub title: &'static str,
    /// What the panel shows, as one sentence.
    pub help: &'static str,
    /// Where the overview shows it.
    pub home: Home,
}

/// A group of tabs in the overview, and the panel's position in it from the left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Home(pub Group, pub u8);

/// The groups of tabs of the overview.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// The left column: targets and settings.
    Lists,
    /// The left image, alone.
    LeftImage,
    /// Right of the left image: the other views of the step and of the session.
    Views,
    /// The low band below the images.
    Strip,
    /// Below the band, left: scores.
    Scores,
    /// Below the band, middle: the map.
    Map,
    /// Below the band, right: plots over the steps.
    Plots,
    /// The right column, top: the verdict.
    Verdict,
    /// The right column, bottom: details as text.
    Details,
}

/// Data that is fetched only while a panel that needs it is on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The metrics of the runs.
    Metrics,
    /// The matched window of every step.
    MatchedWindows,
    /// The scores of the changes that are tried out.
    TriedScores,
    /// The answers about the current step.
    Explanation,
    /// The studies that the server offers.
    Studies,
}

/// Makes the enum of the panels from their facts: name, title, home and help.
macro_rules! panes {
    ($($variant:ident: $name:literal, $title:literal, $home:expr, $help:literal;)*) => {
        /// A panel.
        #[derive(Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Pane {
            $(#[doc = concat!("The panel “", $title, "”.")] $variant,)*
        }

        impl Pane {
            /// All panels, in the order of the menus.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$variant),*];

            /// Its constant facts.
            pub const fn about(self) -> About {
                match self {
                    $(Self::$variant => About { name: $name, title: $title, help: $help, home: $home },)*
                }
            }
        }
    };
}

panes! {
    Targets: "targets", "Targets and runs", Home(Group::Lists, 0),
        "What is tracked, and each configuration tried on it.";
    Settings: "settings", "Settings", Home(Group::Lists, 1),
        "Thresholds and parameters of a run";
    Left: "left", "Left image", Home(Group::LeftImage, 0),
        "The left image with what the tracker knew of the target";
    Right: "right", "Right image", Home(Group::Views, 0),
        "The right image with the epipolar curve and the stereo match";
    Features: "features", "Features", Home(Group::Views, 1),
        "What the feature tracker saw: features, matches, the motion, and how certain it is.";
    Shape: "shape", "Shape", Home(Group::Views, 2),
        "What the shape tracker saw: surface, sensor, search, meshes, and the hand-off.";
    Budget: "budget", "Error budget", Home(Group::Views, 3),
        "What accuracy stereo, driving and drift leave.";
    Studies: "studies", "Studies", Home(Group::Views, 4),
        "The paper’s experiments, over worlds whose truth is known.";
    Strip: "strip", "Template strip", Home(Group::Strip, 0),
        "The template from its reference to what was compared.";
    History: "history", "Template history", Home(Group::Strip, 1),
        "Every step’s matched window, and how the current view compares with the earlier templates.";
    Surface: "surface", "Match scores", Home(Group::Scores, 0),
        "The match score of every position in the search window.";
    StereoProfile: "stereo_profile", "Stereo scores", Home(Group::Scores, 1),
        "The stereo score of every range that was searched.";
    Map: "map", "Map, site frame", Home(Group::Map, 0),
        "The rover’s path and the target, seen from above.";
    Plots: "plots", "Over the steps", Home(Group::Plots, 0),
        "Scores or confidence, and errors of the run, step by step.";
    Tolerances: "tolerances", "Tolerances", Home(Group::Plots, 1),
        "Criteria 3 and 4: each correction against its tolerance, step by step.";
    Gates: "gates", "Gates", Home(Group::Verdict, 0),
        "Whether the match can be trusted: the criteria with their limits.";
    Machine: "machine", "State machine", Home(Group::Verdict, 1),
        "Where tracking stands, and which criterion fired at each past update.";
    Inspector: "inspector", "Inspector", Home(Group::Details, 0),
        "The record of the selected stage: values with units, formulas and origins";
    Messages: "messages", "Messages", Home(Group::Details, 3),
        "What was refused or failed, with how to mend it";
    Runs: "runs", "Runs", Home(Group::Views, 5),
        "What each run is worth, and which settings make the difference.";
    Uncertainty: "uncertainty", "Uncertainty", Home(Group::Plots, 2),
        "Whether errors are as large as the covariances say.";
    Why: "why", "Why", Home(Group::Details, 1),
        "Why a step was accepted or rejected, what would have saved it, and where a number comes from.";
    Notes: "notes", "Notes", Home(Group::Details, 2),
        "What you wrote about places of the drive; the list is a tour that can be stepped through.";
    Breakpoints: "breakpoints", "Breakpoints", Home(Group::Verdict, 2),
        "Conditions that are looked for at all steps of all runs at once.";
}

impl Pane {
    /// Identifier in stored arrangements.
    pub fn name(self) -> &'static str {
        self.about().name
    }

    /// Title of the tab.
    pub fn title(self) -> &'static str {
        self.about().title
    }

    /// The panel with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|pane| pane.name() == name)
    }

    /// The panels of a group of the overview, from the left.
    pub fn of_group(group: Group) -> Vec<Self> {
        let place = |pane: &Self| {
            let Home(of, position) = pane.about().home;
            (of == group).then_some(position)
        };
        let mut panes: Vec<Self> = Self::ALL.into_iter().filter(|pane| place(pane).is_some()).collect();
        panes.sort_by_key(place);
        panes
    }
}

impl fmt::Debug for Pane {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl Serialize for Pane {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Pane {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::named(&name).ok_or_else(|| D::Error::custom(format!("no panel is called {name:?}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_titles_are_unique() {
        for (at, pane) in Pane::ALL.into_iter().enumerate() {
            for other in &Pane::ALL[..at] {
                assert_ne!(pane.name(), other.name());
                assert_ne!(pane.title(), other.title());
                assert_ne!(pane.about().home, other.about().home, "{pane:?} and {other:?}");
            }
        }
    }

    #[test]
    fn stored_names_of_panels_keep_their_meaning() {
        let stored = [
            ("targets", Pane::Targets),
            ("settings", Pane::Settings),
            ("left", Pane::Left),
            ("right", Pane::Right),
            ("strip", Pane::Strip),
            ("history", Pane::History),
            ("surface", Pane::Surface),
            ("features", Pane::Features),
            ("shape", Pane::Shape),
            ("budget", Pane::Budget),
            ("studies", Pane::Studies),
            ("stereo_profile", Pane::StereoProfile),
            ("map", Pane::Map),
            ("plots", Pane::Plots),
            ("tolerances", Pane::Tolerances),
            ("gates", Pane::Gates),
            ("machine", Pane::Machine),
            ("inspector", Pane::Inspector),
            ("messages", Pane::Messages),
            ("runs", Pane::Runs),
            ("uncertainty", Pane::Uncertainty),
            ("why", Pane::Why),
            ("notes", Pane::Notes),
            ("breakpoints", Pane::Breakpoints),
        ];
        for (name, pane) in stored {
            let text = serde_json::to_string(&pane).unwrap();
            assert_eq!(text, format!("{name:?}"));
            assert_eq!(serde_json::from_str::<Pane>(&text).unwrap(), pane);
        }
        assert!(serde_json::from_str::<Pane>("\"no such panel\"").is_err());
    }
}
