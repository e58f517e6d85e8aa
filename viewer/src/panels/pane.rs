//! The panels by name, with their constant properties from the table in [`super`].

use std::fmt;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Constant properties of a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct About {
    /// Identifier in stored arrangements, `snake_case`. It never changes, so that stored pages can still be opened.
    pub name: &'static str,
    /// Title of the tab.
    pub title: &'static str,
    /// What the panel shows, as one sentence.
    pub help: &'static str,
    /// Its group and position in the overview.
    pub home: Home,
}

/// A group of tabs in the overview, and the panel's position in it from the left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Home(pub Group, pub u8);

/// The groups of tabs of the overview.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// The right column, top: targets and settings.
    Lists,
    /// The left image, alone.
    LeftImage,
    /// Right of the left image, above: the target's close-up.
    CloseUp,
    /// Right of the left image: the other views of the step and of the session.
    Views,
    /// Below the images: windows of the template.
    Strip,
    /// Beside the map: scores.
    Scores,
    /// Right of the other views: the map.
    Map,
    /// Beside the map: plots over the steps.
    Plots,
    /// The right column, middle: the verdict.
    Verdict,
    /// The right column, bottom: details as text.
    Details,
}

/// Data that is fetched only while a panel that needs it is visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The metrics of the runs.
    Metrics,
    /// The matched window of every step.
    MatchedWindows,
    /// The scores of the changes that are being tried out.
    TriedScores,
    /// The explanations of the current step.
    Explanation,
    /// The studies that the server offers.
    Studies,
    /// The corners of visual odometry.
    Odometry,
    /// The goodness map of the current step.
    Hazards,
}

/// Generates the enum of the panels from their table.
macro_rules! panes {
    ($($variant:ident: $name:literal, $title:literal, $home:expr, $help:literal, $($panel:ident)::+;)*) => {
        /// A panel.
        #[derive(Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Pane {
            $(#[doc = concat!("The panel “", $title, "”.")] $variant,)*
        }

        impl Pane {
            /// All panels, in the order of the menus.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$variant),*];

            /// Its constant properties.
            pub const fn about(self) -> About {
                match self {
                    $(Self::$variant => About { name: $name, title: $title, help: $help, home: $home },)*
                }
            }
        }
    };
}

panel_table!(panes);

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

    /// The panels of a group in the overview, from the left.
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
            ("close_up", Pane::CloseUp),
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
            ("drive", Pane::Drive),
            ("odometry", Pane::Odometry),
            ("data_flow", Pane::DataFlow),
        ];
        for (name, pane) in stored {
            let text = serde_json::to_string(&pane).unwrap();
            assert_eq!(text, format!("{name:?}"));
            assert_eq!(serde_json::from_str::<Pane>(&text).unwrap(), pane);
        }
        assert!(serde_json::from_str::<Pane>("\"no such panel\"").is_err());
    }
}
