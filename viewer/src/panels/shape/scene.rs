//! Orthographic projection of facets, lines and points to the screen, painted from far to near.
//!
//! ```text
//! right = z × a,  down = a × right          a: from the view point to the centre, z: the rover's z axis, which points down
//! ```
//! The view point is the left camera, rotated about the centre by the orbit. Frame: rover, m.

use egui::{Color32, Mesh, Pos2, Rect, Shape, pos2};
use nalgebra::{Rotation3, Unit};
use sightline_geometry::frames::{Point3, Vector3};
use sightline_track::locate::shape_tracker::rows::Facet;

use crate::shape_view::Orbit;
use crate::theme;

/// Half the width of a line, points.
const LINE: f32 = 0.6;

/// Projects points of the rover frame to the screen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OrthographicView {
    right: Vector3,
    down: Vector3,
    away: Vector3,
    middle: Point3,
    /// Points per metre.
    pub(crate) scale: f64,
    rect: Rect,
}

impl OrthographicView {
    /// The view from `camera` to `middle`, rotated by `orbit`; a sphere of radius `reach_m` about `middle` fits into
    /// `rect`.
    pub(crate) fn new(camera: &Point3, middle: Point3, reach_m: f64, orbit: Orbit, rect: Rect) -> Self {
        let sight = (middle - camera).try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let sideways = sight.cross(&Vector3::z()).try_normalize(1e-9).unwrap_or_else(Vector3::y);
        // Seen from above, with z down, a positive rotation about z is to the right.
        let yaw = Rotation3::from_axis_angle(&Vector3::z_axis(), -orbit.yaw_rad);
        let pitch = Rotation3::from_axis_angle(&Unit::new_normalize(-sideways), -orbit.pitch_rad);
        let away = yaw * (pitch * sight);
        let right = -(yaw * sideways);
        let down = away.cross(&right).normalize();
        let fit = f64::from(rect.width().min(rect.height())) / (2.0 * reach_m.max(1e-6));
        Self { right, down, away, middle, scale: fit * orbit.zoom, rect }
    }

    /// The screen position, and the distance from the centre along the line of sight, m.
    pub(crate) fn project(&self, point: &Point3) -> (Pos2, f64) {
        let from = point - self.middle;
        let place = |axis: &Vector3| (from.dot(axis) * self.scale) as f32;
        let centre = self.rect.center();
        (pos2(centre.x + place(&self.right), centre.y + place(&self.down)), from.dot(&self.away))
    }
}

/// The shapes to paint, each with its distance.
pub(crate) struct Scene {
    view: OrthographicView,
    parts: Vec<(f64, [Pos2; 3], Color32, bool)>,
}

impl Scene {
    /// An empty scene.
    pub(crate) fn new(view: OrthographicView) -> Self {
        Self { view, parts: Vec::new() }
    }

    /// Adds facets, filled and shaded by their orientation, or as three lines each.
    pub(crate) fn facets<'a>(
        &mut self,
        facets: impl Iterator<Item = &'a Facet>,
        colour: Color32,
        is_filled: bool,
    ) {
        for facet in facets {
            let corners = facet.map(|corner| Point3::from(corner.map(f64::from)));
            let seen = corners.map(|corner| self.view.project(&corner));
            let depth_m = seen.iter().map(|(_, depth)| depth).sum::<f64>() / 3.0;
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
            // The light comes from behind the view point, slightly from above and from the left.
            let light = (self.view.away + self.view.down * 0.5 + self.view.right * 0.3).normalize();
            let facing = normal.try_normalize(1e-15).map_or(0.0, |normal| normal.dot(&light).abs());
            let colour = if is_filled { theme::shaded(colour, facing) } else { colour };
            self.parts.push((depth_m, seen.map(|(at, _)| at), colour, is_filled));
        }
    }

    /// The shapes, from far to near.
    pub(crate) fn shape(mut self) -> Shape {
        self.parts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut mesh = Mesh::default();
        for (_, [a, b, c], colour, is_filled) in self.parts {
            if is_filled {
                triangle(&mut mesh, [a, b, c], colour);
            } else {
                [[a, b], [b, c], [c, a]].into_iter().for_each(|ends| line(&mut mesh, ends, colour));
            }
        }
        Shape::mesh(mesh)
    }
}

fn triangle(mesh: &mut Mesh, corners: [Pos2; 3], colour: Color32) {
    let first = mesh.vertices.len() as u32;
    corners.into_iter().for_each(|at| mesh.colored_vertex(at, colour));
    mesh.add_triangle(first, first + 1, first + 2);
}

fn line(mesh: &mut Mesh, [from, to]: [Pos2; 2], colour: Color32) {
    let along = to - from;
    let length = along.length();
    if length < 1e-3 {
        return;
    }
    let side = along.rot90() / length * LINE;
    triangle(mesh, [from - side, from + side, to - side], colour);
    triangle(mesh, [from + side, to + side, to - side], colour);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(orbit: Orbit) -> OrthographicView {
        let rect = Rect::from_min_max(pos2(0.0, 0.0), pos2(200.0, 100.0));
        OrthographicView::new(&Point3::new(0.0, 0.0, 0.0), Point3::new(4.0, 0.0, 0.0), 0.5, orbit, rect)
    }

    #[test]
    fn the_untouched_view_is_that_of_the_camera() {
        let view = view(Orbit::default());
        let (at, depth_m) = view.project(&Point3::new(4.2, 0.25, 0.1));
        // The rover's y is right, its z down; half a metre is 50 points.
        assert!((at - pos2(125.0, 60.0)).length() < 1e-3 && (depth_m - 0.2).abs() < 1e-9, "{at} {depth_m}");
    }

    #[test]
    fn a_turn_to_the_right_and_up_shows_what_lies_there_nearer() {
        let nearer = |orbit: Orbit, point: Point3| {
            view(orbit).project(&point).1 < view(Orbit::default()).project(&point).1 - 0.05
        };
        let right = Orbit { yaw_rad: 0.5, ..Orbit::default() };
        assert!(nearer(right, Point3::new(4.0, 0.3, 0.0)));
        let up = Orbit { pitch_rad: 0.5, ..Orbit::default() };
        assert!(nearer(up, Point3::new(4.0, 0.0, -0.3)));
    }

    #[test]
    fn the_nearest_is_painted_last() {
        let facet = |x: f32| [[x, 0.0, 0.0], [x, 0.1, 0.0], [x, 0.0, 0.1]];
        let mut scene = Scene::new(view(Orbit::default()));
        let (near, far) = (theme::failed(), theme::prediction());
        scene.facets([facet(3.9)].iter(), near, true);
        scene.facets([facet(4.1)].iter(), far, true);
        let Shape::Mesh(mesh) = scene.shape() else { panic!("a mesh") };
        // The farther facet is blue.
        let is_blue = |at: usize| mesh.vertices[at].color.b() > mesh.vertices[at].color.r();
        assert!(is_blue(0) && !is_blue(3));
    }
}
