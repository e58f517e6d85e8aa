//! Figures for papers: letters, descriptions, legends, sizes and the resolution of PNG files.

use egui::epaint::TextShape;
use egui::{Color32, Rect, pos2, vec2};

use crate::cache::{ImageSide, Item};
use crate::command::Layer;
use crate::drawing::raster::Raster;
use crate::figure::request::{FigureFormat, FigureRequest};
use crate::figure::{Figure, Ink, Piece, Words, bitmap, save, words};
use crate::hovered::Hovered;
use crate::panels::pane::Pane;
use crate::state::State;
use crate::tests::fixture::{self, PIXEL};
use crate::theme;

/// A context with the fonts of the page.
fn context() -> egui::Context {
    let context = egui::Context::default();
    theme::apply(&context, theme::ColourTheme::Dark);
    context.run_ui(egui::RawInput::default(), |_| {}).textures_delta.clear();
    context
}

/// A text at 11 points in the page's layout.
fn laid_out(context: &egui::Context, text: &str) -> TextShape {
    let galley =
        context.fonts_mut(|fonts| fonts.layout_no_wrap(text.to_owned(), theme::image_font(), theme::text()));
    TextShape::new(pos2(4.0, 4.0), galley, theme::text())
}

/// The words of a text on one line.
fn words_of(context: &egui::Context, text: &str) -> Words {
    let inks = words::inks(&laid_out(context, text));
    let [Ink::Words(words)] = &inks[..] else { panic!("one run of letters: {inks:?}") };
    words.clone()
}

/// A figure of a text, or an empty one.
fn figure_of(words: Option<Words>) -> Figure {
    let size = vec2(180.0, 22.0);
    let clip = Rect::from_min_size(pos2(0.0, 0.0), size);
    Figure {
        size,
        title: String::new(),
        description: String::new(),
        ground: theme::panel(),
        pieces: words.map(|words| Piece { clip, ink: Ink::Words(words) }).into_iter().collect(),
        left_out: 0,
    }
}

/// The grey values of a text at four times its size.
fn painted(context: &egui::Context, name: &str, words: Words) -> image::GrayImage {
    let png = bitmap::png(&figure_of(Some(words)), 4, &save::fonts(context)).unwrap();
    super::figures::keep(name, &png);
    image::load_from_memory(&png).unwrap().to_luma8()
}

/// The file of a panel that is visible in `place`.
fn file(state: &State, pane: Pane, place: Rect, kind: FigureFormat) -> save::File {
    let file = save::take(&context(), state, &[(pane, place)], FigureRequest { pane, kind }).unwrap();
    super::figures::keep(&file.name, &file.bytes);
    file
}

fn svg(state: &State, pane: Pane) -> String {
    let place = Rect::from_min_size(pos2(0.0, 0.0), vec2(500.0, 300.0));
    String::from_utf8(file(state, pane, place, FigureFormat::Svg).bytes).unwrap()
}

/// The drive at step 2 with a left image four times as wide as high.
fn with_wide_image(context: &egui::Context) -> State {
    let mut state = fixture::at_step(context, 2);
    let image = sightline_vision::image::GrayImage::from_fn(640, 160, |x, y| {
        image::Luma([if (x / 8 + y / 8) % 2 == 0 { 0.3 } else { 0.6 }])
    });
    let bytes = sightline_vision::image::io::encode_png_u8(&image).unwrap();
    let raster = Raster::from_png(context, "left", &bytes).unwrap();
    let key = state.image_key(2, ImageSide::Left).unwrap();
    state.cache.store(key, Ok(Item::Raster(std::sync::Arc::new(raster))), 0.0);
    state
}

