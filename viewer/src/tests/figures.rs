//! Figures of panels: all painted content is in the file, the file is well-formed, and images are sharp at every scale.

use std::cell::RefCell;
use std::rc::Rc;

use egui::epaint::ClippedShape;
use egui::{Rect, Shape};
use egui_kittest::kittest::Queryable;

use crate::command::Command;
use crate::exports::ExportsCommand;
use crate::figure::request::{FigureFormat, FigurePage, FigureRequest};
use crate::figure::save;
use crate::figure::{Figure, Form, Ink, bitmap, shapes, svg};
use crate::layout::show_pane;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::tests::{Shown, fixture};
use crate::theme;

/// A panel as last painted, with its figure and the fonts.
struct Taken {
    shown: Shown<'static>,
    figure: Figure,
    fonts: egui::FontDefinitions,
}

fn taken(pane: Pane, scale: f32, state: impl FnOnce(&egui::Context) -> State + 'static) -> Taken {
    let last = Rc::new(RefCell::new(None));
    let kept = Rc::clone(&last);
    let shown = Shown::new([520.0, 420.0], state, move |ui, state, out| {
        let place = ui.max_rect();
        show_pane(ui, pane, state, out);
        let figure = save::of_layer(ui.ctx(), state, place, scale);
        *kept.borrow_mut() = Some((figure, save::fonts(ui.ctx())));
    });
    let (figure, fonts) = last.borrow_mut().take().unwrap();
    Taken { shown, figure, fonts }
}

fn at_two(context: &egui::Context) -> State {
    fixture::at_step(context, 2)
}

/// Writes a file to the folder `SIGHTLINE_SHOTS`, for inspection.
pub(super) fn keep(name: &str, bytes: &[u8]) {
    if let Some(folder) = std::env::var_os("SIGHTLINE_SHOTS") {
        let folder = std::path::PathBuf::from(folder);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(name), bytes).unwrap();
    }
}

/// Counts a visible shape: as text, or as another shape.
fn count(shape: &Shape, counted: &mut [usize; 2]) {
    match shape {
        Shape::Noop | Shape::Vec(_) => {}
        Shape::Text(text) => counted[0] += usize::from(!text.galley.text().trim().is_empty()),
        Shape::Mesh(mesh) => counted[1] += usize::from(!mesh.is_empty()),
        Shape::Rect(rect) => {
            counted[1] += usize::from(rect.fill.a() > 0) + usize::from(!rect.stroke.is_empty());
        }
        _ => counted[1] += 1,
    }
}

#[test]
fn every_panel_becomes_well_formed_xml_with_all_its_words() {
    for pane in Pane::ALL {
        let taken = taken(pane, 1.0, at_two);
        let text = svg::text(&taken.figure).unwrap();
        keep(&format!("{pane:?}.svg"), text.as_bytes());
        let document = roxmltree::Document::parse(&text).unwrap_or_else(|e| panic!("{pane:?}: {e}"));
        assert_eq!(taken.figure.left_out, 0, "{pane:?}");
        let root = document.root_element();
        assert_eq!(
            (root.attribute("width"), root.attribute("height")),
            (Some("504"), Some("404")),
            "{pane:?}"
        );
        let all: String = document
            .descendants()
            .filter(|node| node.has_tag_name("text"))
            .filter_map(|node| node.text())
            .collect::<Vec<_>>()
            .join("\n");
        // Everything that a screen reader finds on the panel and that is entirely on it is in the file.
        let screen = Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(512.0, 412.0));
        let mut checked = 0;
        for node in taken.shown.harness.query_all_by_role(egui::accesskit::Role::Label) {
            let (Some(value), place) = (node.value(), node.rect()) else { continue };
            let first = value.split_whitespace().next().unwrap_or_default();
            // The descriptions of the state machine's boxes have more words than are painted.
            let is_painted = value.lines().count() == 1 && pane != Pane::Machine;
            if is_painted && screen.contains_rect(place) && !first.is_empty() {
                let is_there = all.contains(first) || all.to_lowercase().contains(&first.to_lowercase());
                assert!(is_there, "{pane:?}: “{first}” is not in the file: {all}");
                checked += 1;
            }
        }
        // The strip, the state machine and the close-up paint their words; they have no labels.
        let is_painted_only = [Pane::Strip, Pane::Machine, Pane::CloseUp].contains(&pane);
        assert!(checked > 0 || is_painted_only && all.lines().count() > 2, "{pane:?} has words: {all}");
        assert!(
            !text.contains("href=\"http") && !text.contains("NaN"),
            "{pane:?}: the file needs nothing else"
        );
        let clips: Vec<&str> =
            document.descendants().filter_map(|node| node.attribute("clip-path")).collect();
        for clip in clips {
            let id = clip.trim_start_matches("url(#").trim_end_matches(')');
            assert!(document.descendants().any(|node| node.attribute("id") == Some(id)), "{pane:?}: {clip}");
        }
    }
}

