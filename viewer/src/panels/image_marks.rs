//! Paints the marks of a step over its images. Which marks there are says [`sightline_session::marks`]; here each gets its
//! layer, colour and stroke.

use egui::{Color32, vec2};
use sightline_session::marks::{MarkName, Shape, marks};
use sightline_session::step::RunStep;

use crate::cache::Eye;
use crate::command::Layer;
use crate::drawing::ellipse;
use crate::drawing::overlay::{Line, Mark, Overlay};
use crate::state::State;
use crate::theme;

/// The run whose marks are painted.
#[derive(Clone, Copy)]
pub(crate) enum Of {
    /// The run that is looked at, in its colour.
    Shown(Color32),
    /// A run that is compared with it, in its colour and with its mark.
    Compared(Color32, Mark),
}

/// How a mark is painted: a mark at a position, or the stroke of a line.
enum Pen {
    Mark(Mark),
    Line(Line),
    Thin(Line),
}

/// Paints the marks of a step over one of its images, as far as their layers are shown.
pub(crate) fn paint(
    overlay: &Overlay<'_>,
    step: &RunStep,
    template_size_px: u32,
    eye: Eye,
    of: Of,
    state: &State,
) {
    let marks = marks(step, template_size_px);
    for mark in marks.iter().filter(|mark| mark.name.is_left() == (eye == Eye::Left)) {
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

/// Of the run that is looked at.
fn style(name: MarkName, run: Color32) -> Option<(Layer, Color32, Pen)> {
    Some(match name {
        MarkName::Subframe => (Layer::Subframe, theme::subframe(), Pen::Line(Line::Dotted)),
        MarkName::SearchWindow => (Layer::SearchWindow, theme::search(), Pen::Line(Line::Dashed)),
        MarkName::PredictionGate => (Layer::Prediction, theme::prediction(), Pen::Line(Line::Dotted)),
        MarkName::PredictedLeft | MarkName::PredictedRight => {
            (Layer::Prediction, theme::prediction(), Pen::Mark(Mark::Cross))
        }
        MarkName::Basin => (Layer::Basin, theme::basin(), Pen::Line(Line::Dashed)),
        MarkName::MatchedWindow => (Layer::Template, run, Pen::Line(Line::Solid)),
        MarkName::CarriedWindow => (Layer::Template, run, Pen::Line(Line::Dotted)),
        MarkName::LocatedError | MarkName::StereoError => (Layer::Match, run, Pen::Line(Line::Solid)),
        MarkName::LocatedLeft | MarkName::LocatedRight => (Layer::Match, run, Pen::Mark(Mark::Ring)),
        MarkName::TrueLeft => (Layer::Truth, theme::truth(), Pen::Mark(Mark::Plus)),
        MarkName::Curve => (Layer::Curve, theme::search(), Pen::Line(Line::Solid)),
        // The panel of the match scores shows the peaks; the window that was expected is that of the match, moved.
        MarkName::PredictedWindow | MarkName::Peak | MarkName::SecondPeak | MarkName::StereoMatch => {
            return None;
        }
    })
}

/// Of a compared run: all in its colour, without what would hide the marks of the run that is looked at.
fn compared_style(name: MarkName, colour: Color32, sign: Mark) -> Option<(Layer, Color32, Pen)> {
    let (layer, own, pen) = style(name, colour)?;
    Some(match name {
        MarkName::Subframe | MarkName::Basin | MarkName::CarriedWindow => return None,
        MarkName::LocatedLeft | MarkName::LocatedRight => (layer, colour, Pen::Mark(sign)),
        MarkName::Curve => (layer, colour, Pen::Thin(Line::Dashed)),
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

/// The words beside the gate of the prediction, where it is large enough to be told from its centre.
fn paint_gate_words(overlay: &Overlay<'_>, gate: &Shape, colour: Color32) {
    let Shape::Ellipse { centre, covariance_px2, .. } = gate else { return };
    let Some([long, _]) = ellipse::axes(covariance_px2) else { return };
    let end = centre.offset(3.0 * long.x.abs(), 3.0 * long.x.signum() * long.y);
    if overlay.length(*centre, end) > 24.0 {
        overlay.words(end, vec2(6.0, 0.0), "3σ", colour);
    }
}
