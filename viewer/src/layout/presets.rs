//! The predefined arrangements as tables: rows and columns of groups of panels.
//!
//! All of them fit 1280 × 720. A panel that an arrangement does not contain can be opened by the menu of any group of tabs
//! or by the palette.

use egui_tiles::{Container, Linear, LinearDir, TileId, Tiles, Tree};
use serde::{Deserialize, Serialize};

use crate::panels::pane::{Group, Pane};

/// A predefined arrangement; Shift and its number selects it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// All panels.
    #[default]
    Overview,
    /// Evidence of the template match.
    Match,
    /// Evidence of the stereo measurement.
    Stereo,
    /// Positions of rover and target.
    Map,
    /// Runs side by side.
    Compare,
    /// Studies of many runs.
    Studies,
    /// The report of a drive.
    Report,
    /// The image with few other panels.
    Image,
}

impl Preset {
    /// All arrangements, in the order of their numbers from 1.
    pub const ALL: [Self; 8] = [
        Self::Overview,
        Self::Match,
        Self::Stereo,
        Self::Map,
        Self::Compare,
        Self::Studies,
        Self::Report,
        Self::Image,
    ];

    /// Its name.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Overview => "Overview",
            Self::Match => "Match",
            Self::Stereo => "Stereo",
            Self::Map => "Map",
            Self::Compare => "Compare",
            Self::Studies => "Studies",
            Self::Report => "Report",
            Self::Image => "Image",
        }
    }

    /// Its word in links and storage.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Overview => "overview",
            Self::Match => "match",
            Self::Stereo => "stereo",
            Self::Map => "map",
            Self::Compare => "compare",
            Self::Studies => "studies",
            Self::Report => "report",
            Self::Image => "image",
        }
    }

    /// Its purpose.
    pub const fn purpose(self) -> &'static str {
        match self {
            Self::Overview => "everything at a glance",
            Self::Match => "how the template was matched",
            Self::Stereo => "how the point was found in space",
            Self::Map => "positions of rover and target",
            Self::Compare => "runs beside each other",
            Self::Studies => "many runs at once",
            Self::Report => "the report of a drive: metrics, notes, exports",
            Self::Image => "the image with little else",
        }
    }

    /// The panel that a narrow window shows below the left image.
    pub(crate) const fn lead(self) -> Pane {
        match self {
            Self::Overview | Self::Image => Pane::Targets,
            Self::Match => Pane::Strip,
            Self::Stereo => Pane::Right,
            Self::Map => Pane::Map,
            Self::Compare => Pane::Runs,
            Self::Studies => Pane::Studies,
            Self::Report => Pane::Notes,
        }
    }

    /// The tree of tiles for images of this shape.
    pub fn tree(self, shape: ImageShape) -> Tree<Pane> {
        let mut tiles = Tiles::default();
        let root = build(&mut tiles, self.table(shape));
        Tree::new(egui::Id::unique("panels"), root, tiles)
    }

    const fn table(self, shape: ImageShape) -> &'static Area {
        match self {
            Self::Overview if matches!(shape, ImageShape::Wide) => &WIDE_OVERVIEW,
            Self::Image if matches!(shape, ImageShape::Wide) => &WIDE_IMAGE,
            Self::Overview => &OVERVIEW,
            Self::Image => &IMAGE,
            Self::Match => &MATCH,
            Self::Stereo => &STEREO,
            Self::Map => &MAP,
            Self::Compare => &COMPARE,
            Self::Studies => &STUDIES,
            Self::Report => &REPORT,
        }
    }
}

/// The shape of a traverse's images, which determines whether they are side by side or stacked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImageShape {
    /// About as wide as high.
    #[default]
    Square,
    /// At least twice as wide as high.
    Wide,
}

impl ImageShape {
    /// The shape of an image of this width and height, px.
    pub(crate) fn of([width, height]: [u32; 2]) -> Self {
        if width >= 2 * height { Self::Wide } else { Self::Square }
    }
}

/// The tree for windows too narrow for two columns: the left image, and below it all other panels as tabs.
pub(crate) fn narrow() -> Tree<Pane> {
    let mut tiles = Tiles::default();
    let image = tabs(&mut tiles, &[Pane::Left]);
    let others: Vec<Pane> = Pane::ALL.into_iter().filter(|pane| *pane != Pane::Left).collect();
    let others = tabs(&mut tiles, &others);
    let root = tiles.insert_vertical_tile(vec![image, others]);
    Tree::new(egui::Id::unique("panels of a narrow window"), root, tiles)
}