#[test]
fn every_shape_that_is_painted_is_in_the_file() {
    for pane in [Pane::Gates, Pane::Plots, Pane::Map, Pane::Surface, Pane::Left, Pane::StereoProfile] {
        let taken = taken(pane, 1.0, at_two);
        let painted = &taken.shown.harness.output().shapes;
        let screen = Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(520.0, 420.0));
        let is_seen = |clipped: &&ClippedShape| {
            let seen = clipped.clip_rect.intersect(screen);
            let bounds = clipped.shape.visual_bounding_rect();
            seen.is_positive() && bounds.is_finite() && seen.intersects(bounds)
        };
        let mut counted = [0; 2];
        for clipped in painted.iter().filter(is_seen) {
            flat(&clipped.shape).into_iter().for_each(|shape| count(shape, &mut counted));
        }
        let text = svg::text(&shapes::figure(painted, screen, 1.0, &|_| None)).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let of = |names: &[&str]| {
            let groups = document.descendants().filter(|node| node.has_tag_name("g"));
            groups.flat_map(|g| g.children()).filter(|node| names.contains(&node.tag_name().name())).count()
        };
        let words = of(&["text"]);
        let others = of(&["rect", "circle", "ellipse", "path", "image"]);
        assert!(counted[0] > 3 && counted[1] > 3, "{pane:?} has {counted:?}");
        assert!(words >= counted[0], "{pane:?}: {words} texts of {}", counted[0]);
        // A mesh with an unknown texture is omitted here: at most one image per panel, and its checker.
        assert!(others + 2 >= counted[1], "{pane:?}: {others} elements of {}", counted[1]);
    }
}

fn clipped(clip_rect: Rect, shape: Shape) -> ClippedShape {
    ClippedShape { clip_rect, shape, transform_after_tessellation: egui::emath::TSTransform::IDENTITY }
}

fn flat(shape: &Shape) -> Vec<&Shape> {
    match shape {
        Shape::Vec(shapes) => shapes.iter().flat_map(flat).collect(),
        shape => vec![shape],
    }
}

#[test]
fn images_are_embedded_with_the_pixels_that_are_seen() {
    let taken = taken(Pane::Surface, 1.0, at_two);
    let pictures: Vec<_> = taken
        .figure
        .pieces
        .iter()
        .filter_map(|piece| match &piece.ink {
            Ink::Picture { pixels, place } => Some((pixels.clone(), *place)),
            _ => None,
        })
        .collect();
    assert_eq!(pictures.len(), 1, "the surface of scores");
    let (pixels, place) = &pictures[0];
    assert_eq!(pixels.size, [31, 31]);
    assert!(place.width() > 100.0, "{place:?}");
    assert_eq!(pixels.pixels[0].a(), 0, "the hole shows the checker");
    assert_eq!(pixels.pixels[15 * 31 + 15].a(), 255);
    let text = svg::text(&taken.figure).unwrap();
    assert!(text.contains("image-rendering:pixelated") && text.contains("data:image/png;base64,iVBOR"));
}

#[test]
fn a_picture_has_the_pixels_of_its_scale_and_says_the_same_at_every_scale() {
    let at = |scale: u8| {
        let taken = taken(Pane::Gates, f32::from(scale), at_two);
        let png = bitmap::png(&taken.figure, scale, &taken.fonts).unwrap();
        keep(&format!("gates-{scale}x.png"), &png);
        image::load_from_memory(&png).unwrap().to_rgb8()
    };
    let once = at(1);
    assert_eq!(once.dimensions(), (504, 404));
    for scale in 2..=4 {
        let large = at(scale);
        assert_eq!(large.dimensions(), (504 * u32::from(scale), 404 * u32::from(scale)));
        let small = image::imageops::thumbnail(&large, 504, 404);
        let off: f64 = small.as_raw().iter().zip(once.as_raw()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
        let mean = off / small.as_raw().len() as f64;
        assert!(mean < 2.5, "{scale}x is another picture: {mean:.2} of 255 off");
    }
    let colours: std::collections::HashSet<_> = once.pixels().collect();
    assert!(colours.len() > 50, "letters and marks: {} colours", colours.len());
}

#[test]
fn a_line_is_sharp_at_four_times_its_size() {
    let colour = theme::UNTINTED;
    let line =
        Shape::line_segment([egui::pos2(2.3, 5.2), egui::pos2(18.0, 5.2)], egui::Stroke::new(1.0, colour));
    let all = Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(20.0, 10.0));
    let painted = [clipped(all, line)];
    let figure = shapes::figure(&painted, all, 4.0, &|_| None);
    let png = bitmap::png(&figure, 4, &egui::FontDefinitions::default()).unwrap();
    let picture = image::load_from_memory(&png).unwrap().to_luma8();
    let column: Vec<u8> = (0..40).map(|y| picture.get_pixel(40, y).0[0]).collect();
    let ground = column[0];
    assert_eq!(column.iter().filter(|v| **v == 255).count(), 4, "four whole pixels: {column:?}");
    assert_eq!(column.iter().filter(|v| **v == ground).count(), 36, "and nothing half: {column:?}");
}

