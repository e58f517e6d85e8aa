//! Where the panels are: a tree of tiles that a person can drag, resize, close and bring back.
//!
//! | file | what it does |
//! |---|---|
//! | `presets` | the seven arrangements that come with the page, and the one for narrow windows |
//! | `workspace` | the arrangement in use: presets, the panel with the keyboard, the one that fills the page; kept across reloads |

pub mod presets;
pub mod workspace;

use egui::{Color32, Frame, Margin, RichText, Stroke, Ui, Visuals, WidgetText};
use egui_tiles::{Behavior, SimplificationOptions, TabState, TileId, Tiles, UiResponse};
use serde::{Deserialize, Serialize};

use self::workspace::LayoutCommand;
use crate::command::Command;
use crate::panels;
use crate::state::State;
use crate::state::messages::Weight;
use crate::theme;
use crate::view2d::Transform;

/// A panel that can be dragged around.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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
    /// The table of runs with their metrics.
    Runs,
    /// Whether the covariances hold.
    Uncertainty,
    /// Why a step came out as it did.
    Why,
    /// Notes.
    Notes,
    /// Breakpoints and expressions.
    Breakpoints,
}

impl Pane {
    /// All of them.
    pub const ALL: [Self; 24] = [
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
        Self::Runs,
        Self::Uncertainty,
        Self::Why,
        Self::Notes,
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
            Self::Runs => "Runs",
            Self::Uncertainty => "Uncertainty",
            Self::Why => "Why",
            Self::Notes => "Notes",
            Self::Breakpoints => "Breakpoints",
        }
    }
}

/// Where the left image is on the screen, for whoever needs to click into it.
pub type LeftImage = Option<(Transform, [u32; 2])>;

/// Shows one panel.
pub fn show_pane(ui: &mut Ui, pane: Pane, state: &State, out: &mut Vec<Command>) -> LeftImage {
    if state.is_table(pane) {
        panels::sheets::show(ui, state, pane, out);
        return None;
    }
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
        Pane::Runs => panels::runs::show(ui, state, out),
        Pane::Uncertainty => panels::uncertainty::show(ui, state, out),
        Pane::Why => panels::why::show(ui, state, out),
        Pane::Notes => panels::notes::show(ui, state, out),
        Pane::Breakpoints => panels::breakpoints::show(ui, state, out),
    }
    None
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
    /// Where they are on the screen, points.
    pub places: Vec<(Pane, egui::Rect)>,
    /// The panel with the keyboard.
    pub current: Option<Pane>,
    /// Whether the keyboard goes into that panel in this frame.
    pub takes_keyboard: bool,
    /// The panels that are closed.
    pub closed: Vec<Pane>,
    /// The panel that fills the page.
    pub maximised: Option<Pane>,
}

impl<'a> Panels<'a> {
    /// Shows `state` and puts what is asked for into `out`.
    pub fn new(state: &'a State, out: &'a mut Vec<Command>) -> Self {
        let (seen, places, closed) = (Vec::new(), Vec::new(), Vec::new());
        let (left_image, current, maximised) = (None, None, None);
        Self { state, out, left_image, seen, places, current, takes_keyboard: false, closed, maximised }
    }

