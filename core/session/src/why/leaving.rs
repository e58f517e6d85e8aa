//! A target that leaves an image: its prediction is too close to an edge for the template, or beyond the edge.

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::Pixel;
use sightline_track::settings::TrackerKind;

use super::Book;
use super::words::number;

/// The sentence for a target that leaves the left or the right image; `None` if the template fits into both.
pub(super) fn sentence(book: &Book<'_>) -> Option<String> {
    let predicted = book.trace.prediction()?.position_in_rover;
    let pointing = &book.trace.point_mast;
    let template_px = match book.settings.tracker {
        TrackerKind::Template => f64::from(book.settings.template.template_size_px),
        // These trackers use features or surface anywhere in the image.
        TrackerKind::Features | TrackerKind::Shape | TrackerKind::Combined => return None,
    };
    let seen = [("left", &pointing.left), ("right", &pointing.right)];
    seen.into_iter().find_map(|(side, camera)| {
        let pixel = match (side, pointing.predicted_left) {
            // Includes a displacement of the prediction by a person.
            ("left", Some(pixel)) => pixel,
            _ => camera.project(&predicted)?,
        };
        let (edge, inside_px) = nearest_edge(camera, pixel);
        if inside_px >= 0.5 * template_px {
            return None;
        }
        Some(if inside_px < 0.0 {
            let beyond = number(-inside_px);
            format!("The target has left the {side} image: it is predicted {beyond} px beyond the {edge} edge")
        } else {
            format!(
                "The target leaves the {side} image: it is predicted {} px from the {edge} edge, and the template needs {} px \
                 around it",
                number(inside_px),
                number((0.5 * template_px).floor())
            )
        })
    })
}

/// The image edge nearest to a pixel, and the distance from it, px; negative beyond the edge.
fn nearest_edge(camera: &Camera, pixel: Pixel) -> (&'static str, f64) {
    let [right, lower] = [camera.width(), camera.height()].map(|size| f64::from(size) - 1.0);
    let edges =
        [("left", pixel.x), ("right", right - pixel.x), ("upper", pixel.y), ("lower", lower - pixel.y)];
    edges.into_iter().fold(edges[0], |nearest, edge| if edge.1 < nearest.1 { edge } else { nearest })
}
