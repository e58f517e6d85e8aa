//! Layout of a small window: the plots and the patches of every preset, and the words beside buttons.

use std::cell::RefCell;
use std::rc::Rc;

use egui::{Pos2, Rect, Shape};
use egui_kittest::kittest::Queryable;

use crate::layout::Panels;
use crate::layout::command::LayoutCommand;
use crate::layout::presets::Preset;
use crate::layout::workspace::Workspace;
use crate::panels::pane::Pane;
use crate::panels::timeline;
use crate::tests::{Shown, fixture};

/// Margin of the harness around the page, points.
const MARGIN: f32 = 8.0;

/// The panels of a preset in a window of this size, and the rectangle of each panel.
fn page([width, height]: [f32; 2], preset: Preset) -> (Shown<'static>, Vec<(Pane, Rect)>) {
    let mut workspace = Workspace::default();
    workspace.apply(LayoutCommand::Use(preset));
    let workspace = RefCell::new(workspace);
    let places = Rc::new(RefCell::new(Vec::new()));
    let kept = Rc::clone(&places);
    // Top bar, stages, and the timeline with the buttons above it.
    let bars = 32.0 + 28.0 + timeline::height(&fixture::at_step(&egui::Context::default(), 2)) + 33.0;
    let shown = Shown::new(
        [width + 2.0 * MARGIN, height - bars + 2.0 * MARGIN],
        |context| fixture::at_step(context, 2),
        move |ui, state, out| {
            let mut panels = Panels::new(state, out);
            workspace.borrow_mut().show(ui, &mut panels);
            *kept.borrow_mut() = panels.places;
        },
    );
    (shown, places.take())
}

/// The rectangle of a panel, if the preset has it in front.
fn place(places: &[(Pane, Rect)], pane: Pane) -> Option<Rect> {
    places.iter().find(|(other, _)| *other == pane).map(|(_, place)| *place)
}

/// The painted texts of a panel with their rectangles.
fn texts(shown: &Shown<'_>, panel: Rect) -> Vec<(String, Rect)> {
    let shapes = shown.harness.output().shapes.iter();
    let of_panel = shapes.filter(|clipped| panel.expand(1.0).contains_rect(clipped.clip_rect));
    let text = |clipped: &egui::epaint::ClippedShape| match &clipped.shape {
        Shape::Text(text) => Some((text.galley.text().to_owned(), clipped.shape.visual_bounding_rect())),
        _ => None,
    };
    of_panel.filter_map(text).collect()
}

#[test]
fn every_plot_fits_its_panel_and_has_numbered_axes() {
    let mut count = 0;
    for preset in Preset::ALL {
        let (shown, places) = page([1280.0, 720.0], preset);
        let Some(panel) = place(&places, Pane::Plots) else { continue };
        count += 1;
        let texts = texts(&shown, panel);
        for (words, rect) in &texts {
            assert!(rect.bottom() <= panel.bottom(), "{preset:?}: {words} at {rect:?} leaves {panel:?}");
        }
        let numbers = |is_meant: &dyn Fn(Pos2) -> bool| {
            let is_number = |words: &str| words.parse::<f64>().is_ok();
            texts.iter().filter(|(words, rect)| is_number(words) && is_meant(rect.center())).count()
        };
        // Scores, pixel error and position error have three numbers each; the lowest plot has the steps.
        let on_y = numbers(&|at| at.x < panel.left() + 48.0 && at.y < panel.bottom() - 16.0);
        let on_x = numbers(&|at| at.x > panel.left() + 48.0 && at.y > panel.bottom() - 30.0);
        assert!(on_y >= 9 && on_x >= 3, "{preset:?}, {panel:?}: {on_y} and {on_x} numbers in {texts:?}");
    }
    assert!(count >= 3, "few arrangements have plots in front");
}

#[test]
fn every_patch_of_the_strip_is_inside_its_panel() {
    let patches = crate::panels::strip::patches(&fixture::trace(2)).into_iter();
    let names: Vec<String> = patches.map(|patch| format!("{} patch", patch.title)).collect();
    for (window, least) in [([1280.0, 720.0], 40.0), ([1024.0, 768.0], 40.0), ([1440.0, 900.0], 56.0)] {
        let mut count = 0;
        for preset in Preset::ALL {
            let (shown, places) = page(window, preset);
            let Some(panel) = place(&places, Pane::Strip) else { continue };
            count += 1;
            let hovered = shown.harness.get_by_label_contains("at the pointer").rect();
            let rects = names.iter().map(|name| shown.harness.get_by_label(name).rect());
            let rects: Vec<Rect> = rects.chain([hovered]).collect();
            for (number, rect) in rects.iter().enumerate() {
                let at = format!("{preset:?} in {window:?}: patch {number} at {rect:?}");
                assert!(panel.contains_rect(*rect), "{at} leaves {panel:?}");
                assert!(rect.width() >= least, "{at} is small");
                assert!(rects[number + 1..].iter().all(|other| !other.intersects(*rect)), "{at} is covered");
            }
        }
        assert!(count >= 3, "few arrangements have the strip in front");
    }
}
