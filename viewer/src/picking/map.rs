//! The trackability map over the left image: good cells tinted, areas of risky cells outlined, poor cells dimmed.
//!
//! The three verdicts differ in shape, not only in colour: a fill, an outline, and neither.

use egui::{Color32, Mesh, Rect, Shape, Stroke};
use sightline_rover::trackability::{TrackabilityMap, Verdict};
use sightline_vision::image::PixelRect;

use crate::command::{Layer, Mode};
use crate::drawing::view2d::{Canvas, Transform};
use crate::state::State;
use crate::theme;

/// Width of the outline of risky areas, points.
const OUTLINE: f32 = 1.0;

/// Paints the map over the image, below all marks.
pub(crate) fn paint(canvas: &Canvas, state: &State) {
    if state.mode != Mode::Pick || !state.shows(Layer::Trackability) {
        return;
    }
    if let Some(map) = state.trackability_map() {
        let painter = canvas.painter.with_clip_rect(canvas.transform.rect);
        painter.add(Shape::mesh(fills(map, &canvas.transform)));
        painter.extend(outlines(map, &canvas.transform));
    }
}

/// One quad for every run of cells with the same verdict in a row.
fn fills(map: &TrackabilityMap, transform: &Transform) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..map.rows_done() {
        let letters = &map.verdicts.as_bytes()[row * map.columns..(row + 1) * map.columns];
        let mut first = 0;
        while first < letters.len() {
            let length = letters[first..].iter().take_while(|letter| **letter == letters[first]).count();
            let fill = Verdict::of_letter(letters[first]).and_then(theme::trackability_fill);
            if let Some(fill) = fill {
                mesh.add_colored_rect(area(map, transform, [first, row], [length, 1]), fill);
            }
            first += length;
        }
    }
    mesh
}

/// Thin lines along the border of the areas of risky cells.
fn outlines(map: &TrackabilityMap, transform: &Transform) -> Vec<Shape> {
    let is_risky =
        |column: usize, row: usize| map.cell(column, row).is_some_and(|cell| cell.verdict == Verdict::Risky);
    let stroke = Stroke::new(OUTLINE, outline_colour());
    let mut shapes = Vec::new();
    for row in 0..map.rows_done() {
        for column in (0..map.columns).filter(|column| is_risky(*column, row)) {
            let cell = area(map, transform, [column, row], [1, 1]);
            if !cell.intersects(transform.rect) {
                continue;
            }
            let sides = [
                (column.checked_sub(1).map(|left| [left, row]), [cell.left_top(), cell.left_bottom()]),
                (Some([column + 1, row]), [cell.right_top(), cell.right_bottom()]),
                (row.checked_sub(1).map(|above| [column, above]), [cell.left_top(), cell.right_top()]),
                (Some([column, row + 1]), [cell.left_bottom(), cell.right_bottom()]),
            ];
            let borders =
                sides.into_iter().filter(|(beside, _)| !beside.is_some_and(|[x, y]| is_risky(x, y)));
            shapes.extend(borders.map(|(_, side)| Shape::line_segment(side, stroke)));
        }
    }
    shapes
}

fn outline_colour() -> Color32 {
    theme::trackability(Verdict::Risky).gamma_multiply(0.8)
}

/// The screen area of a block of cells.
fn area(map: &TrackabilityMap, transform: &Transform, first: [usize; 2], count: [usize; 2]) -> Rect {
    let at = |cells: usize| (cells as u32 * map.cell_px) as i32;
    let side = |cells: usize| cells as u32 * map.cell_px;
    transform.area(PixelRect::new(at(first[0]), at(first[1]), side(count[0]), side(count[1])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::view2d::View2d;
    use egui::{pos2, vec2};

    /// Two rows of four cells: good, risky, risky, poor.
    fn map() -> TrackabilityMap {
        TrackabilityMap {
            cell_px: 8,
            columns: 4,
            rows: 2,
            verdicts: "grrbgrrb".to_owned(),
            reasons: "-EEE-EEE".to_owned(),
            ..TrackabilityMap::default()
        }
    }

    fn transform() -> Transform {
        let rect = Rect::from_min_size(pos2(0.0, 0.0), vec2(320.0, 160.0));
        Transform::new(View2d::Fit, PixelRect::whole(32, 16), rect)
    }

    #[test]
    fn good_is_tinted_and_poor_is_dimmed_by_at_most_15_percent() {
        assert!(theme::trackability_fill(Verdict::Good).is_some());
        assert_eq!(theme::trackability_fill(Verdict::Risky), None);
        let poor = theme::trackability_fill(Verdict::Bad).unwrap();
        assert_eq!([poor.r(), poor.g(), poor.b()], [0; 3]);
        assert!(f64::from(poor.a()) <= 0.15 * 255.0, "{}", poor.a());
        // Two quads of four corners a row: the good cell and the poor one.
        assert_eq!(fills(&map(), &transform()).vertices.len(), 2 * 2 * 4);
    }

    #[test]
    fn a_risky_area_has_one_outline_and_no_lines_inside() {
        // A square of two by two cells has eight sides of a cell around it.
        assert_eq!(outlines(&map(), &transform()).len(), 8);
    }
}
