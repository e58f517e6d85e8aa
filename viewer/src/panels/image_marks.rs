//! Paints the marks of a step over its images. [`sightline_session::marks`] computes the marks; this module assigns each
//! its layer, colour and stroke.

use egui::{Color32, vec2};
use sightline_session::marks::{MarkName, Shape, marks};
use sightline_session::step::RunStep;

use crate::cache::ImageSide;
use crate::command::Layer;
use crate::drawing::ellipse;
use crate::drawing::overlay::{Mark, Overlay, StrokeStyle};
use crate::state::State;
use crate::theme;

/// The run whose marks are painted.
#[derive(Clone, Copy)]
pub(crate) enum Of {
    /// The selected run, in its colour.
    Shown(Color32),
    /// A run compared with the selected one, in its colour and with its mark.
    Compared(Color32, Mark),
}

/// How a mark is painted: a mark at a position, or the stroke of a line.
enum Pen {
    Mark(Mark),
    Line(StrokeStyle),
    Thin(StrokeStyle),
}

/// Paints the marks of a step over one of its images, in the layers that are shown.
pub(crate) fn paint(
    overlay: &Overlay<'_>,
    step: &RunStep,
    template_size_px: u32,
    side: ImageSide,
    of: Of,
    state: &State,
) {
    let marks = marks(step, template_size_px);
    for mark in marks.iter().filter(|mark| mark.name.is_left() == (side == ImageSide::Left)) {
        let style = match of {
            Of::Shown(colour) => style(mark.name, colour),
            Of::Compared(colour, sign) => compared_style(mark.name, colour, sign),
        };
        let Some((_, colour, pen)) = style.filter(|(layer, ..)| state.shows(*layer)) else { continue };
        paint_shape(overlay, &mark.shape, colour, &pen);
        if mark.name == MarkName::PredictionGate && matches!(of, Of::Shown(_)) {
            paint_gate_words(overlay, &mark.shape, colour);
        }
    }
}

/// The style of a mark of the selected run; `None` if the images do not show it.
fn style(name: MarkName, run: Color32) -> Option<(Layer, Color32, Pen)> {
    Some(match name {
        MarkName::Subframe => (Layer::Subframe, theme::subframe(), Pen::Line(StrokeStyle::Dotted)),
        MarkName::SearchWindow => (Layer::SearchWindow, theme::search(), Pen::Line(StrokeStyle::Dashed)),
        MarkName::PredictionGate => (Layer::Prediction, theme::prediction(), Pen::Line(StrokeStyle::Dotted)),
        MarkName::PredictedLeft | MarkName::PredictedRight => {
            (Layer::Prediction, theme::prediction(), Pen::Mark(Mark::Cross))
        }
        MarkName::Basin => (Layer::Basin, theme::basin(), Pen::Line(StrokeStyle::Dashed)),
        MarkName::MatchedWindow => (Layer::Template, run, Pen::Line(StrokeStyle::Solid)),
        MarkName::CarriedWindow => (Layer::Template, run, Pen::Line(StrokeStyle::Dotted)),
        MarkName::LocatedError | MarkName::StereoError => (Layer::Match, run, Pen::Line(StrokeStyle::Solid)),
        MarkName::LocatedLeft | MarkName::LocatedRight => (Layer::Match, run, Pen::Mark(Mark::Ring)),
        MarkName::TrueLeft => (Layer::Truth, theme::truth(), Pen::Mark(Mark::Plus)),
        MarkName::Curve => (Layer::Curve, theme::search(), Pen::Line(StrokeStyle::Solid)),
        // The panel of the match scores shows the peaks; the predicted window is the matched window, moved.
        MarkName::PredictedWindow | MarkName::Peak | MarkName::SecondPeak | MarkName::StereoMatch => {
            return None;
        }
    })
}

/// The style of a mark of a compared run: in the run's colour, without marks that would hide those of the selected run.
fn compared_style(name: MarkName, colour: Color32, sign: Mark) -> Option<(Layer, Color32, Pen)> {
    let (layer, own, pen) = style(name, colour)?;
    Some(match name {
        MarkName::Subframe | MarkName::Basin | MarkName::CarriedWindow => return None,
        MarkName::LocatedLeft | MarkName::LocatedRight => (layer, colour, Pen::Mark(sign)),
        MarkName::Curve => (layer, colour, Pen::Thin(StrokeStyle::Dashed)),
        MarkName::TrueLeft => (layer, own, pen),
        _ => (layer, colour, pen),
    })
}

fn paint_shape(overlay: &Overlay<'_>, shape: &Shape, colour: Color32, pen: &Pen) {
    match (shape, pen) {
        (Shape::Point(at), Pen::Mark(mark)) => overlay.mark(*at, *mark, colour),
        (Shape::Ellipse { centre, covariance_px2, sigmas }, Pen::Line(line)) => {
            for &sigmas in *sigmas {
                overlay.ellipse(*centre, covariance_px2, sigmas, colour, *line);
            }
        }
        (Shape::Outline(corners), Pen::Line(line)) => overlay.outline(corners, colour, *line),
        (Shape::Rect(rect), Pen::Line(line)) => overlay.rectangle(*rect, colour, *line),
        (Shape::Curve(points), pen) => {
            let points: Vec<_> = points.iter().map(|(pixel, _)| *pixel).collect();
            match pen {
                Pen::Line(line) => overlay.line(&points, colour, *line),
                Pen::Thin(line) => overlay.thin_line(&points, colour, *line),
                Pen::Mark(_) => {}
            }
        }
        _ => {}
    }
}

/// Labels the prediction gate if it is large enough to be distinguished from its centre.
fn paint_gate_words(overlay: &Overlay<'_>, gate: &Shape, colour: Color32) {
    let Shape::Ellipse { centre, covariance_px2, .. } = gate else { return };
    let Some([long, _]) = ellipse::axes(covariance_px2) else { return };
    let end = centre.offset(3.0 * long.x.abs(), 3.0 * long.x.signum() * long.y);
    if overlay.length(*centre, end) > 24.0 {
        overlay.words(end, vec2(6.0, 0.0), "3σ", colour);
    }
}
