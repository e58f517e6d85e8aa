//! The goodness map on the left image: every known cell as a square at its height, projected by the camera of the stop.

use egui::epaint::{Mesh, Vertex, WHITE_UV};
use egui::{Rect, Shape};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_session::hazard_view::{HazardView, UNKNOWN};

use crate::command::Layer;
use crate::drawing::overlay::Mark;
use crate::drawing::view2d::Canvas;
use crate::panels::legend::Entry;
use crate::state::State;
use crate::theme;

/// The legend entry of the layer; `None` if the navigator used no goodness map.
pub(crate) fn entry(state: &State) -> Option<Entry> {
    let word = "goodness of the ground, red is bad";
    state.has_hazards().then(|| Entry::new(Layer::Ground, Mark::Square, theme::goodness(100), word))
}

/// Paints the goodness of the ground over the left image.
pub(crate) fn paint(canvas: &Canvas, state: &State) {
    if !state.shows(Layer::Ground) {
        return;
    }
    let (Some(view), Some((camera, _)), Some(stop)) =
        (super::hazards::view(state), state.stereo_cameras(), state.stop())
    else {
        return;
    };
    let mut mesh = Mesh::default();
    for (corners, percent) in cells(&view, camera, &stop.site_from_rover.to_pose()) {
        let first = mesh.vertices.len() as u32;
        let color = theme::goodness(percent);
        let vertex = |pixel: Pixel| Vertex { pos: canvas.transform.to_screen(pixel), uv: WHITE_UV, color };
        mesh.vertices.extend(corners.map(vertex));
        mesh.add_triangle(first, first + 1, first + 2);
        mesh.add_triangle(first, first + 2, first + 3);
    }
    let [width, height] = [camera.width(), camera.height()].map(f64::from);
    let picture = [Pixel::new(-0.5, -0.5), Pixel::new(width - 0.5, height - 0.5)];
    let [first, last] = picture.map(|corner| canvas.transform.to_screen(corner));
    let clip = Rect::from_two_pos(first, last).intersect(canvas.painter.clip_rect());
    canvas.painter.with_clip_rect(clip).add(Shape::mesh(mesh));
}

/// The known cells with a height whose centre is visible to the camera: corners in the image, px, and goodness, %.
pub(crate) fn cells(view: &HazardView, camera: &Camera, site_from_rover: &Pose) -> Vec<([Pixel; 4], i8)> {
    let rover_from_site = site_from_rover.inverse();
    let seen = |[x, y]: [f64; 2], z: f64| rover_from_site * Point3::new(x, y, z);
    let cell = |(index, &percent): (usize, &i8)| {
        let z = f64::from((*view.height_m.get(index)?)?);
        if percent == UNKNOWN {
            return None;
        }
        let [row, column] = [index / view.side, index % view.side];
        let at = |down: f64, along: f64| {
            [(row, down, 0), (column, along, 1)]
                .map(|(number, part, axis)| view.corner_m[axis] + (number as f64 + part) * view.cell_m)
        };
        if !camera.sees(&seen(at(0.5, 0.5), z)) {
            return None;
        }
        let mut corners = [Pixel::new(0.0, 0.0); 4];
        for (corner, [down, along]) in
            corners.iter_mut().zip([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]])
        {
            *corner = camera.project(&seen(at(down, along), z))?;
        }
        Some((corners, percent))
    };
    view.goodness_percent.iter().enumerate().filter_map(cell).collect()
}