#[test]
fn forms_keep_their_place_and_form() {
    let stroke = egui::Stroke::new(2.0, theme::UNTINTED);
    let all = Rect::from_min_size(egui::pos2(100.0, 50.0), egui::vec2(200.0, 100.0));
    let shapes = [
        Shape::circle_stroke(egui::pos2(150.0, 90.0), 12.0, stroke),
        Shape::rect_stroke(
            Rect::from_min_size(egui::pos2(110.0, 60.0), egui::vec2(30.0, 20.0)),
            4.0,
            stroke,
            egui::StrokeKind::Inside,
        ),
        Shape::circle_filled(egui::pos2(900.0, 90.0), 12.0, theme::UNTINTED),
    ];
    let painted: Vec<ClippedShape> =
        shapes.into_iter().map(|shape| clipped(Rect::EVERYTHING, shape)).collect();
    let figure = shapes::figure(&painted, all, 1.0, &|_| None);
    let forms: Vec<&Form> = figure
        .pieces
        .iter()
        .filter_map(|piece| match &piece.ink {
            Ink::Area { form, .. } => Some(form),
            _ => None,
        })
        .collect();
    assert_eq!(forms.len(), 2, "what lies beside the panel is no part of it");
    assert_eq!(*forms[0], Form::Ellipse(egui::pos2(50.0, 40.0), egui::Vec2::splat(12.0), 0.0));
    let inside = Rect::from_min_size(egui::pos2(11.0, 11.0), egui::vec2(28.0, 18.0));
    assert_eq!(*forms[1], Form::Rect(inside, [3.0; 4]), "a stroke inside lies half its width inside");
}

#[test]
fn a_file_says_in_its_name_and_above_it_of_what_it_is() {
    let context = egui::Context::default();
    let mut output = context.run_ui(egui::RawInput::default(), |_| {});
    output.textures_delta.clear();
    let mut state = fixture::at_step(&context, 2);
    let request = |kind| FigureRequest { pane: Pane::Map, kind };
    let svg = save::take(&context, &state, &[], request(FigureFormat::Svg)).unwrap();
    assert_eq!(svg.name, "sightline-s1-ridge-run-a-step-2-map-site-frame.svg");
    assert!(svg.sentence.contains("not on the screen: it was drawn separately"), "{}", svg.sentence);
    let text = String::from_utf8(svg.bytes).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let word =
        |name: &str| document.descendants().find(|node| node.has_tag_name(name)).unwrap().text().unwrap();
    assert_eq!(word("title"), "Map, site frame: Six stops, ridge run A, step 2 of 5");
    assert!(word("desc").contains("Session s1. Tracking state: TRACKING."), "{}", word("desc"));
    assert_eq!(document.root_element().attribute("height"), Some("480"));

    state.perform(Command::Exports(ExportsCommand::BurnIn(true)));
    let png = save::take(&context, &state, &[], request(FigureFormat::Png(3))).unwrap();
    assert_eq!(png.name, "sightline-s1-ridge-run-a-step-2-map-site-frame-3x.png");
    let picture = image::load_from_memory(&png.bytes).unwrap();
    assert!(picture.width() == 3 * 720 && picture.height() > 3 * 480, "the line is above the panel");
    let svg = save::take(&context, &state, &[], request(FigureFormat::Svg)).unwrap();
    let text = String::from_utf8(svg.bytes).unwrap();
    assert!(text.contains(">Map, site frame: Six stops, ridge run A, step 2 of 5</text>"), "{text}");
}

