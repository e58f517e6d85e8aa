//! Where the panels are: a tree of tiles that a person can drag and resize.

use egui::{Color32, Frame, Margin, Stroke, Ui, Visuals, WidgetText};
use egui_tiles::{
    Behavior, Container, Linear, LinearDir, SimplificationOptions, TabState, TileId, Tiles, Tree, UiResponse,
};

use crate::command::Command;
use crate::panels;
use crate::state::State;
use crate::state::messages::Weight;
use crate::theme;
use crate::view2d::Transform;

/// A panel that can be dragged around.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pane {
    /// Targets and runs.
    Targets,
    /// Settings.
    Settings,
    /// The left image.
    Left,
    /// The right image.
    Right,
    /// The template strip.
    Strip,
    /// The template's history.
    History,
    /// The surface of scores.
    Surface,
    /// What the feature tracker saw.
    Features,
    /// What the shape tracker saw.
    Shape,
    /// The error budget.
    Budget,
    /// The validation experiments.
    Studies,
    /// The stereo scores along the epipolar curve.
    StereoProfile,
    /// The map.
    Map,
    /// Plots over steps.
    Plots,
    /// The growing tolerances.
    Tolerances,
    /// The gates.
    Gates,
    /// The state machine of loss.
    Machine,
    /// The selected stage's record.
    Inspector,
    /// Messages.
    Messages,
    /// Breakpoints and expressions.
    Breakpoints,
}

impl Pane {
    /// All of them.
    pub const ALL: [Self; 20] = [
        Self::Targets,
        Self::Settings,
        Self::Left,
        Self::Right,
        Self::Features,
        Self::Shape,
        Self::Budget,
        Self::Studies,
        Self::Strip,
        Self::History,
        Self::Surface,
        Self::StereoProfile,
        Self::Map,
        Self::Plots,
        Self::Tolerances,
        Self::Gates,
        Self::Machine,
        Self::Inspector,
        Self::Messages,
        Self::Breakpoints,
    ];

    /// Its title.
    pub const fn title(self) -> &'static str {
        match self {
            Self::Targets => "Targets and runs",
            Self::Settings => "Settings",
            Self::Left => "Left image",
            Self::Right => "Right image",
            Self::Budget => "Error budget",
            Self::Studies => "Studies",
            Self::Strip => "Template strip",
            Self::History => "Template history",
            Self::Surface => "Match scores",
            Self::Features => "Features",
            Self::Shape => "Shape",
            Self::StereoProfile => "Stereo scores",
            Self::Map => "Map, site frame",
            Self::Plots => "Over the steps",
            Self::Tolerances => "Tolerances",
            Self::Gates => "Gates",
            Self::Machine => "State machine",
            Self::Inspector => "Inspector",
            Self::Messages => "Messages",
            Self::Breakpoints => "Breakpoints",
        }
    }
}

/// Where the left image is on the screen, for whoever needs to click into it.
pub type LeftImage = Option<(Transform, [u32; 2])>;

/// Shows one panel.
pub fn show_pane(ui: &mut Ui, pane: Pane, state: &State, out: &mut Vec<Command>) -> LeftImage {
    match pane {
        Pane::Left => return panels::images_left::show(ui, state, out),
        Pane::Targets => panels::targets::show(ui, state, out),
        Pane::Settings => panels::settings::show(ui, state, out),
        Pane::Right => panels::image_right::show(ui, state, out),
        Pane::Strip => panels::strip::show(ui, state, out),
        Pane::History => panels::history::show(ui, state, out),
        Pane::Surface => panels::surface::show(ui, state, out),
        Pane::Features => panels::features::show(ui, state, out),
        Pane::Shape => panels::shape::show(ui, state, out),
        Pane::Budget => panels::budget::show(ui, state, out),
        Pane::Studies => panels::studies::show(ui, state, out),
        Pane::StereoProfile => panels::stereo_profile::show(ui, state, out),
        Pane::Map => panels::map::show(ui, state, out),
        Pane::Plots => panels::plots::show(ui, state, out),
        Pane::Tolerances => panels::tolerances::show(ui, state, out),
        Pane::Machine => panels::machine::show(ui, state, out),
        Pane::Gates => panels::gates::show(ui, state, out),
        Pane::Inspector => panels::inspector::show(ui, state, out),
        Pane::Messages => panels::messages::show(ui, state, out),
        Pane::Breakpoints => panels::breakpoints::show(ui, state, out),
    }
    None
}

