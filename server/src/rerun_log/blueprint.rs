//! How a viewer lays a recording out.
//!
//! ```text
//! ┌ left image ────────┬ right image ───────┬ map ───────────────┐
//! ├ one tab per run ───┴────────────────────┴────────────────────┤
//! │ close-up    │ six patches  │ surface    │ time series in tabs │
//! ├ states over time ──┴────────────────────┼ log │ about ───────┤
//! └─────────────────────────────────────────┴────────────────────┘
//! ```
//! An entity shows only in the views that name it: what lies over the left image is listed here and not found
//! by its path, because paths follow the stages and not the pictures. The close-up shows the same as the left
//! image, from the frame of the subframe, which goes with the target. A run that asks for the shape has two tabs, “Match”
//! and “Shape”; the second has what the shape tracker saw, the meshes and how well they fit.

use rerun::blueprint::components::{
    BackgroundKind, Corner2D, PanelState, PlayState, VisualBounds2D as Bounds,
};
use rerun::blueprint::{
    Blueprint, BlueprintPanel, ContainerLike, Grid, Horizontal, SelectionPanel, Spatial2DView, Spatial3DView,
    StateTimelineView, Tabs, TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical,
};
use rerun::datatypes::Range2D;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, EyeControls3D, PlotLegend, VisualBounds2D,
};

use super::Logged;
use super::border::point_3d;
use super::layout::Layout;
use super::map::Outlook;
use super::palette::{MAP_BACKGROUND, color};
use super::step::path;

/// What lies over the left image.
const LEFT: [&str; 15] = [
    "/{target}/predict/left",
    "/{target}/point_mast/gate",
    "/{target}/capture/subframe",
    "/{target}/locate/scale_roll/footprint",
    "/{target}/locate/match_template/window",
    "/{target}/locate/match_template/matched_window",
    "/{target}/locate/match_template/peak",
    "/{target}/locate/match_template/second_peak",
    "/{target}/locate/detect/keypoints",
    "/{target}/locate/match_features/inliers",
    "/{target}/locate/match_features/outliers",
    "/{target}/locate/fit_motion/residuals",
    "/{target}/locate/bootstrap/left",
    "/{target}/locate/left_covariance",
    "/truth/{target}/left",
];

/// What lies over the right image.
const RIGHT: [&str; 4] = [
    "/{target}/predict/right",
    "/{target}/locate/point_stereo/curve",
    "/{target}/locate/point_stereo/match",
    "/{target}/locate/match_features/partners",
];

/// What of a target is on the map.
const MAP: [&str; 14] = [
    "/{target}/predict/position",
    "/{target}/predict/covariance",
    "/{target}/locate/triangulate/position",
    "/{target}/locate/triangulate/covariance",
    "/{target}/locate/triangulate/points",
    "/{target}/locate/bootstrap/cloud",
    "/{target}/locate/bootstrap/position",
    "/{target}/locate/bootstrap/covariance",
    "/{target}/locate/refine_register/mesh_fixed",
    "/{target}/locate/refine_register/mesh_moving",
    "/{target}/locate/refine_register/position",
    "/{target}/locate/refine_register/covariance",
    "/{target}/update/position",
    "/truth/{target}/position",
];

/// The patches, in the order of the strip.
const PATCHES: [(&str, &str); 6] = [
    ("reference", "/{target}/locate/scale_roll/reference"),
    ("scaled", "/{target}/locate/scale_roll/scaled"),
    ("rolled", "/{target}/locate/scale_roll/rolled"),
    ("matched", "/{target}/locate/match_template/matched"),
    ("difference", "/{target}/locate/match_template/difference"),
    ("right", "/{target}/locate/point_stereo/right_window"),
];

/// What the shape tracker saw, in the order of its steps.
#[rustfmt::skip]
const SHAPE: [(&str, &str); 9] = [
    ("disparities, px", "/{target}/locate/surface/disparities"),
    ("ranges, m", "/{target}/locate/surface/ranges"),
    ("earlier surface, m", "/{target}/locate/coarse_register/sensor"),
    ("error at the start", "/{target}/locate/coarse_register/error_before"),
    ("after the coarse search", "/{target}/locate/coarse_register/error_coarse"),
    ("at the end", "/{target}/locate/refine_register/error_fine"),
    ("coarse search, m", "/{target}/locate/coarse_register/coarse_search"),
    ("draped picture", "/{target}/locate/hand_off/draped"),
    ("where it was found", "/{target}/locate/hand_off/draped_match"),
];

/// The meshes with the target.
const MESHES: [&str; 4] = [
    "/{target}/locate/refine_register/mesh_fixed",
    "/{target}/locate/refine_register/mesh_moving",
    "/{target}/locate/refine_register/position",
    "/{target}/locate/refine_register/covariance",
];

