//! The figure of a panel as a file: as on the screen, or rendered separately if the panel is not visible or the figure is
//! for a paper; optionally with a caption above it. Its file name has the same information.

use egui::epaint::{ClippedShape, TextShape};
use egui::{Context, FontDefinitions, Frame, LayerId, Margin, RawInput, Rect, Stroke, Vec2, pos2, vec2};

use crate::command::Zoomable;
use crate::drawing::view2d::View2d;
use crate::figure::request::{FigureFormat, FigurePage, FigureRequest};
use crate::figure::{Figure, Form, Ink, Piece, bitmap, shapes, svg, words};
use crate::layout::show_pane;
use crate::panels::bars::state_word;
use crate::panels::pane::Pane;
use crate::state::{State, run_letter};
use crate::theme::{self, ColourTheme};

/// Size of the figure of a panel that is not visible, points.
const APART: Vec2 = vec2(720.0, 480.0);
/// Height at which a panel shows all of a list, points.
const TALL: f32 = 3000.0;
/// Frames painted of an off-screen panel: the first ones only measure.
const FRAMES: usize = 3;
/// Maximum ratio of height to width of a figure.
const ASPECT_MAX: f32 = 1.5;
/// Maximum space above and below an image for marks that extend beyond it, points.
const MARK_ROOM: f32 = 24.0;
/// Space around the text of the caption, points.
const ROOM: f32 = 5.0;

/// A figure as a file.
#[derive(Clone, Debug)]
pub(crate) struct File {
    /// The file name.
    pub name: String,
    /// The media type.
    pub media_type: &'static str,
    /// The contents.
    pub bytes: Vec<u8>,
    /// The message to the user.
    pub sentence: String,
}

/// Creates the file; `places` are the visible panels with their rectangles, points.
///
/// # Errors
/// A sentence if it would be too large.
pub(crate) fn take(
    context: &Context,
    state: &State,
    places: &[(Pane, Rect)],
    request: FigureRequest,
) -> Result<File, String> {
    let scale = if let FigureFormat::Png(scale) = request.kind { scale } else { 1 };
    let place = places.iter().find(|(pane, _)| *pane == request.pane).map(|(_, place)| *place);
    let figure = match (state.exports.sheet, place) {
        (FigurePage::Screen, Some(place)) => of_layer(context, state, place, f32::from(scale)),
        (FigurePage::Screen, None) => apart(state, request.pane, f32::from(scale), APART),
        (FigurePage::Paper(width), place) => {
            on_paper(state, request.pane, f32::from(scale), f32::from(width), place)
        }
    };
    let figure = named(context, state, request.pane, figure);
    let fonts = fonts(context);
    let (bytes, size, media_type) = match request.kind {
        FigureFormat::Svg => {
            let size = format!("{:.0} × {:.0} points", figure.size.x, figure.size.y);
            (svg::text(&figure)?.into_bytes(), size, "image/svg+xml")
        }
        FigureFormat::Png(scale) => {
            let [width, height] = bitmap::size_px(&figure, scale)?;
            (bitmap::png(&figure, scale, &fonts)?, format!("{width} × {height} px"), "image/png")
        }
    };
    let name = file_name(state, request);
    let mut sentence = format!("Saved {name}: {size}, {} kB.", bytes.len().div_ceil(1000));
    if place.is_none() {
        sentence += &format!(
            " {} is not on the screen: it was drawn separately, with the loaded data.",
            request.pane.title()
        );
    }
    if figure.left_out > 0 {
        sentence += &format!(" {} shapes could not be taken over.", figure.left_out);
    }
    Ok(File { name, media_type, bytes, sentence })
}

/// The font definitions of the page.
pub(crate) fn fonts(context: &Context) -> FontDefinitions {
    context.fonts(|fonts| fonts.definitions().clone())
}

/// The shapes inside a rectangle of the panels' layer.
pub(crate) fn of_layer(context: &Context, state: &State, place: Rect, scale: f32) -> Figure {
    let painted: Vec<ClippedShape> = context.graphics(|layers| {
        layers
            .get(LayerId::background())
            .map(|list| list.all_entries().cloned().collect())
            .unwrap_or_default()
    });
    shapes::figure(&painted, place, scale, &|id| state.pixels_of(id))
}

