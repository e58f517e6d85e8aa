//! The outlines of letters, from the fonts of the page.

use std::collections::HashMap;

use ab_glyph::{Font, FontRef, OutlineCurve};
use egui::{FontDefinitions, FontFamily};
use tiny_skia::{Path, PathBuilder};

/// The fonts of every family, in the order in which they are searched for a letter.
pub(crate) struct Faces<'a> {
    families: HashMap<FontFamily, Vec<Face<'a>>>,
    outlines: HashMap<(FontFamily, char), Option<Path>>,
}

struct Face<'a> {
    font: FontRef<'a>,
    scale: f32,
    down: f32,
}

impl<'a> Faces<'a> {
    /// Loads the fonts of these definitions; unreadable ones are omitted.
    pub(crate) fn new(definitions: &'a FontDefinitions) -> Self {
        let face = |name: &String| {
            let data = definitions.font_data.get(name)?;
            let bytes: &[u8] = data.font.as_ref().as_ref();
            let font = FontRef::try_from_slice_and_index(bytes, data.index).ok()?;
            Some(Face { font, scale: data.tweak.scale, down: data.tweak.y_offset_factor })
        };
        let families = definitions.families.iter();
        let families = families
            .map(|(family, names)| (family.clone(), names.iter().filter_map(face).collect()))
            .collect();
        Self { families, outlines: HashMap::new() }
    }

    /// The outline of a letter at a size of one point, y down from the baseline; `None` for a blank.
    pub(crate) fn outline(&mut self, family: &FontFamily, letter: char) -> Option<&Path> {
        let key = (family.clone(), letter);
        let families = &self.families;
        self.outlines.entry(key).or_insert_with(|| outline(families.get(family)?, letter)).as_ref()
    }

    /// The advance width of a letter at a size of one point, points.
    pub(crate) fn advance(&self, family: &FontFamily, letter: char) -> f32 {
        let advance = || {
            let font = &face_of(self.families.get(family)?, letter)?.font;
            Some(font.h_advance_unscaled(font.glyph_id(letter)) / font.units_per_em()?)
        };
        advance().unwrap_or_default()
    }
}

/// The first font that contains the letter, else the first one.
fn face_of<'a, 'f>(faces: &'a [Face<'f>], letter: char) -> Option<&'a Face<'f>> {
    faces.iter().find(|face| face.font.glyph_id(letter).0 != 0).or(faces.first())
}

fn outline(faces: &[Face<'_>], letter: char) -> Option<Path> {
    let face = face_of(faces, letter)?;
    let per_em = face.font.units_per_em()?;
    let curves = face.font.outline(face.font.glyph_id(letter))?.curves;
    let at =
        |point: ab_glyph::Point| (point.x / per_em * face.scale, -point.y / per_em * face.scale + face.down);
    let mut path = PathBuilder::new();
    let mut last = None;
    for curve in curves {
        let (first, end) = match &curve {
            OutlineCurve::Line(first, end) => (*first, *end),
            OutlineCurve::Quad(first, _, end) => (*first, *end),
            OutlineCurve::Cubic(first, _, _, end) => (*first, *end),
        };
        if last != Some(first) {
            path.close();
            let (x, y) = at(first);
            path.move_to(x, y);
        }
        let (x, y) = at(end);
        match curve {
            OutlineCurve::Line(..) => path.line_to(x, y),
            OutlineCurve::Quad(_, handle, _) => {
                let (hx, hy) = at(handle);
                path.quad_to(hx, hy, x, y);
            }
            OutlineCurve::Cubic(_, one, two, _) => {
                let ((ax, ay), (bx, by)) = (at(one), at(two));
                path.cubic_to(ax, ay, bx, by, x, y);
            }
        }
        last = Some(end);
    }
    path.close();
    path.finish()
}