    /// Shows a panel's contents on its ground, as a region that a screen reader and the keyboard find.
    fn framed(&mut self, ui: &mut Ui, pane: Pane, show: impl FnOnce(&mut Self, &mut Ui)) {
        let margin = match pane {
            Pane::Strip | Pane::History => Margin::symmetric(theme::MARGIN, 3),
            Pane::Left | Pane::Right | Pane::Surface => Margin { left: 4, right: 4, top: 4, bottom: 0 },
            _ => Margin::same(theme::MARGIN),
        };
        let place = ui.max_rect();
        self.places.push((pane, place));
        crate::tour::here(ui.ctx(), pane.title(), place);
        region(ui, pane.title(), place);
        // The panel itself can have the keyboard, so that Tab goes on with what is in it.
        let whole =
            ui.interact(place, ui.scope_id().with("whole panel"), egui::Sense::focusable_noninteractive());
        whole.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Group, true, format!("{} panel", pane.title()))
        });
        if self.takes_keyboard && self.current == Some(pane) {
            whole.request_focus();
        }
        if whole.has_focus() {
            self.current = Some(pane);
        }
        Frame::new().fill(theme::panel()).inner_margin(margin).show(ui, |ui| {
            show(self, ui);
            ui.take_available_space();
        });
        if whole.has_focus() {
            let ring = Stroke::new(1.5, theme::accent());
            ui.painter().rect_stroke(place.shrink(1.0), 2.0, ring, egui::StrokeKind::Inside);
        }
    }

    /// The menu of a group of tabs: what can be done with its front panel, and the closed panels.
    fn menu(&mut self, ui: &mut Ui, front: Option<Pane>) {
        let name = front.map_or_else(|| "panels".to_owned(), |pane| format!("{} menu", pane.title()));
        let dots = egui::Button::new(RichText::new("...").color(theme::weak())).frame(false);
        let button = ui.add(dots.min_size(egui::vec2(24.0, 20.0)));
        let button = button.accessible_name(name).on_hover_text("This panel, and closed ones");
        egui::Popup::menu(&button).show(|ui| {
            ui.set_min_width(180.0);
            if let Some(pane) = front {
                let words =
                    if self.maximised.is_some() { "Restore all panels (`)" } else { "Fill the page (`)" };
                if ui.button(words).clicked() {
                    self.out.push(Command::Layout(LayoutCommand::Maximise(Some(pane))));
                }
                if ui.button(format!("Close {}", pane.title())).clicked() {
                    self.out.push(Command::Layout(LayoutCommand::Close(pane)));
                }
                ui.separator();
                panels::figure_menu::entries(ui, self.state, pane, self.out);
            }
            if !self.closed.is_empty() {
                ui.separator();
            }
            for pane in &self.closed {
                if ui.button(format!("Show {}", pane.title())).clicked() {
                    self.out.push(Command::Layout(LayoutCommand::Show(*pane)));
                }
            }
        });
    }
}

/// Makes what `ui` holds a region with a name.
pub fn region(ui: &Ui, name: &str, place: egui::Rect) {
    ui.ctx().accesskit_node_builder(ui.unique_id(), |node| {
        node.set_role(egui::Role::Region);
        node.set_label(name);
        let [x0, y0, x1, y1] = [place.min.x, place.min.y, place.max.x, place.max.y].map(f64::from);
        node.set_bounds(egui::accesskit::Rect { x0, y0, x1, y1 });
    });
}

impl Behavior<Pane> for Panels<'_> {
    fn pane_ui(&mut self, ui: &mut Ui, _tile: TileId, pane: &mut Pane) -> UiResponse {
        self.seen.push(*pane);
        self.framed(ui, *pane, |panels, ui| {
            let shown = show_pane(ui, *pane, panels.state, panels.out);
            panels.left_image = shown.or(panels.left_image.take());
        });
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> WidgetText {
        let problems = self.state.messages.all().iter().filter(|m| m.weight == Weight::Problem).count();
        match pane {
            Pane::Messages if problems > 0 => {
                theme::title(&format!("Messages ({problems})")).color(theme::lost()).into()
            }
            Pane::Settings if !self.state.draft.is_empty() => {
                theme::title(&format!("Settings ({})", self.state.draft.len())).color(theme::accent()).into()
            }
            pane => theme::title(pane.title()).into(),
        }
    }

    fn on_tab_button(
        &mut self,
        tiles: &mut Tiles<Pane>,
        tile: TileId,
        button: egui::Response,
    ) -> egui::Response {
        let name = tiles.get_pane(&tile).map(|pane| pane.title());
        button.ctx.accesskit_node_builder(button.id, |node| {
            node.set_role(egui::Role::Tab);
            // What is painted is in capitals, which some readers would spell.
            node.set_label(name.unwrap_or("panels"));
        });
        if button.clicked() {
            self.current = tiles.get_pane(&tile).copied().or(self.current);
        }
        button
    }

    fn top_bar_right_ui(
        &mut self,
        tiles: &Tiles<Pane>,
        ui: &mut Ui,
        _tile: TileId,
        tabs: &egui_tiles::Tabs,
        _scroll: &mut f32,
    ) {
        let front = tabs.active.and_then(|tile| tiles.get_pane(&tile)).copied();
        self.menu(ui, front);
        if let Some(pane) = front {
            panels::sheets::switch(ui, self.state, pane, self.out);
        }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn gap_width(&self, _style: &egui::Style) -> f32 {
        3.0
    }

    fn tab_bar_height(&self, _style: &egui::Style) -> f32 {
        24.0
    }

    fn tab_bar_color(&self, _visuals: &Visuals) -> Color32 {
        theme::bar()
    }

    fn tab_bg_color(
        &self,
        _visuals: &Visuals,
        _tiles: &Tiles<Pane>,
        _tile: TileId,
        state: &TabState,
    ) -> Color32 {
        if state.active { theme::panel() } else { Color32::TRANSPARENT }
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
