//! The current arrangement: the tree of panels, the focused panel and the maximised panel. The browser stores the tree
//! across reloads; a stored tree that is invalid or of another version is replaced by the overview.

use egui::Ui;
use egui_tiles::{Container, Tile, TileId, Tree};
use serde::{Deserialize, Serialize};

use crate::layout::command::LayoutCommand;
use crate::layout::presets::{ImageShape, Preset, narrow};
use crate::layout::{Panels, show_pane};
use crate::panels::pane::Pane;
use crate::theme;

/// Windows narrower than this have one column, points.
const NARROW: f32 = 900.0;

/// The version of the stored format.
const STORED_FORMAT: u32 = 2;

/// The current arrangement.
pub(crate) struct Workspace {
    tree: Tree<Pane>,
    narrow: Tree<Pane>,
    preset: Preset,
    /// The shape of the images for which the tree was built.
    shape: ImageShape,
    maximised: Option<Pane>,
    current: Option<Pane>,
    /// The visible panels, in reading order.
    seen: Vec<Pane>,
    is_narrow: bool,
    /// Whether the current panel takes the keyboard focus in the next frame.
    wants_keyboard: bool,
}

/// The stored form.
#[derive(Serialize, Deserialize)]
struct StoredLayout {
    format: u32,
    preset: Preset,
    shape: ImageShape,
    tree: Tree<Pane>,
}

impl Default for Workspace {
    fn default() -> Self {
        Self {
            tree: Preset::Overview.tree(ImageShape::Square),
            narrow: narrow(),
            preset: Preset::Overview,
            shape: ImageShape::Square,
            maximised: None,
            current: None,
            seen: Vec::new(),
            is_narrow: false,
            wants_keyboard: false,
        }
    }
}

impl Workspace {
    /// Restores a stored arrangement; the overview if there is none or it is invalid.
    pub(crate) fn restored(stored: Option<&str>) -> Self {
        let stored = stored.and_then(|text| serde_json::from_str::<StoredLayout>(text).ok());
        let usable = stored.filter(|stored| stored.format == STORED_FORMAT && is_sound(&stored.tree));
        usable.map_or_else(Self::default, |stored| Self {
            tree: stored.tree,
            preset: stored.preset,
            shape: stored.shape,
            ..Self::default()
        })
    }

    /// The arrangement as stored by the browser.
    pub(crate) fn to_stored(&self) -> String {
        let stored = StoredLayout {
            format: STORED_FORMAT,
            preset: self.preset,
            shape: self.shape,
            tree: self.tree.clone(),
        };
        serde_json::to_string(&stored).unwrap_or_default()
    }

    /// The last selected arrangement.
    pub(crate) fn preset(&self) -> Preset {
        self.preset
    }

    /// The closed panels.
    pub(crate) fn closed(&self) -> Vec<Pane> {
        Pane::ALL.into_iter().filter(|pane| self.tree.tiles.find_pane(pane).is_none()).collect()
    }

    /// Carries out one command.
    pub(crate) fn apply(&mut self, command: LayoutCommand) {
        match command {
            LayoutCommand::Use(preset) => {
                (self.tree, self.preset, self.maximised) = (preset.tree(self.shape), preset, None);
                bring_to_front(&mut self.narrow, preset.lead());
            }
            LayoutCommand::Show(pane) => self.show_panel(pane),
            LayoutCommand::Close(pane) => self.close(pane),
            LayoutCommand::Panel(by) => self.step_panel(by),
            LayoutCommand::Maximise(pane) if self.maximised.is_none() => {
                self.maximised = pane.or(self.current).or(self.seen.first().copied());
            }
            LayoutCommand::Maximise(_) => self.maximised = None,
        }
    }

    /// Sets the size of the images, px. An unmodified arrangement is rebuilt for their shape.
    pub(crate) fn fit_images(&mut self, size: [u32; 2]) {
        let shape = ImageShape::of(size);
        if shape == self.shape {
            return;
        }
        if self.is_as_it_came() {
            self.tree = self.preset.tree(shape);
        }
        self.shape = shape;
    }

