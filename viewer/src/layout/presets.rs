//! The arrangements that come with the page, as tables: rows and columns of groups of panels.
//!
//! All of them fit 1280 × 720. A panel that an arrangement leaves out comes back by the menu of any group of tabs or
//! by the palette.

use egui_tiles::{Container, Linear, LinearDir, TileId, Tiles, Tree};
use serde::{Deserialize, Serialize};

use crate::panels::pane::{Group, Pane};

/// An arrangement by name; Shift and its number calls it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// Everything at a glance.
    #[default]
    Overview,
    /// How the template was matched.
    Match,
    /// How the point was found in space.
    Stereo,
    /// Where rover and target are.
    Map,
    /// Runs beside each other.
    Compare,
    /// Many runs at once.
    Sweep,
    /// What is told of a drive.
    Report,
}

impl Preset {
    /// All of them, in the order of their numbers from 1 on.
    pub const ALL: [Self; 7] =
        [Self::Overview, Self::Match, Self::Stereo, Self::Map, Self::Compare, Self::Sweep, Self::Report];

    /// Its name.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Overview => "Overview",
            Self::Match => "Match",
            Self::Stereo => "Stereo",
            Self::Map => "Map",
            Self::Compare => "Compare",
            Self::Sweep => "Sweep",
            Self::Report => "Report",
        }
    }

    /// Its word in links.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Overview => "overview",
            Self::Match => "match",
            Self::Stereo => "stereo",
            Self::Map => "map",
            Self::Compare => "compare",
            Self::Sweep => "sweep",
            Self::Report => "report",
        }
    }

    /// What it is for.
    pub const fn purpose(self) -> &'static str {
        match self {
            Self::Overview => "everything at a glance",
            Self::Match => "how the template was matched",
            Self::Stereo => "how the point was found in space",
            Self::Map => "where rover and target are",
            Self::Compare => "runs beside each other",
            Self::Sweep => "many runs at once",
            Self::Report => "what is told of a drive",
        }
    }

    /// The arrangement.
    pub fn tree(self) -> Tree<Pane> {
        let mut tiles = Tiles::default();
        let root = build(&mut tiles, self.table());
        Tree::new(egui::Id::unique("panels"), root, tiles)
    }

    const fn table(self) -> &'static Area {
        match self {
            Self::Overview => &OVERVIEW,
            Self::Match => &MATCH,
            Self::Stereo => &STEREO,
            Self::Map => &MAP,
            Self::Compare => &COMPARE,
            Self::Sweep => &SWEEP,
            Self::Report => &REPORT,
        }
    }
}

/// All panels as the tabs of one group: for windows too narrow for two columns.
pub(crate) fn narrow() -> Tree<Pane> {
    let mut tiles = Tiles::default();
    let root = build(&mut tiles, &Area::Tabs(&Pane::ALL));
    Tree::new(egui::Id::unique("panels of a narrow window"), root, tiles)
}