#[test]
fn letters_of_a_ligature_are_drawn_one_after_the_other() {
    let context = context();
    let text = "off (site), different, ffi, fin";
    let joined = words_of(&context, text);
    assert_eq!(joined.places[2], None, "the page paints “ff” as one glyph");
    // A zero-width non-joiner between the letters keeps the shaper from making ligatures.
    let apart = words_of(&context, &text.replace("ff", "f\u{200c}f").replace("fi", "f\u{200c}i"));
    let letters = apart.text.chars().zip(&apart.places).filter(|(letter, _)| *letter != '\u{200c}');
    let (text, places) = letters.unzip();
    let apart = Words { text, places, ..apart };
    let joined = painted(&context, "joined.png", joined);
    let apart = painted(&context, "apart.png", apart);
    let off: f64 = joined.as_raw().iter().zip(apart.as_raw()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum();
    let mean = off / joined.as_raw().len() as f64;
    assert!(mean < 1.5, "{mean:.2} of 255 off");
}

#[test]
fn letters_keep_their_exact_advance() {
    let places: Vec<f32> = words_of(&context(), "nnnnnnnnnnnn").places.into_iter().flatten().collect();
    let steps: Vec<f32> = places.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let uneven = steps.iter().map(|step| (step - steps[0]).abs()).fold(0.0, f32::max);
    assert!(steps.len() == 11 && uneven < 1e-3, "{steps:?}");
}

#[test]
fn the_description_says_false_tracking() {
    let mut state = fixture::at_step(&context(), 2);
    state.session.as_mut().unwrap().targets[0].runs[0].rows[2].tracked = Some(false);
    let text = svg(&state, Pane::Left);
    assert!(text.contains("Session s1. Tracking state: FALSE TRACKING.</desc>"), "{text}");
}

#[test]
fn the_legend_of_an_image_has_the_colours_of_its_marks() {
    for pane in [Pane::Left, Pane::Right] {
        let mut state = fixture::at_step(&context(), 2);
        let text = svg(&state, pane);
        theme::choose(theme::ColourTheme::Light);
        let light = hex(theme::search());
        theme::choose(theme::ColourTheme::Dark);
        assert!(text.contains(&hex(theme::search())) && !text.contains(&light), "{pane:?}: {light}");
        let word = if pane == Pane::Left { "search window" } else { "epipolar curve, range in m" };
        assert!(text.contains(&format!(">{word}</text>")), "{pane:?}");
        assert!(!text.contains(">legend</text>"), "{pane:?}: a control");
        state.hidden.extend([Layer::SearchWindow, Layer::Curve]);
        assert!(!svg(&state, pane).contains(word), "{pane:?}: a mark that is not painted");
    }
}

fn hex(colour: Color32) -> String {
    format!("#{:02x}{:02x}{:02x}", colour.r(), colour.g(), colour.b())
}

#[test]
fn the_figure_of_an_image_ends_with_the_image() {
    let context = context();
    let wide = with_wide_image(&context);
    let tall_panel = Rect::from_min_size(pos2(0.0, 0.0), vec2(500.0, 800.0));
    let png = file(&wide, Pane::Left, tall_panel, FigureFormat::Png(1)).bytes;
    let height = image::load_from_memory(&png).unwrap().height();
    // The image is 712 × 178 points; then the legend, and at most 24 points on either side for marks.
    assert!((178..270).contains(&height), "{height}");
    assert!(!svg(&wide, Pane::Left).contains(">×"), "the magnification on the screen");
    let square = fixture::at_step(&context, 2);
    let png = file(&square, Pane::Right, tall_panel, FigureFormat::Png(1)).bytes;
    let height = image::load_from_memory(&png).unwrap().height();
    assert!((712..800).contains(&height), "{height}");
}

#[test]
fn an_image_panel_without_an_image_is_as_high_as_its_sentence() {
    let state = fixture::without_target();
    let panel = Rect::from_min_size(pos2(0.0, 0.0), vec2(500.0, 300.0));
    let png = file(&state, Pane::Left, panel, FigureFormat::Png(1)).bytes;
    assert!(image::load_from_memory(&png).unwrap().height() < 300);
}

#[test]
fn the_strip_has_room_for_the_pointed_patch_only_while_pointed() {
    let mut state = fixture::at_step(&context(), 2);
    assert!(!svg(&state, Pane::Strip).contains("at the pointer"));
    state.hovered = Some(Hovered::Left(PIXEL));
    assert!(svg(&state, Pane::Strip).contains("at the pointer"));
}

#[test]
fn the_legend_of_plots_names_the_current_step_with_filled_marks() {
    let text = svg(&fixture::at_step(&context(), 2), Pane::Plots);
    assert!(text.contains(">step 2</text>"), "{text}");
    let hollow = text.lines().filter(|line| line.starts_with("<circle") && line.contains("fill=\"none\""));
    assert_eq!(hollow.count(), 0, "plotted points are filled");
}

#[test]
fn a_png_stores_its_resolution() {
    let png = |scale| bitmap::png(&figure_of(None), scale, &egui::FontDefinitions::default()).unwrap();
    // 72 dpi is 2835 pixels per metre; the last four bytes are the chunk's checksum.
    let at_one = b"\0\0\0\x09pHYs\0\0\x0b\x13\0\0\x0b\x13\x01\0\x9a\x9c\x18";
    assert_eq!(&png(1)[33..54], at_one);
    assert_eq!(&png(2)[41..45], 5669_u32.to_be_bytes(), "144 dpi");
    assert_eq!(image::load_from_memory(&png(2)).unwrap().width(), 360);
}
