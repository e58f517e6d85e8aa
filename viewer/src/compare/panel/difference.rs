//! The warped templates and the matched patches of two runs, and their signed difference.
//!
//! Both patches are normalised to mean 0 and standard deviation 1 over their common pixels, as correlation does (K-Eq 11),
//! and subtracted. Patches of different sizes are cropped about their centres to the common size.

use egui::{Color32, Mesh, Rect, Ui, pos2, vec2};
use sightline_track::trace::ArrayName;
use sightline_vision::image::GrayImage;

use crate::cache::Slot;
use crate::drawing::raster::{DIFFERENCE_LIMIT, PATCH_SIGMAS, Raster};
use crate::panels;
use crate::state::State;
use crate::theme;

/// The compared patches, with their labels.
const PATCHES: [(ArrayName, &str); 2] =
    [(ArrayName::ROLLED, "warped template"), (ArrayName::MATCHED, "matched patch")];

/// Shown while the panel is empty.
const PURPOSE: &str = "Difference of the two runs: warped template and matched patch.";

/// Height of the words above a patch, points.
const WORDS: f32 = 16.0;

/// Two normalised patches.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Patches {
    /// Width and height of the common area, px.
    pub size: [u32; 2],
    /// The first patch, with mean 0 and standard deviation 1; NaN where either patch has no value.
    pub first: Vec<f32>,
    /// The other patch, in the same form.
    pub other: Vec<f32>,
    /// Zero-mean normalised correlation of the two patches, from −1 to 1.
    pub correlation: f32,
    /// Whether a larger patch was cropped.
    pub is_cut: bool,
}

impl Patches {
    /// Normalises two patches over their common pixels; `None` if either has no contrast there.
    pub(crate) fn of(first: &GrayImage, other: &GrayImage) -> Option<Self> {
        let size = [first.width().min(other.width()), first.height().min(other.height())];
        let middle = |image: &GrayImage| -> Vec<f32> {
            let [left, top] = [(image.width() - size[0]) / 2, (image.height() - size[1]) / 2];
            let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
            pixels.map(|(x, y)| image.get_pixel(left + x, top + y)[0]).collect()
        };
        let (mut a, mut b) = (middle(first), middle(other));
        for (a, b) in a.iter_mut().zip(&mut b) {
            if a.is_nan() || b.is_nan() {
                (*a, *b) = (f32::NAN, f32::NAN);
            }
        }
        normalise(&mut a)?;
        normalise(&mut b)?;
        let products: Vec<f32> = a.iter().zip(&b).map(|(a, b)| a * b).filter(|p| !p.is_nan()).collect();
        let correlation = products.iter().sum::<f32>() / products.len() as f32;
        let is_cut = first.dimensions() != other.dimensions();
        Some(Self { size, first: a, other: b, correlation, is_cut })
    }

    /// First minus other, in standard deviations.
    pub(crate) fn difference(&self) -> Vec<f32> {
        self.first.iter().zip(&self.other).map(|(a, b)| a - b).collect()
    }

    /// Column, row and value of the difference with the largest magnitude.
    pub(crate) fn largest(&self) -> Option<(usize, usize, f32)> {
        let width = self.size[0] as usize;
        let values = self.difference().into_iter().enumerate().filter(|(_, value)| !value.is_nan());
        let found = values.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
        Some((found.0 % width, found.0 / width, found.1))
    }
}

/// Normalises values to mean 0 and standard deviation 1; `None` without contrast.
fn normalise(values: &mut [f32]) -> Option<()> {
    let there: Vec<f64> = values.iter().filter(|v| !v.is_nan()).map(|&v| f64::from(v)).collect();
    let mean = there.iter().sum::<f64>() / there.len() as f64;
    let sigma = (there.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / there.len() as f64).sqrt();
    if sigma.is_nan() || sigma < 1e-9 {
        return None;
    }
    values.iter_mut().for_each(|v| *v = ((f64::from(*v) - mean) / sigma) as f32);
    Some(())
}