/// How well the surfaces fit.
#[rustfmt::skip]
const FIT: [Series; 4] = [
    ("mean distance, m", Corner2D::LeftTop, &["/{target}/locate/coarse_register/mean_m", "/{target}/locate/refine_register/mean_m"]),
    ("overlap", Corner2D::LeftBottom, &["/{target}/locate/refine_register/overlap/**"]),
    ("misfit", Corner2D::LeftTop, &["/{target}/locate/refine_register/misfit/**"]),
    ("sigma, m", Corner2D::LeftTop, &["/{target}/locate/refine_register/sigma_m/**"]),
];

/// A time series: its name, the corner that its lines mostly leave free, and its lines.
type Series = (&'static str, Corner2D, &'static [&'static str]);

/// What the tracker decided on.
#[rustfmt::skip]
const DECISIONS: [Series; 7] = [
    ("scores", Corner2D::LeftBottom, &["/{target}/judge/ncc/**", "/{target}/judge/stereo_ncc/**", "/{target}/locate/match_template/second_peak_ratio"]),
    ("confidence", Corner2D::LeftBottom, &["/{target}/judge/confidence/**"]),
    ("inliers", Corner2D::LeftBottom, &["/{target}/locate/fit_motion/inliers"]),
    ("gates, m", Corner2D::LeftTop, &["/{target}/judge/distance_correction_m/**", "/{target}/judge/position_correction_m/**"]),
    ("scale and roll", Corner2D::LeftTop, &["/{target}/locate/scale_roll/scale", "/{target}/locate/scale_roll/roll_deg"]),
    ("pointing, deg", Corner2D::LeftBottom, &["/{target}/point_mast/wanted_azimuth_deg", "/{target}/point_mast/used_azimuth_deg", "/{target}/point_mast/wanted_elevation_deg", "/{target}/point_mast/used_elevation_deg"]),
    ("exposure", Corner2D::LeftTop, &["/{target}/capture/subframe_mean", "/{target}/capture/subframe_saturated"]),
];

/// How right it was.
#[rustfmt::skip]
const ERRORS: [Series; 4] = [
    ("pixels", Corner2D::LeftTop, &["/truth/{target}/err_px", "/truth/{target}/tolerance_px", "/{target}/update/correction_px", "/{target}/locate/point_stereo/across_px", "/{target}/locate/triangulate/gap_px"]),
    ("metres", Corner2D::RightTop, &["/truth/{target}/err_m", "/{target}/update/sigma_m", "/{target}/update/correction_m"]),
    ("range, m", Corner2D::LeftBottom, &["/{target}/locate/point_stereo/range_m"]),
    ("nees", Corner2D::LeftTop, &["/truth/{target}/nees"]),
];

/// One run as the layout needs it.
pub(super) struct Lane<'a> {
    /// Its name in entity paths.
    pub(super) root: &'a str,
    /// Width and height of the close-up, px.
    pub(super) close_up_px: [u32; 2],
    /// Whether its tracker asks for the shape: such a run has a tab more.
    pub(super) has_shape: bool,
}

/// Sends the layout for these runs; a live one follows the newest step.
pub(super) fn send(
    stream: &rerun::RecordingStream,
    lanes: &[Lane<'_>],
    outlook: &Outlook,
    live: bool,
) -> Logged {
    let roots: Vec<_> = lanes.iter().map(|lane| lane.root).collect();
    let mut layout = Layout::default();
    let pictures = Horizontal::new([
        picture("left image", "/capture/left", &LEFT, &roots),
        picture("right image", "/capture/right", &RIGHT, &roots),
        map(&mut layout, outlook, &roots),
    ]);
    let runs = Tabs::new(lanes.iter().map(|lane| run(&mut layout, lane)).collect::<Vec<_>>());
    let states = StateTimelineView::new("states").with_contents(of_all(&["/{target}/judge/state"], &roots));
    let words = Horizontal::new([states.into(), words(&roots)]);
    let rows = Vertical::new([pictures.into(), runs.into(), words.into()]).with_row_shares([4.0, 4.0, 2.0]);
    let play = if live { PlayState::Following } else { PlayState::Paused };
    let time = TimePanel::new().with_state(PanelState::Collapsed).with_timeline("step").with_fps(2.0);
    let blueprint = Blueprint::new(rows)
        .with_auto_views(false)
        .with_auto_layout(false)
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
        .with_time_panel(time.with_play_state(play));
    layout.send(&blueprint, stream)
}

fn picture(name: &str, origin: &str, overlays: &[&str], roots: &[&str]) -> ContainerLike {
    let contents = std::iter::once("$origin".to_owned()).chain(of_all(overlays, roots));
    Spatial2DView::new(name).with_origin(origin).with_contents(contents).into()
}

fn map(layout: &mut Layout, outlook: &Outlook, roots: &[&str]) -> ContainerLike {
    let contents = std::iter::once("/rover/**".to_owned()).chain(of_all(&MAP, roots));
    let view = Spatial3DView::new("map").with_origin("/").with_contents(contents);
    let eye = EyeControls3D::new()
        .with_position(point_3d(&outlook.eye))
        .with_look_target(point_3d(&outlook.target))
        .with_eye_up([0.0, 0.0, -1.0]);
    let view = layout.view(view, "EyeControls3D", eye);
    // The truth is white, so the sky must be dark in any theme.
    let background = Background::new(BackgroundKind::SolidColor).with_color(color(MAP_BACKGROUND));
    layout.view(view, "Background", background)
}

/// What one run shows below the images.
fn run(layout: &mut Layout, lane: &Lane<'_>) -> ContainerLike {
    let patch = |(name, entity): (&str, &str)| -> ContainerLike {
        Spatial2DView::new(name).with_origin(path(entity, lane.root)).with_contents(["$origin"]).into()
    };
    let surface = Spatial2DView::new("surface of scores")
        .with_origin(path("/{target}/locate/match_template/surface", lane.root))
        .with_contents(["$origin/**"]);
    let matched = Horizontal::new([
        close_up(layout, lane),
        Grid::new(PATCHES.map(patch)).with_grid_columns(3).into(),
        surface.into(),
        time_series(layout, &DECISIONS, lane.root),
        time_series(layout, &ERRORS, lane.root),
    ])
    .with_column_shares([5.0, 7.0, 5.0, 5.0, 5.0]);
    if !lane.has_shape {
        return matched.with_name(lane.root).into();
    }
    let shape = shape(layout, lane);
    Tabs::new([matched.with_name("Match").into(), shape]).with_name(lane.root).into()
}

/// What the shape tracker of a run shows.
fn shape(layout: &mut Layout, lane: &Lane<'_>) -> ContainerLike {
    let picture = |(name, entity): (&str, &str)| -> ContainerLike {
        let view = Spatial2DView::new(name).with_origin(path(entity, lane.root));
        view.with_contents(["$origin/**"]).into()
    };
    let meshes = Spatial3DView::new("meshes").with_origin("/").with_contents(of_all(&MESHES, &[lane.root]));
    let background = Background::new(BackgroundKind::SolidColor).with_color(color(MAP_BACKGROUND));
    let meshes = layout.view(meshes, "Background", background);
    Horizontal::new([
        Grid::new(SHAPE.map(picture)).with_grid_columns(5).into(),
        meshes,
        time_series(layout, &FIT, lane.root),
    ])
    .with_name("Shape")
    .with_column_shares([14.0, 7.0, 6.0])
    .into()
}

fn close_up(layout: &mut Layout, lane: &Lane<'_>) -> ContainerLike {
    let contents = std::iter::once("/capture/left".to_owned()).chain(of_all(&LEFT, &[lane.root]));
    let view = Spatial2DView::new("close-up")
        .with_origin(path("/{target}/capture/frame", lane.root))
        .with_contents(contents);
    let [x_range, y_range] = lane.close_up_px.map(|length| [0.0, f64::from(length)].into());
    layout.view(view, "VisualBounds2D", VisualBounds2D::new(Bounds(Range2D { x_range, y_range })))
}

fn time_series(layout: &mut Layout, series: &[Series], root: &str) -> ContainerLike {
    let views = series.iter().map(|(name, corner, entities)| {
        let contents = entities.iter().map(|entity| path(entity, root));
        let view = TimeSeriesView::new(*name).with_contents(contents);
        layout.view(view, "PlotLegend", PlotLegend::new().with_corner(*corner))
    });
    Tabs::new(views.collect::<Vec<_>>()).into()
}

fn words(roots: &[&str]) -> ContainerLike {
    let log: ContainerLike =
        TextLogView::new("log").with_contents(of_all(&["/{target}/judge/verdict"], roots)).into();
    let about = TextDocumentView::new("traverse").with_origin("/traverse").with_contents(["$origin"]).into();
    let labels = roots.iter().map(|root| {
        TextDocumentView::new(*root).with_origin(path("/{target}", root)).with_contents(["$origin"]).into()
    });
    Tabs::new([log, about].into_iter().chain(labels)).into()
}

fn of_all(entities: &[&str], roots: &[&str]) -> Vec<String> {
    roots.iter().flat_map(|root| entities.iter().map(|entity| path(entity, root))).collect()
}