/// A part of an arrangement; numbers are shares of its width or height.
enum Area {
    /// The panels whose home is this group.
    Home(Group),
    /// These panels.
    Tabs(&'static [Pane]),
    Row(&'static [(Area, f32)]),
    Column(&'static [(Area, f32)]),
}

use Area::{Column, Home, Row, Tabs};

/// Every panel where it says that its home is.
const OVERVIEW: Area = Row(&[
    (Home(Group::Lists), 0.17),
    (
        Column(&[
            (Row(&[(Home(Group::LeftImage), 1.0), (Home(Group::Views), 1.0)]), 0.53),
            (Home(Group::Strip), 0.175),
            (Row(&[(Home(Group::Scores), 1.0), (Home(Group::Map), 1.1), (Home(Group::Plots), 1.1)]), 0.295),
        ]),
        0.63,
    ),
    (Column(&[(Home(Group::Verdict), 0.38), (Home(Group::Details), 0.62)]), 0.2),
]);

const MATCH: Area = Row(&[
    (
        Column(&[
            (Row(&[(Tabs(&[Pane::Left]), 1.2), (Tabs(&[Pane::Surface]), 1.0)]), 0.62),
            (Tabs(&[Pane::Strip, Pane::History]), 0.38),
        ]),
        0.74,
    ),
    (
        Column(&[
            (Tabs(&[Pane::Gates, Pane::Machine]), 0.4),
            (Tabs(&[Pane::Why, Pane::Inspector, Pane::Settings, Pane::Targets, Pane::Messages]), 0.6),
        ]),
        0.26,
    ),
]);

const STEREO: Area = Row(&[
    (
        Column(&[
            (Row(&[(Tabs(&[Pane::Left]), 1.0), (Tabs(&[Pane::Right]), 1.0)]), 0.6),
            (
                Row(&[
                    (Tabs(&[Pane::StereoProfile, Pane::Surface]), 1.0),
                    (Tabs(&[Pane::Shape, Pane::Features, Pane::Budget]), 1.0),
                ]),
                0.4,
            ),
        ]),
        0.76,
    ),
    (
        Column(&[
            (Tabs(&[Pane::Gates, Pane::Targets]), 0.4),
            (Tabs(&[Pane::Inspector, Pane::Why, Pane::Messages]), 0.6),
        ]),
        0.24,
    ),
]);

const MAP: Area = Row(&[
    (Column(&[(Tabs(&[Pane::Targets, Pane::Settings]), 0.4), (Tabs(&[Pane::Left, Pane::Right]), 0.6)]), 0.28),
    (Tabs(&[Pane::Map]), 0.42),
    (
        Column(&[
            (Tabs(&[Pane::Plots]), 0.5),
            (Tabs(&[Pane::Tolerances, Pane::Inspector, Pane::Messages]), 0.5),
        ]),
        0.3,
    ),
]);

const COMPARE: Area = Row(&[
    (
        Column(&[
            (Tabs(&[Pane::Left, Pane::Right]), 0.58),
            (Tabs(&[Pane::Strip, Pane::History, Pane::Surface]), 0.42),
        ]),
        0.5,
    ),
    (
        Column(&[
            (Tabs(&[Pane::Runs, Pane::Targets, Pane::Settings]), 0.45),
            (Tabs(&[Pane::Plots, Pane::Map, Pane::Uncertainty]), 0.55),
        ]),
        0.3,
    ),
    (
        Column(&[
            (Tabs(&[Pane::Gates, Pane::Machine]), 0.4),
            (Tabs(&[Pane::Inspector, Pane::Why, Pane::Messages]), 0.6),
        ]),
        0.2,
    ),
]);

const SWEEP: Area = Row(&[
    (Tabs(&[Pane::Targets, Pane::Settings]), 0.22),
    (Tabs(&[Pane::Studies, Pane::Runs, Pane::Budget]), 0.48),
    (Column(&[(Tabs(&[Pane::Left]), 0.5), (Tabs(&[Pane::Plots, Pane::Map, Pane::Messages]), 0.5)]), 0.3),
]);

const REPORT: Area = Row(&[
    (Column(&[(Tabs(&[Pane::Left]), 0.6), (Tabs(&[Pane::Strip, Pane::History]), 0.4)]), 0.45),
    (Column(&[(Tabs(&[Pane::Map]), 0.5), (Tabs(&[Pane::Plots, Pane::Uncertainty]), 0.5)]), 0.35),
    (Tabs(&[Pane::Notes, Pane::Targets, Pane::Gates, Pane::Messages]), 0.2),
]);

fn build(tiles: &mut Tiles<Pane>, area: &Area) -> TileId {
    match area {
        Home(group) => tabs(tiles, &Pane::of_group(*group)),
        Tabs(panes) => tabs(tiles, panes),
        Row(parts) => linear(tiles, LinearDir::Horizontal, parts),
        Column(parts) => linear(tiles, LinearDir::Vertical, parts),
    }
}

fn tabs(tiles: &mut Tiles<Pane>, panes: &[Pane]) -> TileId {
    let children = panes.iter().map(|&pane| tiles.insert_pane(pane)).collect();
    tiles.insert_tab_tile(children)
}

fn linear(tiles: &mut Tiles<Pane>, direction: LinearDir, parts: &[(Area, f32)]) -> TileId {
    let children: Vec<(TileId, f32)> =
        parts.iter().map(|(area, share)| (build(tiles, area), *share)).collect();
    let mut linear = Linear::new(direction, children.iter().map(|(id, _)| *id).collect());
    for (id, share) in children {
        linear.shares.set_share(id, share);
    }
    tiles.insert_container(Container::Linear(linear))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_panel_is_in_the_overview_once_and_in_no_arrangement_twice() {
        for preset in Preset::ALL {
            let tree = preset.tree();
            for pane in Pane::ALL {
                let count = tree
                    .tiles
                    .tiles()
                    .filter(|tile| matches!(tile, egui_tiles::Tile::Pane(p) if *p == pane))
                    .count();
                assert!(count <= 1, "{preset:?} has {pane:?} {count} times");
                assert!(count == 1 || preset != Preset::Overview, "the overview lacks {pane:?}");
            }
        }
    }

    #[test]
    fn every_arrangement_shows_the_left_image_and_where_messages_are() {
        for preset in Preset::ALL {
            let tree = preset.tree();
            for pane in [Pane::Left, Pane::Messages, Pane::Targets] {
                assert!(tree.tiles.find_pane(&pane).is_some(), "{preset:?} lacks {pane:?}");
            }
        }
    }
}