/// Shows the patches of the selected run and of the first compared one.
pub(crate) fn show(ui: &mut Ui, state: &State) {
    let others = state.others();
    let Some(other) = others.first() else {
        return panels::missing(ui, PURPOSE, "There is no run to compare with.");
    };
    let (own, label) = (state.own_name().map(|own| state.run_label(own)), state.run_label(other.name));
    let own = own.unwrap_or_default();
    let area = ui.available_rect_before_wrap();
    let note = format!(
        "{own} less {label}; shown from −{DIFFERENCE_LIMIT} σ (blue) over 0 (white) to +{DIFFERENCE_LIMIT} σ (red)"
    );
    ui.label(theme::note(note));
    let rows = ui.available_rect_before_wrap().intersect(area);
    let height = rows.height() / PATCHES.len() as f32;
    for (i, (array, title)) in PATCHES.into_iter().enumerate() {
        let top = rows.top() + height * i as f32;
        let row = Rect::from_min_size(pos2(rows.left(), top), vec2(rows.width(), height));
        let slots = [state.array(array), state.other_array(other.name, array)];
        match both(slots) {
            Ok([first, second]) => show_row(ui, row, title, [&own, &label], [first, second]),
            Err(why) => {
                let sentence = format!("{title}: {why}");
                ui.put(row.shrink(8.0), egui::Label::new(theme::label(sentence)).wrap());
            }
        }
    }
    ui.advance_cursor_after_rect(area);
}

/// A column of a row: its words, its values and their colour map.
type Column<'a> = (String, &'a [f32], &'a dyn Fn(f32) -> Color32);

