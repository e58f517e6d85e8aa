//! A figure as an SVG file (SVG 1.1): self-contained, with text as text.
//!
//! Text has its length (`textLength`), so that it has the same extent as on the screen with any font. Images are embedded
//! as PNG; magnified ones are shown without interpolation.

use std::collections::HashMap;
use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use egui::{Color32, FontFamily, Pos2, Rect, Stroke};

use crate::figure::{Figure, Form, Ink, Words};

/// Font families, with substitutes for the page's own.
const PROPORTIONAL: &str = "Ubuntu, 'Ubuntu Light', 'DejaVu Sans', Verdana, sans-serif";
const MONOSPACE: &str = "Hack, 'DejaVu Sans Mono', Menlo, Consolas, monospace";

/// The text of the file.
///
/// # Errors
/// A sentence if an image cannot be encoded.
pub(crate) fn text(figure: &Figure) -> Result<String, String> {
    let [width, height] = [figure.size.x, figure.size.y].map(number);
    let mut body = String::new();
    let mut clips: HashMap<[u32; 4], usize> = HashMap::new();
    let mut open: Option<Rect> = None;
    for piece in &figure.pieces {
        if open != Some(piece.clip) {
            if open.is_some() {
                body.push_str("</g>\n");
            }
            let Rect { min, max } = piece.clip;
            let next = clips.len();
            let clip = *clips.entry([min.x, min.y, max.x, max.y].map(f32::to_bits)).or_insert(next);
            line(&mut body, format_args!("<g clip-path=\"url(#clip{clip})\">"));
            open = Some(piece.clip);
        }
        ink(&mut body, &piece.ink)?;
    }
    if open.is_some() {
        body.push_str("</g>\n");
    }
    let mut clips: Vec<([u32; 4], usize)> = clips.into_iter().collect();
    clips.sort_unstable_by_key(|(_, number)| *number);
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    line(
        &mut text,
        format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" version=\"1.1\" \
         width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\" \
         aria-labelledby=\"title desc\">"
        ),
    );
    line(&mut text, format_args!("<title id=\"title\">{}</title>", escaped(&figure.title)));
    line(&mut text, format_args!("<desc id=\"desc\">{}</desc>", escaped(&figure.description)));
    text.push_str("<defs>\n");
    for (corners, clip) in clips {
        let [x0, y0, x1, y1] = corners.map(f32::from_bits);
        line(
            &mut text,
            format_args!(
                "<clipPath id=\"clip{clip}\"><rect {}/></clipPath>",
                box_of(x0, y0, x1 - x0, y1 - y0)
            ),
        );
    }
    text.push_str("</defs>\n");
    line(
        &mut text,
        format_args!("<rect width=\"{width}\" height=\"{height}\"{}/>", paint("fill", figure.ground)),
    );
    text.push_str(&body);
    text.push_str("</svg>\n");
    Ok(text)
}

fn line(text: &mut String, words: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    writeln!(text, "{words}").unwrap_or_default();
}

fn ink(body: &mut String, ink: &Ink) -> Result<(), String> {
    match ink {
        Ink::Area { form, fill, stroke } => {
            line(body, format_args!("{}{}{}/>", open(form), paint("fill", *fill), drawn(stroke)));
        }
        Ink::Words(words) => self::words(body, words),
        Ink::Picture { pixels, place } => {
            let png = STANDARD.encode(super::bitmap::png_of(pixels)?);
            let is_magnified = place.width() > pixels.size[0] as f32;
            let kept = if is_magnified { " style=\"image-rendering:pixelated\"" } else { "" };
            line(
                body,
                format_args!(
                    "<image {} preserveAspectRatio=\"none\"{kept} xlink:href=\"data:image/png;base64,{png}\"/>",
                    box_of(place.left(), place.top(), place.width(), place.height())
                ),
            );
        }
    }
    Ok(())
}

/// The start tag of a form's element, without its end.
fn open(form: &Form) -> String {
    match form {
        Form::Rect(rect, radii) if radii.iter().all(|radius| *radius == radii[0]) => {
            let round = if radii[0] > 0.0 { format!(" rx=\"{}\"", number(radii[0])) } else { String::new() };
            format!("<rect {}{round}", box_of(rect.left(), rect.top(), rect.width(), rect.height()))
        }
        Form::Rect(rect, radii) => format!("<path d=\"{}\"", rounded(*rect, *radii)),
        Form::Ellipse(middle, half, _) if half.x == half.y => {
            format!(
                "<circle cx=\"{}\" cy=\"{}\" r=\"{}\"",
                number(middle.x),
                number(middle.y),
                number(half.x)
            )
        }
        Form::Ellipse(middle, half, angle) => {
            let [x, y, rx, ry] = [middle.x, middle.y, half.x, half.y].map(number);
            let turn = number(angle.to_degrees());
            format!(
                "<ellipse cx=\"{x}\" cy=\"{y}\" rx=\"{rx}\" ry=\"{ry}\" transform=\"rotate({turn} {x} {y})\""
            )
        }
        Form::Lines(points, closed) => {
            let mut data = String::new();
            for (k, point) in points.iter().enumerate() {
                data.push_str(if k == 0 { "M" } else { "L" });
                data.push_str(&pair(*point));
            }
            let end = if *closed { "Z" } else { "" };
            format!("<path d=\"{data}{end}\"")
        }
        Form::Curve([first, one, two, last], closed) => {
            let end = if *closed { "Z" } else { "" };
            format!("<path d=\"M{}C{} {} {}{end}\"", pair(*first), pair(*one), pair(*two), pair(*last))
        }
    }
}