/// A panel for a paper: white, without controls, `width` points wide, and high enough for a whole list or image.
fn on_paper(state: &State, pane: Pane, scale: f32, width: f32, place: Option<Rect>) -> Figure {
    let colour_theme = theme::colour_theme();
    super::ON_PAPER.set(true);
    theme::choose(ColourTheme::Light);
    let aspect = place.map_or(APART.y / APART.x, |place| place.height() / place.width().max(1.0));
    let height = (width * aspect.clamp(0.3, ASPECT_MAX)).round();
    let view = match pane {
        Pane::Left => Some(state.view(Zoomable::Left)),
        Pane::Right => Some(state.view(Zoomable::Right)),
        _ => None,
    };
    let figure = match view {
        Some(View2d::Fit) => of_image(state, pane, scale, vec2(width, (width * ASPECT_MAX).round())),
        Some(View2d::At { .. }) => of_image(state, pane, scale, vec2(width, height)),
        None => {
            let tall = apart(state, pane, scale, vec2(width, TALL));
            match end_of_list(&tall) {
                Some(end) => Figure { size: vec2(width, end), ..tall },
                None => apart(state, pane, scale, vec2(width, height)),
            }
        }
    };
    super::ON_PAPER.set(false);
    theme::choose(colour_theme);
    figure
}

/// An image panel with the height of its image: rendered once to measure the image, then without blank bands.
fn of_image(state: &State, pane: Pane, scale: f32, size: Vec2) -> Figure {
    let measured = apart(state, pane, scale, size);
    let Some((canvas, blank)) = canvas_of(&measured) else {
        // There is no image: the panel shows the reason.
        let height = end_of_list(&measured).unwrap_or(size.y);
        return Figure { size: vec2(size.x, height), ..measured };
    };
    let below = measured.size.y - canvas.bottom();
    let figure = apart(state, pane, scale, size - vec2(0.0, blank.floor()));
    let height = figure.size.y - below + f32::from(theme::MARGIN);
    Figure { size: vec2(size.x, height.min(figure.size.y).round()), ..figure }
}

/// The area of an image, and the part of its height that neither the image nor its marks use, points.
fn canvas_of(figure: &Figure) -> Option<(Rect, f32)> {
    let is_picture = |piece: &Piece| matches!(piece.ink, Ink::Picture { .. });
    let first = figure.pieces.iter().position(is_picture)?;
    let (canvas, image) = (figure.pieces[first].clip, figure.pieces[first].ink.bounds());
    let middle = canvas.center().y;
    let reach = |bounds: Rect| {
        let seen = bounds.intersect(canvas);
        (seen.bottom() - middle).max(middle - seen.top())
    };
    let over_image = figure.pieces[first..].iter().filter(|piece| piece.clip == canvas);
    let bounds = over_image.map(|piece| piece.ink.bounds()).filter(|bounds| bounds.intersects(image));
    let used = bounds.map(reach).fold(0.0, f32::max).min(reach(image) + MARK_ROOM);
    Some((canvas, (canvas.height() - 2.0 * used).max(0.0)))
}

/// The lower end of a tall figure's contents; `None` for a panel that fills any height, such as a plot or an image.
fn end_of_list(tall: &Figure) -> Option<f32> {
    let all = Rect::from_min_size(pos2(0.0, 0.0), tall.size);
    let seen = tall.pieces.iter().map(|piece| piece.ink.bounds().intersect(piece.clip).intersect(all));
    // The background is not part of the contents.
    let contents = seen.filter(|bounds| bounds.is_positive() && bounds.height() < 0.9 * tall.size.y);
    let end = contents.map(|bounds| bounds.bottom()).fold(0.0, f32::max);
    (end > 0.0 && end < 0.9 * tall.size.y).then(|| (end + f32::from(theme::MARGIN)).ceil())
}