/// Both patches, or the reason why they are not shown.
fn both(slots: [Slot<'_, Raster>; 2]) -> Result<[&Raster; 2], String> {
    let [first, other] = slots.map(|slot| match slot {
        Slot::Ready(raster) => Ok(raster),
        Slot::Failed(problem) => Err(problem.detail.clone()),
        Slot::Loading => Err("loading …".to_owned()),
        Slot::Absent => {
            Err("one of the two runs has none at this step: it was not matched by a template here, or was \
                             not computed. Go to another step, or press V for another way to compare."
                .to_owned())
        }
    });
    Ok([first?, other?])
}

fn show_row(ui: &mut Ui, row: Rect, title: &str, names: [&str; 2], rasters: [&Raster; 2]) {
    let Some(patches) = Patches::of(&rasters[0].values, &rasters[1].values) else {
        let sentence = format!("{title}: the two share no pixels with contrast");
        ui.put(row.shrink(8.0), egui::Label::new(theme::label(sentence)).wrap());
        return;
    };
    let side = ((row.width() - 24.0) / 3.0).min(row.height() - 2.0 * WORDS).max(12.0);
    let difference = patches.difference();
    let grey = |v: f32| theme::grey(0.5 + v / (2.0 * PATCH_SIGMAS));
    let signed = |v: f32| theme::signed(v, DIFFERENCE_LIMIT);
    let columns: [Column<'_>; 3] = [
        (format!("{title}, {}", names[0]), &patches.first, &grey),
        (format!("{title}, {}", names[1]), &patches.other, &grey),
        ("difference".to_owned(), &difference, &signed),
    ];
    for (i, (words, values, colour)) in columns.into_iter().enumerate() {
        let corner = row.min + vec2((side + 12.0) * i as f32, WORDS);
        let frame = Rect::from_min_size(corner, vec2(side, side));
        // A title is as wide as its patch, because the next one starts beside it.
        let above = Rect::from_min_size(frame.left_top() - vec2(0.0, WORDS), vec2(side + 8.0, WORDS));
        let title = egui::Label::new(theme::note(&words).color(theme::text())).truncate();
        ui.put(above, title.halign(egui::Align::Min)).on_hover_text(&words);
        crate::drawing::view2d::checker(ui.painter(), frame);
        paint(ui, frame, patches.size, values, colour);
    }
    let words = summary(&patches, title, names);
    let below = row.min + vec2(0.0, WORDS + side + 2.0);
    let line = Rect::from_min_size(below, vec2(row.width(), WORDS));
    ui.put(line, egui::Label::new(theme::note(words)).truncate().halign(egui::Align::Min));
}

/// A summary of the row.
fn summary(patches: &Patches, title: &str, [own, other]: [&str; 2]) -> String {
    let largest = patches.largest().map_or_else(String::new, |(column, row, value)| {
        format!(", largest difference {value:+.2} σ at column {column}, row {row}")
    });
    let [width, height] = patches.size;
    let cut = if patches.is_cut { ", cut to what both have" } else { "" };
    format!(
        "{title}: ncc of {own} and {other} {:.3}{largest}; {width} × {height} px{cut}",
        patches.correlation
    )
}

/// Paints values as coloured cells.
fn paint(ui: &Ui, frame: Rect, [width, height]: [u32; 2], values: &[f32], colour: &dyn Fn(f32) -> Color32) {
    let cell = vec2(frame.width() / width as f32, frame.height() / height as f32);
    let mut mesh = Mesh::default();
    for (i, &value) in values.iter().enumerate().filter(|(_, value)| !value.is_nan()) {
        let (x, y) = (i as u32 % width, i as u32 / width);
        let corner = frame.min + vec2(cell.x * x as f32, cell.y * y as f32);
        mesh.add_colored_rect(Rect::from_min_size(corner, cell), colour(value));
    }
    ui.painter().add(egui::Shape::mesh(mesh));
    ui.painter().rect_stroke(frame, 0.0, egui::Stroke::new(1.0, theme::line()), egui::StrokeKind::Outside);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(side: u32, value: impl Fn(u32, u32) -> f32) -> GrayImage {
        GrayImage::from_fn(side, side, |x, y| image::Luma([value(x, y)]))
    }

    #[test]
    fn a_change_of_brightness_and_contrast_is_no_difference() {
        let wave = |x: u32, y: u32| ((x * 7 + y * 3) % 11) as f32 / 11.0;
        let patches = Patches::of(&image(9, wave), &image(9, |x, y| 0.3 * wave(x, y) + 0.5)).unwrap();
        assert!(patches.difference().iter().all(|d| d.abs() < 1e-5), "{patches:?}");
        assert!((patches.correlation - 1.0).abs() < 1e-5 && !patches.is_cut);
    }

    #[test]
    fn a_brighter_pixel_of_the_first_is_positive_and_found() {
        let wave = |x: u32, y: u32| ((x * 7 + y * 3) % 11) as f32 / 11.0;
        let spot = |x: u32, y: u32| if (x, y) == (2, 5) { 3.0 } else { wave(x, y) };
        let patches = Patches::of(&image(9, spot), &image(9, wave)).unwrap();
        let (column, row, value) = patches.largest().unwrap();
        assert_eq!((column, row), (2, 5));
        assert!(value > 3.0, "{value}");
    }

    #[test]
    fn patches_of_different_size_are_compared_about_their_centres() {
        let wave = |x: i64, y: i64| ((x * 7 + y * 3).rem_euclid(11)) as f32 / 11.0;
        let large = image(13, |x, y| wave(i64::from(x) - 6, i64::from(y) - 6));
        let small = image(9, |x, y| wave(i64::from(x) - 4, i64::from(y) - 4));
        let patches = Patches::of(&large, &small).unwrap();
        assert_eq!((patches.size, patches.is_cut), ([9, 9], true));
        assert!(patches.difference().iter().all(|d| d.abs() < 1e-5));
    }

    #[test]
    fn pixels_that_one_lacks_count_for_neither_and_flat_patches_have_no_difference() {
        let wave = |x: u32, y: u32| ((x * 7 + y * 3) % 11) as f32 / 11.0;
        let holed = image(9, |x, y| if y == 0 { f32::NAN } else { wave(x, y) });
        let other = image(9, |x, y| if y == 0 { 9.0 } else { wave(x, y) });
        let patches = Patches::of(&holed, &other).unwrap();
        assert!(patches.first[0].is_nan() && patches.other[0].is_nan());
        assert!((patches.correlation - 1.0).abs() < 1e-5);
        assert_eq!(Patches::of(&image(9, |_, _| 0.4), &other), None);
    }
}
