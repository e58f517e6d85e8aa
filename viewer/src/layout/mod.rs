//! The arrangement of the panels: a tree of tiles that the user can drag, resize, close and reopen.
//!
//! | file | what it does |
//! |---|---|
//! | `command` | the commands that change the arrangement |
//! | `left_image` | the position of the left image on the screen |
//! | `presets` | the eight predefined arrangements, and the one for narrow windows |
//! | `workspace` | the current arrangement, focused panel and maximised panel; stored across reloads |

pub(crate) mod command;
pub(crate) mod left_image;
pub(crate) mod presets;
pub(crate) mod workspace;

use egui::{Color32, EventFilter, Frame, RichText, Stroke, Ui, Visuals, WidgetText};
use egui_tiles::{Behavior, SimplificationOptions, TabState, TileId, Tiles, UiResponse};

use self::command::LayoutCommand;
use self::left_image::{LeftImage, take_left_image};
use crate::command::Command;
use crate::panels;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::theme;

/// Shows one panel: its contents, its values as tables, or why it is empty.
///
/// Returns the position of the left image, if the panel showed it.
pub(crate) fn show_pane(ui: &mut Ui, pane: Pane, state: &State, out: &mut Vec<Command>) -> LeftImage {
    let panel = pane.panel();
    if state.is_table(pane) {
        panels::sheets::of_panel::show(ui, state, pane, out);
    } else if let Some(sentence) = panel.missing(state) {
        panels::missing(ui, pane.about().help, &sentence);
    } else {
        panel.show(ui, state, out);
    }
    take_left_image(ui)
}

/// Shows the panels and collects their commands.
pub(crate) struct Panels<'a> {
    /// The state shown.
    pub state: &'a State,
    /// The commands of the panels.
    pub out: &'a mut Vec<Command>,
    /// The position of the left image.
    pub left_image: LeftImage,
    /// The visible panels.
    pub seen: Vec<Pane>,
    /// The screen rectangles of the visible panels, points.
    pub places: Vec<(Pane, egui::Rect)>,
    /// The panel with the keyboard focus.
    pub current: Option<Pane>,
    /// Whether that panel takes the keyboard focus in this frame.
    pub takes_keyboard: bool,
    /// The closed panels.
    pub closed: Vec<Pane>,
    /// The maximised panel.
    pub maximised: Option<Pane>,
    /// A front tab that its tab bar must scroll into view.
    scrolls_to: Option<TileId>,
}

impl<'a> Panels<'a> {
    /// Creates the behaviour that shows `state` and pushes commands to `out`.
    pub(crate) fn new(state: &'a State, out: &'a mut Vec<Command>) -> Self {
        let (seen, places, closed) = (Vec::new(), Vec::new(), Vec::new());
        let (left_image, current, maximised, scrolls_to) = (None, None, None, None);
        let takes_keyboard = false;
        Self { state, out, left_image, seen, places, current, takes_keyboard, closed, maximised, scrolls_to }
    }

    /// Shows a panel's contents on its background, as a region for screen readers and keyboard focus.
    fn framed(&mut self, ui: &mut Ui, pane: Pane, show: impl FnOnce(&mut Self, &mut Ui)) {
        let margin = pane.panel().margin();
        let place = ui.max_rect();
        self.places.push((pane, place));
        crate::tour::here(ui.ctx(), pane.title(), place);
        region(ui, pane.title(), place);
        // The panel itself is focusable, so that Tab continues with its contents.
        let whole =
            ui.interact(place, ui.scope_id().with("whole panel"), egui::Sense::focusable_noninteractive());
        whole.widget_info(|| {
            egui::WidgetInfo::labeled(egui::Role::Group, true, format!("{} panel", pane.title()))
        });
        if self.takes_keyboard && self.current == Some(pane) {
            whole.request_focus();
        }
        // A panel that only keeps the focus must not override the one that receives it.
        if whole.gained_focus() || is_pressed(ui, place) {
            self.current = Some(pane);
        }
        Frame::new().fill(theme::panel()).inner_margin(margin).show(ui, |ui| {
            show(self, ui);
            ui.take_available_space();
        });
        if whole.has_focus() {
            // Arrow keys have no use in a panel: they change the step as everywhere else.
            let arrows =
                EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(whole.id, arrows));
            ui.data_mut(|data| data.insert_temp(panel_with_keyboard(), whole.id));
            let ring = Stroke::new(1.5, theme::accent());
            ui.painter().rect_stroke(place.shrink(1.0), 2.0, ring, egui::StrokeKind::Inside);
        }
    }

    /// The menu of a group of tabs: commands for its front panel, and the closed panels.
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
                crate::exports::figure_menu::entries(ui, self.state, pane, self.out);
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

/// The id under which the last focused panel is stored.
fn panel_with_keyboard() -> egui::Id {
    egui::Id::unique("panel with the keyboard")
}

/// Whether a focused widget is a whole panel, which uses no keys itself.
pub(crate) fn is_panel(context: &egui::Context, id: egui::Id) -> bool {
    context.data(|data| data.get_temp(panel_with_keyboard())) == Some(id)
}

/// Whether the pointer is pressed inside a panel in this frame, and not on a window above it.
fn is_pressed(ui: &Ui, place: egui::Rect) -> bool {
    ui.input(|input| input.pointer.any_pressed()) && ui.rect_contains_pointer(place)
}

/// Whether a tab came to the front of its group, or its tab bar changed width, at most three passes ago: egui needs these
/// passes to lay out the arrows beside the tabs.
fn is_new_front(ui: &Ui, group: TileId, tile: TileId) -> bool {
    let (now, width) = (ui.ctx().cumulative_pass_nr(), ui.max_rect().width());
    let id = egui::Id::unique("front tab").with(group);
    ui.data_mut(|data| {
        let last = data.get_temp::<(TileId, f32, u64)>(id).filter(|last| (last.0, last.1) == (tile, width));
        let (.., since) = last.unwrap_or((tile, width, now));
        data.insert_temp(id, (tile, width, since));
        now <= since + 3
    })
}

/// Gives `ui` the role of a region with a name, for screen readers.
pub(crate) fn region(ui: &Ui, name: &str, place: egui::Rect) {
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
        match pane.panel().badge(self.state) {
            Some((count, colour)) => {
                theme::title(&format!("{} ({count})", pane.title())).color(colour).into()
            }
            None => theme::title(pane.title()).into(),
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
            // The painted title is in capitals, which some screen readers spell out.
            node.set_label(name.unwrap_or("panels"));
        });
        if self.scrolls_to == Some(tile) {
            button.scroll_to_me_animation(None, egui::style::ScrollAnimation::none());
        }
        if button.clicked() {
            self.current = tiles.get_pane(&tile).copied().or(self.current);
        }
        button
    }

    fn top_bar_right_ui(
        &mut self,
        tiles: &Tiles<Pane>,
        ui: &mut Ui,
        group: TileId,
        tabs: &egui_tiles::Tabs,
        _scroll: &mut f32,
    ) {
        self.scrolls_to = tabs.active.filter(|tile| is_new_front(ui, group, *tile));
        let front = tabs.active.and_then(|tile| tiles.get_pane(&tile)).copied();
        self.menu(ui, front);
        if let Some(pane) = front {
            panels::sheets::of_panel::switch(ui, self.state, pane, self.out);
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
