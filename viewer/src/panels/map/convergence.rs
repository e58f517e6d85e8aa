//! Successive positions of the target in the site frame, each with its 3σ ellipse, converging to the last one (R139).
//!
//! Seen from above and relative to the last position, in centimetres. The ellipse is that of the horizontal part of the
//! covariance, rotated from the rover frame into the site frame: `R Σ Rᵀ`; with stereo it shrinks with the square of the
//! range.

use egui::{Align2, Color32, Ui, vec2};
use egui_plot::{Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotUi, Points, Polygon, Text};
use nalgebra::Matrix2;
use sightline_api::wire::StopView;
use sightline_geometry::frames::Point3;
use sightline_session::step::StepRow;
use sightline_session::view::RunView;

use crate::compare::state::{Other, RunStyle};
use crate::drawing::{decimate, ellipse};
use crate::panels::chart::shape;
use crate::panels::map::site::{in_site, on_map, truth_in_site};
use crate::panels::numbers::fixed;
use crate::state::State;
use crate::theme;

/// Minimum half width of the view, cm: smaller errors are not worth magnifying.
const LEAST_HALF_CM: f64 = 0.5;

/// A step's estimate of the target position.
pub(crate) struct Position {
    /// The step.
    pub step: usize,
    /// The position in the site frame, m.
    pub point_in_site: Point3,
    /// Its horizontal covariance (east, north), m²; `None` if not finite.
    pub from_above: Option<Matrix2<f64>>,
}

/// The positions of a run, in the order of its steps.
pub(crate) fn positions(run: &RunView, stops: &[StopView]) -> Vec<Position> {
    run.rows.iter().filter_map(|row| position(row, stops)).collect()
}

/// The positions that a map shows, evenly decimated.
pub(crate) fn shown(run: &RunView, stops: &[StopView]) -> Vec<Position> {
    decimate::evenly(&run.rows, decimate::PLACES).filter_map(|row| position(row, stops)).collect()
}

/// A step's estimate of the target position; `None` if the step has no stop.
fn position(row: &StepRow, stops: &[StopView]) -> Option<Position> {
    let site_from_rover = stops.get(row.step)?.site_from_rover.to_pose();
    let rotation = *site_from_rover.rotation.to_rotation_matrix().matrix();
    let in_site = rotation * row.covariance_in_rover * rotation.transpose();
    let from_above = Matrix2::new(in_site[(1, 1)], in_site[(1, 0)], in_site[(0, 1)], in_site[(0, 0)]);
    Some(Position {
        step: row.step,
        point_in_site: site_from_rover * Point3::from(row.position_in_rover),
        from_above: from_above.iter().all(|v| v.is_finite()).then_some(from_above),
    })
}

/// Shows the target's neighbourhood.
pub(crate) fn show(ui: &mut Ui, state: &State, stops: &[StopView], run: &RunView) {
    let positions = shown(run, stops);
    let Some(last) = positions.last() else { return };
    let origin = on_map(&last.point_in_site);
    let here = state.row().and_then(|row| position(row, stops));
    let mut words = sentence(&positions, here.as_ref());
    if let Some(thinned) = decimate::words(run.rows.len(), decimate::PLACES) {
        words += &format!("; {thinned}");
    }
    ui.add(egui::Label::new(theme::note(&words)).truncate()).on_hover_text(words);
    let plot = Plot::new(("convergence", run.number, positions.len()))
        .data_aspect(1.0)
        .include_x(-LEAST_HALF_CM)
        .include_x(LEAST_HALF_CM)
        .include_y(-LEAST_HALF_CM)
        .include_y(LEAST_HALF_CM)
        .set_margin_fraction(vec2(0.06, 0.06))
        .x_axis_label(theme::note(if ui.available_width() > 260.0 {
            "east, cm (origin: last estimate)"
        } else {
            "east, cm"
        }))
        .y_axis_label(theme::note("north, cm"));
    let plot = in_site(plot, |at| format!("E {}  N {} cm", fixed(at.x, 1), fixed(at.y, 1)));
    plot.show(ui, |plot| paint(plot, state, (run, &positions, here.as_ref()), origin));
}

/// The target's positions in the bootstrap sets of the cursor's step, in the site frame, m.
fn cloud_in_site(state: &State) -> impl Iterator<Item = Point3> {
    let pose = state.stop().map(|stop| stop.site_from_rover.to_pose());
    let cloud = state.cloud().ready().map_or(&[][..], Vec::as_slice);
    pose.into_iter().flat_map(|pose| cloud.iter().map(move |point| pose * point.position_in_rover))
}

/// The 3σ half axes at the pick, now and at the end, in words.
fn sentence(positions: &[Position], here: Option<&Position>) -> String {
    let width = |at: Option<&Position>| {
        at.and_then(long_axis_cm).map_or_else(|| "none".to_owned(), |cm| format!("{cm:.1}"))
    };
    let (first, last) = (width(positions.first()), width(positions.last()));
    let here = here.map_or_else(String::new, |here| format!(" · now {}", width(Some(here))));
    format!("3σ (cm): at pick {first}{here} · at end {last}")
}

/// The longer half axis of the 3σ ellipse, cm.
fn long_axis_cm(at: &Position) -> Option<f64> {
    let [long, _] = ellipse::axes(at.from_above.as_ref()?)?;
    Some(300.0 * long.norm())
}

