//! How a viewer lays a recording out.
//!
//! ```text
//! ┌ left image ────────┬ right image ───────┬ map ───────────────┐
//! ├ one tab per run ───┴────────────────────┴────────────────────┤
//! │ six patches        │ surface of scores  │ four time series   │
//! ├ states over time ──┴────────────────────┼ log │ about ───────┤
//! └─────────────────────────────────────────┴────────────────────┘
//! ```
//! An entity shows only in the views that name it: what lies over the left image is listed here and not found
//! by its path, because paths follow the stages and not the pictures.

use rerun::blueprint::components::{PanelState, PlayState};
use rerun::blueprint::{
    Blueprint, BlueprintPanel, ContainerLike, Grid, Horizontal, SelectionPanel, Spatial2DView, Spatial3DView,
    StateTimelineView, Tabs, TextDocumentView, TextLogView, TimePanel, TimeSeriesView, Vertical,
};

use super::step::path;

/// What lies over the left image.
const LEFT: [&str; 10] = [
    "/{target}/predict/left",
    "/{target}/point_mast/gate",
    "/{target}/capture/subframe",
    "/{target}/locate/scale_roll/footprint",
    "/{target}/locate/match_template/window",
    "/{target}/locate/match_template/matched_window",
    "/{target}/locate/match_template/peak",
    "/{target}/locate/match_template/second_peak",
    "/{target}/locate/left_covariance",
    "/truth/{target}/left",
];

/// What lies over the right image.
const RIGHT: [&str; 3] =
    ["/{target}/predict/right", "/{target}/locate/point_stereo/curve", "/{target}/locate/point_stereo/match"];

/// What of a target is on the map.
const MAP: [&str; 6] = [
    "/{target}/predict/position",
    "/{target}/predict/covariance",
    "/{target}/locate/triangulate/position",
    "/{target}/locate/triangulate/covariance",
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
    ("right window", "/{target}/locate/point_stereo/right_window"),
];

/// The time series, each with numbers of one unit.
const SERIES: [(&str, &[&str]); 6] = [
    (
        "scores",
        &[
            "/{target}/judge/ncc/**",
            "/{target}/judge/stereo_ncc/**",
            "/{target}/locate/match_template/second_peak_ratio",
        ],
    ),
    ("pixels", &["/truth/{target}/err_px", "/truth/{target}/tolerance_px", "/{target}/update/correction_px"]),
    ("metres", &["/truth/{target}/err_m", "/{target}/update/sigma_m", "/{target}/update/correction_m"]),
    ("scale and roll", &["/{target}/locate/scale_roll/scale", "/{target}/locate/scale_roll/roll_deg"]),
    (
        "gates in metres",
        &["/{target}/judge/distance_correction_m/**", "/{target}/judge/position_correction_m/**"],
    ),
    (
        "pointing",
        &[
            "/{target}/point_mast/wanted_azimuth_deg",
            "/{target}/point_mast/used_azimuth_deg",
            "/{target}/point_mast/wanted_elevation_deg",
            "/{target}/point_mast/used_elevation_deg",
        ],
    ),
];

/// The layout for the runs called `roots` in paths; a live one follows the newest step.
pub(super) fn blueprint(roots: &[String], live: bool) -> Blueprint {
    let pictures = Horizontal::new([
        view_2d("left image", "/capture/left", &LEFT, roots),
        view_2d("right image", "/capture/right", &RIGHT, roots),
        map(roots),
    ])
    .with_column_shares([1.0, 1.0, 1.0]);
    let runs = Tabs::new(roots.iter().map(|root| run(root)));
    let words = Horizontal::new([
        StateTimelineView::new("states").with_contents(of_all(&["/{target}/judge/state"], roots)).into(),
        words(roots),
    ]);
    let rows = Vertical::new([pictures.into(), runs.into(), words.into()]).with_row_shares([4.0, 4.0, 2.0]);
    let play = if live { PlayState::Following } else { PlayState::Paused };
    Blueprint::new(rows)
        .with_auto_views(false)
        .with_auto_layout(false)
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
        .with_time_panel(
            TimePanel::new()
                .with_state(PanelState::Collapsed)
                .with_timeline("step")
                .with_fps(2.0)
                .with_play_state(play),
        )
}

fn view_2d(name: &str, origin: &str, overlays: &[&str], roots: &[String]) -> ContainerLike {
    let contents = std::iter::once("$origin".to_owned()).chain(of_all(overlays, roots));
    Spatial2DView::new(name).with_origin(origin).with_contents(contents).into()
}

fn map(roots: &[String]) -> ContainerLike {
    let contents = std::iter::once("/rover/**".to_owned()).chain(of_all(&MAP, roots));
    Spatial3DView::new("map").with_origin("/").with_contents(contents).into()
}

/// What one run shows below the images.
fn run(root: &str) -> ContainerLike {
    let patch = |(name, entity): (&str, &str)| -> ContainerLike {
        Spatial2DView::new(name).with_origin(path(entity, root)).with_contents(["$origin"]).into()
    };
    let surface = Spatial2DView::new("surface of scores")
        .with_origin(path("/{target}/locate/match_template/surface", root))
        .with_contents(["$origin/**"]);
    let series = |(name, entities): (&str, &[&str])| -> ContainerLike {
        let contents = entities.iter().map(|entity| path(entity, root));
        TimeSeriesView::new(name).with_contents(contents).into()
    };
    Horizontal::new([
        Grid::new(PATCHES.map(patch)).with_grid_columns(3).into(),
        surface.into(),
        Grid::new(SERIES.map(series)).with_grid_columns(2).into(),
    ])
    .with_name(root)
    .with_column_shares([3.0, 2.0, 4.0])
    .into()
}

fn words(roots: &[String]) -> ContainerLike {
    let log: ContainerLike =
        TextLogView::new("log").with_contents(of_all(&["/{target}/judge/verdict"], roots)).into();
    let about = TextDocumentView::new("traverse").with_origin("/traverse").with_contents(["$origin"]).into();
    let labels = roots.iter().map(|root| {
        TextDocumentView::new(root).with_origin(path("/{target}", root)).with_contents(["$origin"]).into()
    });
    Tabs::new([log, about].into_iter().chain(labels)).into()
}

fn of_all(entities: &[&str], roots: &[String]) -> Vec<String> {
    roots.iter().flat_map(|root| entities.iter().map(|entity| path(entity, root))).collect()
}