/// The arrangement with which a page opens: it fits 1600 × 1000 and 1280 × 720.
pub fn overview() -> Tree<Pane> {
    let mut tiles = Tiles::default();
    let tabs = |tiles: &mut Tiles<Pane>, panes: &[Pane]| {
        let children = panes.iter().map(|&pane| tiles.insert_pane(pane)).collect();
        tiles.insert_tab_tile(children)
    };
    let side = tabs(&mut tiles, &[Pane::Targets, Pane::Settings]);
    let left = tabs(&mut tiles, &[Pane::Left]);
    let right = tabs(&mut tiles, &[Pane::Right, Pane::Features, Pane::Shape, Pane::Budget, Pane::Studies]);
    let strip = tabs(&mut tiles, &[Pane::Strip, Pane::History]);
    let surface = tabs(&mut tiles, &[Pane::Surface, Pane::StereoProfile]);
    let map = tabs(&mut tiles, &[Pane::Map]);
    let plots = tabs(&mut tiles, &[Pane::Plots, Pane::Tolerances]);
    let gates = tabs(&mut tiles, &[Pane::Gates, Pane::Machine, Pane::Breakpoints]);
    let inspector = tabs(&mut tiles, &[Pane::Inspector, Pane::Messages]);
    let images = linear(&mut tiles, LinearDir::Horizontal, &[(left, 1.0), (right, 1.0)]);
    let charts = linear(&mut tiles, LinearDir::Horizontal, &[(surface, 1.0), (map, 1.1), (plots, 1.1)]);
    let middle = linear(&mut tiles, LinearDir::Vertical, &[(images, 0.53), (strip, 0.175), (charts, 0.295)]);
    let record = linear(&mut tiles, LinearDir::Vertical, &[(gates, 0.38), (inspector, 0.62)]);
    let root = linear(&mut tiles, LinearDir::Horizontal, &[(side, 0.17), (middle, 0.63), (record, 0.2)]);
    Tree::new(egui::Id::unique("panels"), root, tiles)
}

fn linear(tiles: &mut Tiles<Pane>, direction: LinearDir, children: &[(TileId, f32)]) -> TileId {
    let mut linear = Linear::new(direction, children.iter().map(|(id, _)| *id).collect());
    for (id, share) in children {
        linear.shares.set_share(*id, *share);
    }
    tiles.insert_container(Container::Linear(linear))
}

/// Shows the panels and gathers their commands.
pub struct Panels<'a> {
    /// What they show.
    pub state: &'a State,
    /// What they ask for.
    pub out: &'a mut Vec<Command>,
    /// Where the left image is.
    pub left_image: LeftImage,
    /// The panels that are on the screen.
    pub seen: Vec<Pane>,
}

impl Behavior<Pane> for Panels<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _tile: TileId, pane: &mut Pane) -> UiResponse {
        self.seen.push(*pane);
        let margin = match pane {
            Pane::Strip | Pane::History => Margin::symmetric(theme::MARGIN, 3),
            Pane::Left | Pane::Right | Pane::Surface => Margin { left: 4, right: 4, top: 4, bottom: 0 },
            _ => Margin::same(theme::MARGIN),
        };
        Frame::new().fill(theme::PANEL).inner_margin(margin).show(ui, |ui| {
            let shown = show_pane(ui, *pane, self.state, self.out);
            self.left_image = shown.or(self.left_image.take());
            ui.take_available_space();
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> WidgetText {
        let problems = self.state.messages.all().iter().filter(|m| m.weight == Weight::Problem).count();
        match pane {
            Pane::Messages if problems > 0 => {
                theme::title(&format!("Messages ({problems})")).color(theme::LOST).into()
            }
            Pane::Settings if !self.state.draft.is_empty() => {
                theme::title(&format!("Settings ({})", self.state.draft.len())).color(theme::ACCENT).into()
            }
            pane => theme::title(pane.title()).into(),
        }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn gap_width(&self, _style: &egui::Style) -> f32 {
        3.0
    }

    fn tab_bar_height(&self, _style: &egui::Style) -> f32 {
        21.0
    }

    fn tab_bar_color(&self, _visuals: &Visuals) -> Color32 {
        theme::BAR
    }

    fn tab_bg_color(
        &self,
        _visuals: &Visuals,
        _tiles: &Tiles<Pane>,
        _tile: TileId,
        state: &TabState,
    ) -> Color32 {
        if state.active { theme::PANEL } else { Color32::TRANSPARENT }
    }

    fn tab_outline_stroke(
        &self,
        _visuals: &Visuals,
        _tiles: &Tiles<Pane>,
        _tile: TileId,
        _state: &TabState,
    ) -> Stroke {
        Stroke::NONE
    }

    fn tab_bar_hline_stroke(&self, _visuals: &Visuals) -> Stroke {
        Stroke::NONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_panel_is_in_the_overview_once() {
        let tree = overview();
        for pane in Pane::ALL {
            assert!(tree.tiles.find_pane(&pane).is_some(), "{pane:?}");
        }
        let panes = tree.tiles.tiles().filter(|tile| tile.is_pane()).count();
        assert_eq!(panes, Pane::ALL.len());
    }
}