    /// Whether no panel was moved, closed or resized since the arrangement was selected.
    fn is_as_it_came(&self) -> bool {
        let places = |tree: &Tree<Pane>| {
            let tiles = tree.tiles.tiles();
            let mut shares: Vec<String> = tiles
                .map(|tile| match tile {
                    Tile::Container(Container::Linear(linear)) => {
                        format!("{:?} {:?}", linear.dir, linear.shares)
                    }
                    Tile::Container(Container::Tabs(tabs)) => tabs.children.len().to_string(),
                    other => format!("{other:?}"),
                })
                .collect();
            shares.sort();
            shares
        };
        places(&self.tree) == places(&self.preset.tree(self.shape))
    }

    fn tree_in_use(&mut self) -> &mut Tree<Pane> {
        if self.is_narrow { &mut self.narrow } else { &mut self.tree }
    }

    fn show_panel(&mut self, pane: Pane) {
        if self.maximised.is_some() {
            self.maximised = Some(pane);
        }
        (self.current, self.wants_keyboard) = (Some(pane), true);
        let tree = self.tree_in_use();
        if tree.tiles.find_pane(&pane).is_none() {
            restore_pane(tree, pane);
        }
        // In both trees, because the window may be resized.
        [&mut self.tree, &mut self.narrow].into_iter().for_each(|tree| bring_to_front(tree, pane));
    }

    fn close(&mut self, pane: Pane) {
        if let Some(tile) = self.tree.tiles.find_pane(&pane) {
            self.tree.remove_recursively(tile);
        }
        self.maximised = self.maximised.filter(|open| *open != pane);
        self.current = self.current.filter(|open| *open != pane);
    }

    fn step_panel(&mut self, by: isize) {
        let count = self.seen.len();
        if count == 0 {
            return;
        }
        let at = self.current.and_then(|pane| self.seen.iter().position(|seen| *seen == pane));
        let first = if by < 0 { count - 1 } else { 0 };
        let next = at.map_or(first, |at| (at as isize + by).rem_euclid(count as isize) as usize);
        (self.current, self.wants_keyboard) = (Some(self.seen[next]), true);
    }

    /// Shows the panels.
    pub(crate) fn show(&mut self, ui: &mut Ui, panels: &mut Panels<'_>) {
        self.is_narrow = ui.ctx().content_rect().width() < NARROW;
        panels.current = self.current;
        panels.takes_keyboard = std::mem::take(&mut self.wants_keyboard);
        panels.closed = if self.is_narrow { Vec::new() } else { self.closed() };
        panels.maximised = self.maximised;
        if let Some(pane) = self.maximised {
            panels.show_alone(ui, pane);
        } else if self.closed().len() == Pane::ALL.len() && !self.is_narrow {
            all_closed(ui, panels);
        } else if self.is_narrow {
            self.narrow.ui(panels, ui);
        } else {
            self.tree.ui(panels, ui);
        }
        self.current = panels.current;
        self.seen.clone_from(&panels.seen);
    }
}

fn bring_to_front(tree: &mut Tree<Pane>, pane: Pane) {
    tree.make_active(|_, tile| matches!(tile, Tile::Pane(other) if *other == pane));
}

/// Shown if all panels are closed.
fn all_closed(ui: &mut Ui, panels: &mut Panels<'_>) {
    ui.centered_and_justified(|ui| {
        let words = theme::label("Every panel is closed. Press Shift+1, or click here, for the overview.");
        if ui.add(egui::Button::new(words).frame(false)).clicked() {
            panels.out.push(crate::command::Command::Layout(LayoutCommand::Use(Preset::Overview)));
        }
    });
}

/// Whether every tile of a tree exists, and no panel is in it twice.
fn is_sound(tree: &Tree<Pane>) -> bool {
    let Some(root) = tree.root else { return true };
    let mut panes = Vec::new();
    let mut seen = std::collections::HashSet::new();
    let mut waiting = vec![root];
    while let Some(id) = waiting.pop() {
        match tree.tiles.get(id) {
            _ if !seen.insert(id) => return false,
            None => return false,
            Some(Tile::Pane(pane)) if panes.contains(pane) => return false,
            Some(Tile::Pane(pane)) => panes.push(*pane),
            Some(Tile::Container(container)) => waiting.extend(container.children().copied()),
        }
    }
    true
}