#[test]
fn a_figure_for_a_paper_is_white_and_shows_no_controls_and_all_of_a_list() {
    let context = egui::Context::default();
    theme::apply(&context, theme::ColourTheme::Dark);
    let mut output = context.run_ui(egui::RawInput::default(), |_| {});
    output.textures_delta.clear();
    let mut state = fixture::at_step(&context, 2);
    let take = |state: &State, pane| {
        let file =
            save::take(&context, state, &[], FigureRequest { pane, kind: FigureFormat::Png(1) }).unwrap();
        image::load_from_memory(&file.bytes).unwrap().to_rgb8()
    };
    let svg = |state: &State| {
        let file =
            save::take(&context, state, &[], FigureRequest { pane: Pane::Plots, kind: FigureFormat::Svg })
                .unwrap();
        String::from_utf8(file.bytes).unwrap()
    };
    state.perform(Command::Exports(ExportsCommand::Sheet(FigurePage::Paper(360))));
    let plots = take(&state, Pane::Plots);
    assert_eq!((plots.width(), plots.get_pixel(1, 1).0), (360, [255, 255, 255]));
    assert!(!svg(&state).contains("plot …"), "a control");
    assert_eq!(theme::colour_theme(), theme::ColourTheme::Dark, "the page keeps its looks");
    let list = take(&state, Pane::Settings);
    assert!(list.height() > 480, "not cropped: {}", list.height());
    state.perform(Command::Exports(ExportsCommand::Sheet(FigurePage::Screen)));
    assert_ne!(take(&state, Pane::Plots).get_pixel(1, 1).0, [255, 255, 255]);
    assert!(svg(&state).contains("plot …"));
}

#[test]
fn a_picture_that_is_too_large_is_refused_with_what_would_fit() {
    let taken = taken(Pane::Gates, 1.0, at_two);
    let large = Figure { size: egui::vec2(4000.0, 2500.0), ..taken.figure };
    let refused = bitmap::png(&large, 4, &taken.fonts).unwrap_err();
    assert_eq!(
        refused,
        "The picture would have 16000 × 10000 px, more than 48 million in all: save it at 2×, or as SVG."
    );
    let huge = Figure { size: egui::vec2(40_000.0, 2500.0), ..large };
    let refused = bitmap::png(&huge, 1, &taken.fonts).unwrap_err();
    assert!(refused.ends_with("make the panel smaller, or save it as SVG."), "{refused}");
}

#[test]
fn the_menu_and_the_palette_save_every_panel() {
    let mut shown = Shown::new([520.0, 300.0], at_two, |ui, state, out| {
        crate::exports::figure_menu::entries(ui, state, Pane::Gates, out);
    });
    let request =
        |kind| vec![Command::Exports(ExportsCommand::Figure(FigureRequest { pane: Pane::Gates, kind }))];
    assert_eq!(shown.click("save Gates as SVG"), request(FigureFormat::Svg));
    assert_eq!(shown.click("save Gates as PNG 4x"), request(FigureFormat::Png(4)));
    let burn = shown.click("with a line above: panel, drive, run, step");
    assert_eq!(burn, vec![Command::Exports(ExportsCommand::BurnIn(true))]);
    let found = crate::command::actions::find(&fixture::without_target(), "save gates svg");
    assert_eq!(vec![found[0].command.clone()], request(FigureFormat::Svg));
}

#[test]
fn after_a_change_of_looks_panels_paint_what_they_would_have_painted_in_them() {
    use crate::theme::ColourTheme;
    let paint = |context: &egui::Context, state: &State, pane: Pane| {
        let screen = Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(520.0, 420.0));
        let mut shapes = Vec::new();
        for _ in 0..3 {
            let input = egui::RawInput { screen_rect: Some(screen), ..Default::default() };
            let mut output = context.run_ui(input, |ui| {
                show_pane(ui, pane, state, &mut Vec::new());
            });
            output.textures_delta.clear();
            shapes = output.shapes;
        }
        let figure = shapes::figure(&shapes, screen, 1.0, &|id| state.pixels_of(id));
        svg::text(&figure).unwrap()
    };
    for pane in Pane::ALL {
        for later in [ColourTheme::Light, ColourTheme::Contrast] {
            let context = egui::Context::default();
            theme::apply(&context, ColourTheme::Dark);
            let mut state = fixture::at_step(&context, 2);
            let dark = paint(&context, &state, pane);
            theme::apply(&context, later);
            state.colour_theme = later;
            let changed = paint(&context, &state, pane);
            let fresh = egui::Context::default();
            theme::apply(&fresh, later);
            let mut state = fixture::at_step(&fresh, 2);
            state.colour_theme = later;
            let opened = paint(&fresh, &state, pane);
            assert!(changed == opened, "{pane:?}: something kept the dark colours in {later:?}");
            assert!(changed != dark, "{pane:?}: {later:?} changes nothing");
        }
    }
    theme::apply(&egui::Context::default(), ColourTheme::Dark);
}