/// A run's positions and the cursor's.
type PlottedPositions<'a> = (&'a RunView, &'a [Position], Option<&'a Position>);

fn paint(
    plot: &mut PlotUi<'_>,
    state: &State,
    (run, positions, here): PlottedPositions<'_>,
    origin: [f64; 2],
) {
    let colour = theme::run(run.number);
    let place = |point: &Point3| {
        let [east, north] = on_map(point);
        [(east - origin[0]) * 100.0, (north - origin[1]) * 100.0]
    };
    let cloud = cloud_in_site(state).map(|point| place(&point)).collect::<Vec<_>>();
    plot.points(Points::new("", cloud).color(colour).radius(1.0).allow_hover(false));
    let trail: Vec<[f64; 2]> = positions.iter().map(|at| place(&at.point_in_site)).collect();
    for piece in decimate::path(&trail) {
        plot.line(Line::new("", piece).color(colour.gamma_multiply(0.6)).width(1.0));
    }
    plot.points(
        Points::new("", decimate::marks(trail)).color(colour).radius(2.0).shape(MarkerShape::Diamond),
    );
    let count = positions.len().clamp(2, decimate::ELLIPSES) as f32 - 1.0;
    for (i, at) in decimate::evenly(positions, decimate::ELLIPSES).enumerate() {
        // Later ellipses are stronger; that of the cursor's step has a thick line.
        let strength = 0.4 + 0.6 * i as f32 / count;
        if here.is_none_or(|here| here.step != at.step) {
            outline(plot, at, place(&at.point_in_site), colour.gamma_multiply(strength), 1.0);
        }
    }
    if let Some(here) = here {
        outline(plot, here, place(&here.point_in_site), theme::accent(), 2.5);
        let [east, north] = place(&here.point_in_site);
        plot.points(
            Points::new("", [east, north]).color(theme::accent()).radius(5.0).shape(MarkerShape::Diamond),
        );
        let words = theme::note(format!("   step {}", here.step)).color(theme::accent());
        plot.text(Text::new("", PlotPoint::new(east, north), words).anchor(Align2::LEFT_BOTTOM));
    }
    for other in state.others() {
        paint_other(plot, &positions_of(&other, state), other.style, place);
    }
    if let Some((truth, _)) = truth_in_site(state) {
        let points = Points::new("", place(&truth)).color(theme::truth()).radius(6.0);
        plot.points(points.shape(MarkerShape::Plus));
    }
}

/// The target positions of a compared run.
fn positions_of(other: &Other<'_>, state: &State) -> Vec<Position> {
    state.traverse.as_ref().map_or_else(Vec::new, |traverse| shown(other.run, &traverse.stops))
}

/// The trail of a compared run with its last ellipse.
fn paint_other(
    plot: &mut PlotUi<'_>,
    all: &[Position],
    style: RunStyle,
    place: impl Fn(&Point3) -> [f64; 2],
) {
    let trail: Vec<[f64; 2]> = all.iter().map(|at| place(&at.point_in_site)).collect();
    for piece in decimate::path(&trail) {
        plot.line(Line::new("", piece).color(style.colour.gamma_multiply(0.6)).width(1.0));
    }
    plot.points(
        Points::new("", decimate::marks(trail)).color(style.colour).radius(2.5).shape(shape(style.mark)),
    );
    if let Some(last) = all.last() {
        outline(plot, last, place(&last.point_in_site), style.colour, 1.5);
    }
}

/// The 3σ ellipse of a position.
fn outline(plot: &mut PlotUi<'_>, at: &Position, centre_cm: [f64; 2], colour: Color32, width: f32) {
    let Some(outline) = at.from_above.as_ref().and_then(|covariance| ellipse::outline(covariance, 3.0))
    else {
        return;
    };
    let points: Vec<[f64; 2]> =
        outline.iter().map(|d| [centre_cm[0] + d.x * 100.0, centre_cm[1] + d.y * 100.0]).collect();
    let polygon = Polygon::new("", points).style(LineStyle::Solid).allow_hover(false);
    plot.polygon(polygon.fill_color(Color32::TRANSPARENT).stroke(egui::Stroke::new(width, colour)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;

    #[test]
    fn a_covariance_is_turned_into_the_site_frame_and_seen_from_above() {
        let state = fixture::at_step(&egui::Context::default(), 2);
        let mut stops = state.traverse.as_ref().unwrap().stops.clone();
        let mut run = state.run().unwrap().clone();
        // For a rover that heads east, its forward axis, along which the target is uncertain, is the map's east.
        let heading = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2);
        let pose = sightline_geometry::frames::Pose::from_parts(Default::default(), heading);
        stops[0].site_from_rover = sightline_geometry::frames::PoseRecord::from(&pose);
        run.rows[0].covariance_in_rover =
            nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(4e-4, 1e-4, 0.0));
        let positions = positions(&run, &stops);
        let from_above = positions[0].from_above.unwrap();
        assert!((from_above[(0, 0)] - 4e-4).abs() < 1e-12 && (from_above[(1, 1)] - 1e-4).abs() < 1e-12);
        assert!((long_axis_cm(&positions[0]).unwrap() - 6.0).abs() < 1e-9);
    }
}