/// Adds a closed panel to the largest group of tabs; without a group, as the only one.
fn restore_pane(tree: &mut Tree<Pane>, pane: Pane) {
    let tile = tree.tiles.insert_pane(pane);
    let group = largest_group(tree);
    match group.and_then(|id| tree.tiles.get_mut(id)) {
        Some(Tile::Container(container)) => container.add_child(tile),
        _ => tree.root = Some(tree.tiles.insert_tab_tile(vec![tile])),
    }
}

/// The group of tabs with the most panels, other than that of the left image if there is another.
fn largest_group(tree: &Tree<Pane>) -> Option<TileId> {
    let left = tree.tiles.find_pane(&Pane::Left);
    let groups = tree.tiles.iter().filter_map(|(id, tile)| match tile {
        Tile::Container(Container::Tabs(tabs)) => Some((*id, tabs)),
        _ => None,
    });
    let best = groups.max_by_key(|(id, tabs)| {
        let has_left = left.is_some_and(|left| tabs.children.contains(&left));
        (!has_left, tabs.children.len(), std::cmp::Reverse(id.0))
    });
    best.map(|(id, _)| id)
}

impl Panels<'_> {
    /// Shows one panel in the whole page.
    fn show_alone(&mut self, ui: &mut Ui, pane: Pane) {
        ui.horizontal(|ui| {
            ui.label(theme::title(pane.title()));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                self.menu(ui, Some(pane));
                crate::panels::sheets::of_panel::switch(ui, self.state, pane, self.out);
                if ui.button("Restore (`)").clicked() {
                    self.out.push(crate::command::Command::Layout(LayoutCommand::Maximise(None)));
                }
            });
        });
        self.seen.push(pane);
        self.framed(ui, pane, |panels, ui| {
            let shown = show_pane(ui, pane, panels.state, panels.out);
            panels.left_image = shown.or(panels.left_image.take());
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stored_arrangement_is_restored() {
        let mut workspace = Workspace::default();
        workspace.apply(LayoutCommand::Use(Preset::Stereo));
        workspace.apply(LayoutCommand::Close(Pane::Gates));
        let again = Workspace::restored(Some(&workspace.to_stored()));
        assert_eq!(again.preset(), Preset::Stereo);
        assert!(again.closed().contains(&Pane::Gates) && !again.closed().contains(&Pane::Right));
        assert!(again.tree == workspace.tree);
    }

    #[test]
    fn an_unusable_stored_layout_gives_the_overview() {
        let stored = Workspace::default().to_stored();
        for text in [
            "",
            "{}",
            "[1, 2",
            &stored.replace("\"format\":2", "\"format\":9"),
            &stored.replace("\"gates\"", "\"no such panel\""),
            // The same panel twice.
            &stored.replace("\"gates\"", "\"left\""),
        ] {
            let restored = Workspace::restored(Some(text));
            assert!(restored.closed().is_empty(), "{text}");
            assert_eq!(restored.preset(), Preset::Overview);
        }
    }

    #[test]
    fn a_window_that_becomes_narrow_has_in_front_what_was_shown_last() {
        let mut workspace = Workspace::default();
        let has_in_front = |workspace: &Workspace, pane: Pane| {
            let tree = &workspace.narrow;
            let shown = tree.active_tiles().into_iter().filter_map(|id| tree.tiles.get_pane(&id));
            shown.copied().any(|shown| shown == pane)
        };
        workspace.apply(LayoutCommand::Show(Pane::Why));
        assert!(has_in_front(&workspace, Pane::Why) && has_in_front(&workspace, Pane::Left));
        for preset in Preset::ALL {
            workspace.apply(LayoutCommand::Use(preset));
            assert!(has_in_front(&workspace, preset.lead()), "{preset:?}");
        }
    }

    #[test]
    fn a_closed_panel_comes_back_to_the_front() {
        let mut workspace = Workspace::default();
        for pane in Pane::ALL {
            workspace.apply(LayoutCommand::Close(pane));
        }
        assert_eq!(workspace.closed().len(), Pane::ALL.len());
        workspace.apply(LayoutCommand::Show(Pane::Map));
        workspace.apply(LayoutCommand::Show(Pane::Gates));
        assert_eq!(workspace.closed().len(), Pane::ALL.len() - 2);
        let active = workspace.tree.active_tiles();
        let gates = workspace.tree.tiles.find_pane(&Pane::Gates).unwrap();
        assert!(active.contains(&gates));
    }

    /// The workspace on a page with several panels side by side, in the order of Q.
    fn page() -> egui_kittest::Harness<'static, Workspace> {
        let state = crate::tests::fixture::nothing();
        let mut harness = egui_kittest::Harness::builder().with_size([1280.0, 720.0]).build_ui_state(
            move |ui, workspace: &mut Workspace| {
                let mut out = Vec::new();
                workspace.show(ui, &mut Panels::new(&state, &mut out));
            },
            Workspace::default(),
        );
        harness.run_steps(3);
        harness
    }

    #[test]
    fn every_press_of_q_goes_one_panel_on() {
        let mut harness = page();
        let seen = harness.state().seen.clone();
        assert!(seen.len() > 2, "{seen:?}");
        for expected in &seen {
            harness.state_mut().apply(LayoutCommand::Panel(1));
            harness.run_steps(3);
            assert_eq!(harness.state().current, Some(*expected));
        }
    }

    #[test]
    fn every_press_of_shift_q_goes_one_panel_back() {
        let mut harness = page();
        let seen = harness.state().seen.clone();
        for expected in seen.iter().rev().chain(seen.last()) {
            harness.state_mut().apply(LayoutCommand::Panel(-1));
            harness.run_steps(3);
            assert_eq!(harness.state().current, Some(*expected));
        }
    }

    #[test]
    fn arrows_and_enter_stay_the_pages_while_a_whole_panel_has_the_keyboard() {
        let mut harness = page();
        harness.state_mut().apply(LayoutCommand::Panel(1));
        harness.run_steps(3);
        let focused = harness.ctx.memory(egui::Memory::focused).expect("a panel has the keyboard");
        assert!(crate::layout::is_panel(&harness.ctx, focused));
        harness.key_press(egui::Key::ArrowRight);
        harness.run_steps(3);
        let after = harness.ctx.memory(egui::Memory::focused);
        assert_eq!(after, Some(focused), "an arrow took the keyboard to a control");
        harness.key_press(egui::Key::Tab);
        harness.run_steps(3);
        let after = harness.ctx.memory(egui::Memory::focused).expect("Tab goes on in the panel");
        assert!(after != focused && !crate::layout::is_panel(&harness.ctx, after));
    }

    #[test]
    fn the_panel_that_was_clicked_fills_the_page() {
        let mut harness = page();
        harness.state_mut().apply(LayoutCommand::Panel(1));
        harness.run_steps(3);
        let focused = harness.state().current;
        harness.hover_at(egui::pos2(1200.0, 600.0));
        harness.run_steps(2);
        harness.drag_at(egui::pos2(1200.0, 600.0));
        harness.run_steps(2);
        harness.drop_at(egui::pos2(1200.0, 600.0));
        harness.run_steps(2);
        let clicked = harness.state().current;
        assert_ne!(clicked, focused);
        harness.state_mut().apply(LayoutCommand::Maximise(None));
        assert_eq!(harness.state().maximised, clicked);
    }

    #[test]
    fn the_keyboard_goes_round_the_panels_that_are_seen() {
        let mut workspace =
            Workspace { seen: vec![Pane::Left, Pane::Map, Pane::Gates], ..Workspace::default() };
        let mut step = |by| {
            workspace.apply(LayoutCommand::Panel(by));
            workspace.current
        };
        assert_eq!(step(1), Some(Pane::Left));
        assert_eq!(step(1), Some(Pane::Map));
        assert_eq!(step(-1), Some(Pane::Left));
        assert_eq!(step(-1), Some(Pane::Gates));
    }
}