/// A part of an arrangement; numbers are shares of its width or height.
enum Area {
    /// The panels of these groups in the overview.
    Home(&'static [Group]),
    /// These panels.
    Tabs(&'static [Pane]),
    Row(&'static [(Area, f32)]),
    Column(&'static [(Area, f32)]),
}

use Area::{Column, Home, Row, Tabs};

/// Every panel in its group: the left image large, beside it the target's close-up above other views.
const OVERVIEW: Area = Row(&[
    (
        Column(&[
            (
                Row(&[
                    (Home(&[Group::LeftImage]), 0.43),
                    (
                        Column(&[
                            (Home(&[Group::CloseUp]), 0.46),
                            (Row(&[(Home(&[Group::Views]), 1.0), (Home(MAP_AND_PLOTS), 1.0)]), 0.54),
                        ]),
                        0.57,
                    ),
                ]),
                0.765,
            ),
            (Home(&[Group::Strip]), 0.235),
        ]),
        0.76,
    ),
    (COLUMN, 0.24),
]);

/// The same with the left image across the width and the other views below it.
const WIDE_OVERVIEW: Area = Row(&[
    (
        Column(&[
            (Home(&[Group::LeftImage]), 0.46),
            (
                Row(&[
                    (Home(&[Group::CloseUp]), 1.0),
                    (Home(&[Group::Views]), 1.0),
                    (Home(MAP_AND_PLOTS), 1.0),
                ]),
                0.32,
            ),
            (Home(&[Group::Strip]), 0.22),
        ]),
        0.78,
    ),
    (COLUMN, 0.22),
]);

const MAP_AND_PLOTS: &[Group] = &[Group::Map, Group::Plots, Group::Scores];

/// The column right of the images.
const COLUMN: Area = Column(&[
    (Home(&[Group::Lists]), 0.25),
    (Home(&[Group::Verdict]), 0.43),
    (Home(&[Group::Details]), 0.32),
]);

const IMAGE: Area = Row(&[
    (Tabs(&[Pane::Left, Pane::Right]), 0.68),
    (
        Column(&[
            (Tabs(&[Pane::CloseUp, Pane::Surface]), 0.3),
            (Tabs(&[Pane::Targets, Pane::Settings, Pane::Drive]), 0.28),
            (Tabs(&[Pane::Why, Pane::Gates, Pane::Inspector, Pane::Messages]), 0.42),
        ]),
        0.32,
    ),
]);

const WIDE_IMAGE: Area = Column(&[
    (Tabs(&[Pane::Left]), 0.44),
    (Tabs(&[Pane::Right, Pane::CloseUp, Pane::Surface]), 0.34),
    (
        Row(&[
            (Tabs(&[Pane::Targets, Pane::Settings, Pane::Drive]), 1.0),
            (Tabs(&[Pane::Gates, Pane::Why, Pane::Inspector, Pane::Messages]), 1.0),
        ]),
        0.22,
    ),
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

const STUDIES: Area = Row(&[
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
        Home(groups) => {
            let panes: Vec<Pane> = groups.iter().flat_map(|group| Pane::of_group(*group)).collect();
            tabs(tiles, &panes)
        }
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

    fn all() -> impl Iterator<Item = (Preset, ImageShape)> {
        let shapes = [ImageShape::Square, ImageShape::Wide];
        Preset::ALL.into_iter().flat_map(move |preset| shapes.map(|shape| (preset, shape)))
    }

    #[test]
    fn every_panel_is_in_the_overview_once_and_in_no_arrangement_twice() {
        for (preset, shape) in all() {
            let tree = preset.tree(shape);
            for pane in Pane::ALL {
                let count = tree
                    .tiles
                    .tiles()
                    .filter(|tile| matches!(tile, egui_tiles::Tile::Pane(p) if *p == pane))
                    .count();
                assert!(count <= 1, "{preset:?} {shape:?} has {pane:?} {count} times");
                assert!(count == 1 || preset != Preset::Overview, "the overview lacks {pane:?}");
            }
        }
    }

    #[test]
    fn every_arrangement_shows_the_left_image_and_where_messages_are() {
        for (preset, shape) in all() {
            let tree = preset.tree(shape);
            for pane in [Pane::Left, Pane::Messages, Pane::Targets] {
                assert!(tree.tiles.find_pane(&pane).is_some(), "{preset:?} lacks {pane:?}");
            }
        }
    }
}