/// Paints a panel off-screen.
fn apart(state: &State, pane: Pane, scale: f32, size: Vec2) -> Figure {
    let context = Context::default();
    theme::apply(&context, theme::colour_theme());
    let screen = Rect::from_min_size(pos2(0.0, 0.0), size);
    let paper = if super::is_on_paper() { theme::well() } else { theme::panel() };
    let mut painted = Vec::new();
    for _ in 0..FRAMES {
        let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
        let mut output = context.run_ui(input, |ui| {
            let ground = Frame::new().fill(paper).inner_margin(Margin::same(theme::MARGIN));
            ground.show(ui, |ui| {
                // Its commands are discarded.
                show_pane(ui, pane, state, &mut Vec::new());
                ui.take_available_space();
            });
        });
        output.textures_delta.clear();
        painted = output.shapes;
    }
    Figure { ground: paper, ..shapes::figure(&painted, screen, scale, &|id| state.pixels_of(id)) }
}

/// Adds title and description to the figure, and the caption if enabled.
fn named(context: &Context, state: &State, pane: Pane, mut figure: Figure) -> Figure {
    let of = place_words(state);
    figure.title = if of.is_empty() { pane.title().to_owned() } else { format!("{}: {of}", pane.title()) };
    let session =
        state.session.as_ref().map(|session| format!(" Session {}.", session.id)).unwrap_or_default();
    let word = state.row().map(|row| state_word(state.tracking().unwrap_or_default(), row).0);
    let tracking = word.map(|word| format!(" Tracking state: {word}.")).unwrap_or_default();
    figure.description = format!("The panel “{}” of Sightline.{session}{tracking}", pane.title());
    if state.exports.burns_in {
        let words = figure.title.clone();
        figure = under_a_line(context, figure, words);
    }
    figure
}

/// Drive, target, run and step, for the title.
pub(crate) fn place_words(state: &State) -> String {
    let Some(traverse) = &state.traverse else { return String::new() };
    let run = state.target().map(|target| format!(", {} run {}", target.label, run_letter(state.cursor.run)));
    let last = state.stop_count().saturating_sub(1);
    format!("{}{}, step {} of {last}", traverse.name, run.unwrap_or_default(), state.cursor.step)
}

/// Puts a caption above a figure.
fn under_a_line(context: &Context, figure: Figure, words: String) -> Figure {
    let width = (figure.size.x - 2.0 * ROOM).max(40.0);
    let (font, colour) = (theme::image_font(), theme::text());
    let galley = context.fonts_mut(|fonts| fonts.layout(words, font, colour, width));
    let height = (galley.size().y + 2.0 * ROOM).round();
    let line = Rect::from_min_size(pos2(0.0, 0.0), vec2(figure.size.x, height));
    let ground = Ink::Area { form: Form::Rect(line, [0.0; 4]), fill: theme::bar(), stroke: Stroke::NONE };
    let text = TextShape::new(pos2(ROOM, ROOM), galley, colour);
    let above = std::iter::once(ground).chain(words::inks(&text)).map(|ink| Piece { clip: line, ink });
    let down = vec2(0.0, height);
    let moved = |piece: Piece| Piece { clip: piece.clip.translate(down), ink: piece.ink.moved(down) };
    let pieces = above.chain(figure.pieces.into_iter().map(moved)).collect();
    Figure { size: figure.size + down, pieces, ..figure }
}

/// The file name: session, target, run, step, panel, and the scale of a PNG.
pub(crate) fn file_name(state: &State, request: FigureRequest) -> String {
    let mut parts = vec!["sightline".to_owned()];
    parts.extend(state.session.as_ref().map(|session| session.id.clone()));
    if let Some(target) = state.cursor.target {
        parts.extend(state.label_of(target));
        parts.push(format!("run-{}", run_letter(state.cursor.run)));
    }
    if state.session.is_some() {
        parts.push(format!("step-{}", state.cursor.step));
    }
    parts.push(request.pane.title().to_owned());
    let ending = match request.kind {
        FigureFormat::Svg => ".svg".to_owned(),
        FigureFormat::Png(scale) => format!("-{scale}x.png"),
    };
    let name = parts.join("-").to_lowercase();
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let words: Vec<&str> = plain.split('-').filter(|word| !word.is_empty()).collect();
    words.join("-") + &ending
}