/// A rectangle with four different corner radii.
fn rounded(rect: Rect, [nw, ne, se, sw]: [f32; 4]) -> String {
    let corner = |x: f32, y: f32, radius: f32, to: Pos2| {
        format!("L{} {}A{r} {r} 0 0 1 {}", number(x), number(y), pair(to), r = number(radius))
    };
    let Rect { min, max } = rect;
    let first = format!("M{} {}", number(min.x + nw), number(min.y));
    [
        first,
        corner(max.x - ne, min.y, ne, Pos2::new(max.x, min.y + ne)),
        corner(max.x, max.y - se, se, Pos2::new(max.x - se, max.y)),
        corner(min.x + sw, max.y, sw, Pos2::new(min.x, max.y - sw)),
        corner(min.x, min.y + nw, nw, Pos2::new(min.x + nw, min.y)),
        "Z".to_owned(),
    ]
    .concat()
}

fn words(body: &mut String, words: &Words) {
    let family = if words.family == FontFamily::Monospace { MONOSPACE } else { PROPORTIONAL };
    let [x, y, size, width] = [words.at.x, words.at.y, words.size, words.width].map(number);
    let turn = if words.angle == 0.0 {
        String::new()
    } else {
        format!(" transform=\"rotate({} {x} {y})\"", number(words.angle.to_degrees()))
    };
    let lean = if words.is_italic { " font-style=\"italic\"" } else { "" };
    let fit = if words.is_spaced { "spacing" } else { "spacingAndGlyphs" };
    line(
        body,
        format_args!(
            "<text x=\"{x}\" y=\"{y}\" font-family=\"{family}\" font-size=\"{size}\"{lean}{} textLength=\"{width}\" \
         lengthAdjust=\"{fit}\" xml:space=\"preserve\"{turn}>{}</text>",
            paint("fill", words.colour),
            escaped(&words.text)
        ),
    );
}

fn drawn(stroke: &Stroke) -> String {
    if stroke.is_empty() {
        return String::new();
    }
    format!("{} stroke-width=\"{}\"", paint("stroke", stroke.color), number(stroke.width))
}

/// A colour as attributes: `what` is `fill` or `stroke`; with its opacity.
fn paint(what: &str, colour: Color32) -> String {
    if colour.a() == 0 {
        return format!(" {what}=\"none\"");
    }
    let [r, g, b, a] = colour.to_srgba_unmultiplied();
    let opacity = if a == u8::MAX {
        String::new()
    } else {
        format!(" {what}-opacity=\"{}\"", number(f32::from(a) / 255.0))
    };
    format!(" {what}=\"#{r:02x}{g:02x}{b:02x}\"{opacity}")
}

fn box_of(x: f32, y: f32, width: f32, height: f32) -> String {
    let [x, y, width, height] = [x, y, width, height].map(number);
    format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"")
}

fn pair(at: Pos2) -> String {
    format!("{} {}", number(at.x), number(at.y))
}

/// A number with at most three decimals.
fn number(value: f32) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Text escaped for XML; characters that XML does not allow become blanks.
fn escaped(words: &str) -> String {
    let mut text = String::with_capacity(words.len());
    for c in words.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '"' => text.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => text.push(' '),
            c if c.is_control() => text.push(' '),
            c => text.push(c),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;

    #[test]
    fn signs_of_xml_and_of_nothing_do_not_break_the_file() {
        assert_eq!(escaped("a<b & \"c\"\u{1}\u{ffff}>"), "a&lt;b &amp; &quot;c&quot;  &gt;");
        assert_eq!(number(-0.0001), "0");
        assert_eq!(number(12.340_01), "12.34");
        assert_eq!(number(100.0), "100");
    }

    #[test]
    fn corners_of_their_own_are_arcs() {
        let path = rounded(Rect::from_min_max(pos2(0.0, 0.0), pos2(10.0, 6.0)), [2.0, 0.0, 1.0, 0.0]);
        assert_eq!(path.matches('A').count(), 4);
        assert!(path.starts_with("M2 0L10 0") && path.ends_with("2 0Z"), "{path}");
    }
}
