//! egui's text layouts as inks: one per run of letters with the same format on one line.

use egui::epaint::TextShape;
use egui::epaint::text::{Glyph, PlacedRow, TextFormat};
use egui::{Color32, Stroke, Vec2, vec2};

use crate::figure::{Form, Ink, Words};

/// Maximum difference between a position that egui rounded to whole pixels and the exact one, points.
const ROUNDING: f32 = 1.0;

/// Consecutive letters with the same format.
struct Run<'a> {
    format: &'a TextFormat,
    /// Each letter with the x coordinate of its start in the row, points.
    letters: Vec<(Glyph, f32)>,
}

/// The inks of a text, with its underlines and backgrounds.
pub(crate) fn inks(shape: &TextShape) -> Vec<Ink> {
    let mut characters = shape.galley.job.text.char_indices().peekable();
    let mut inks = Vec::new();
    for row in &shape.galley.rows {
        let mut runs: Vec<Run<'_>> = Vec::new();
        for glyph in &row.row.glyphs {
            // An elided text ends in a character that is not in its source; it has the format of the last source
            // character.
            let at = characters.next_if(|(_, c)| *c == glyph.chr || !shape.galley.elided);
            let at = at.map_or(shape.galley.job.text.len().saturating_sub(1), |(at, _)| at);
            let sections = &shape.galley.job.sections;
            let section = sections
                .iter()
                .find(|section| (section.byte_range.start.0..section.byte_range.end.0).contains(&at));
            let Some(format) = section.or(sections.last()).map(|section| &section.format) else { continue };
            match runs.last_mut().filter(|run| run.continues(format, glyph)) {
                Some(run) => run.letters.push((*glyph, next_x(run, glyph))),
                None => runs.push(Run { format, letters: vec![(*glyph, glyph.pos.x)] }),
            }
        }
        if row.ends_with_newline {
            characters.next_if(|(_, c)| *c == '\n');
        }
        runs.iter().for_each(|run| run.ink(shape, row, &mut inks));
    }
    inks
}

/// Returns the exact start of the letter that follows a run. egui rounds it to whole screen pixels, which is visible at a
/// larger scale.
fn next_x(run: &Run<'_>, glyph: &Glyph) -> f32 {
    let Some((last, x)) = run.letters.last() else { return glyph.pos.x };
    let spacing = if is_in_ligature(glyph) { 0.0 } else { run.format.extra_letter_spacing };
    let exact = x + last.advance_width + spacing;
    // Justified rows have additional space between words.
    if (exact - glyph.pos.x).abs() <= ROUNDING { exact } else { glyph.pos.x }
}

/// Returns whether a letter is part of the glyph before it, such as the second “f” of the ligature “ff”.
fn is_in_ligature(glyph: &Glyph) -> bool {
    glyph.advance_width == 0.0 && glyph.uv_rect.is_nothing()
}

impl Run<'_> {
    /// Whether a letter continues the run: same format, same baseline.
    fn continues(&self, format: &TextFormat, glyph: &Glyph) -> bool {
        std::ptr::eq(self.format, format)
            && self.letters.last().is_some_and(|(last, _)| last.pos.y == glyph.pos.y)
    }

    fn ink(&self, shape: &TextShape, row: &PlacedRow, inks: &mut Vec<Ink>) {
        let text: String = self.letters.iter().map(|(glyph, _)| glyph.chr).collect();
        let (Some((first, _)), Some((last, last_x))) = (self.letters.first(), self.letters.last()) else {
            return;
        };
        let turn = egui::emath::Rot2::from_angle(shape.angle);
        let place = |offset: Vec2| shape.pos + turn * (row.pos.to_vec2() + offset);
        let width = last_x + last.advance_width - first.pos.x;
        let at = place(first.pos.to_vec2());
        let solid = |colour: Color32| {
            let known = if colour == Color32::PLACEHOLDER { shape.fallback_color } else { colour };
            known.gamma_multiply(shape.opacity_factor)
        };
        if self.format.background != Color32::TRANSPARENT {
            let top = first.pos.to_vec2() - vec2(0.0, first.font_ascent);
            let corners = [
                vec2(0.0, 0.0),
                vec2(width, 0.0),
                vec2(width, first.line_height),
                vec2(0.0, first.line_height),
            ];
            let outline = corners.map(|corner| place(top + corner)).to_vec();
            let fill = solid(self.format.background);
            inks.push(Ink::Area { form: Form::Lines(outline, true), fill, stroke: Stroke::NONE });
        }
        if !text.trim().is_empty() {
            inks.push(Ink::Words(Words {
                text,
                at,
                angle: shape.angle,
                places: self
                    .letters
                    .iter()
                    .map(|(glyph, x)| (!is_in_ligature(glyph)).then_some(x - first.pos.x))
                    .collect(),
                width,
                size: self.format.font_id.size,
                family: self.format.font_id.family.clone(),
                is_italic: self.format.italics,
                is_spaced: self.format.extra_letter_spacing != 0.0,
                colour: solid(shape.override_text_color.unwrap_or(self.format.color)),
            }));
        }
        for (line, height) in [
            (self.format.underline, 1.5),
            (shape.underline, 1.5),
            (self.format.strikethrough, -0.3 * first.font_ascent),
        ] {
            if !line.is_empty() {
                let ends = [0.0, width].map(|x| place(first.pos.to_vec2() + vec2(x, height))).to_vec();
                let stroke = Stroke::new(line.width, solid(line.color));
                inks.push(Ink::Area { form: Form::Lines(ends, false), fill: Color32::TRANSPARENT, stroke });
            }
        }
    }
}
