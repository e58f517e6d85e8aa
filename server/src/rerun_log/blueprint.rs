//! The layout of a recording in the Rerun viewer.
//!
//! ```text
//! ┌ left image ────────┬ right image ───────┬ map ───────────────┐
//! ├ one tab per run ───┴────────────────────┴────────────────────┤
//! │ close-up    │ six patches  │ score map  │ time series in tabs │
//! ├ states over time ──┴────────────────────┼ log │ about ───────┤
//! └─────────────────────────────────────────┴────────────────────┘
//! ```
//! A view shows exactly the entities that it lists. Overlays of the left image are listed here instead of being found by
//! path, because paths follow the stages and not the images. The close-up shows the same entities as the left image, in the
//! frame of the subframe, which moves with the target. A run with the shape tracker has two tabs, “Match” and “Shape”; the
//! second has the shape tracker's images, the meshes and how well they fit. If stops have odometry, a tab beside the left
//! image shows its corners. For a commanded drive, the map also shows goal, ground and paths, and the log its decisions.

use std::collections::BTreeSet;

use rerun::AsComponents;
use rerun::blueprint::components::ContainerKind::{Grid, Horizontal, Tabs, Vertical};
use rerun::blueprint::components::{
    BackgroundKind, Corner2D, Fps, PanelState, PlayState, TimelineName, VisualBounds2D as Bounds,
};
use rerun::datatypes::{Float64, Range2D};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, EyeControls3D, PanelBlueprint, PlotLegend, TimePanelBlueprint, VisualBounds2D,
};

use sightline_geometry::camera::CameraName;

use super::Logged;
use super::convert::point_3d;
use super::images;
use super::layout::{self, Container, LayoutNode, View};
use super::map::Outlook;
use super::palette::{MAP_BACKGROUND, color};
use super::step::path;

/// Overlays of the left image.
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

/// Overlays of the right image.
const RIGHT: [&str; 4] = [
    "/{target}/predict/right",
    "/{target}/locate/point_stereo/curve",
    "/{target}/locate/point_stereo/match",
    "/{target}/locate/match_features/partners",
];

/// Entities of a target on the map.
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

/// The patches, in display order.
const PATCHES: [(&str, &str); 6] = [
    ("reference", "/{target}/locate/scale_roll/reference"),
    ("scaled", "/{target}/locate/scale_roll/scaled"),
    ("rolled", "/{target}/locate/scale_roll/rolled"),
    ("matched", "/{target}/locate/match_template/matched"),
    ("difference", "/{target}/locate/match_template/difference"),
    ("right", "/{target}/locate/point_stereo/right_window"),
];

/// Images of the shape tracker, in the order of its stages.
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

/// The meshes and the target.
const MESHES: [&str; 4] = [
    "/{target}/locate/refine_register/mesh_fixed",
    "/{target}/locate/refine_register/mesh_moving",
    "/{target}/locate/refine_register/position",
    "/{target}/locate/refine_register/covariance",
];

/// Quality of the mesh registration.
#[rustfmt::skip]
const FIT: [Series; 4] = [
    ("mean distance, m", Corner2D::LeftTop, &["/{target}/locate/coarse_register/mean_m", "/{target}/locate/refine_register/mean_m"]),
    ("overlap", Corner2D::LeftBottom, &["/{target}/locate/refine_register/overlap/**"]),
    ("misfit", Corner2D::LeftTop, &["/{target}/locate/refine_register/misfit/**"]),
    ("sigma, m", Corner2D::LeftTop, &["/{target}/locate/refine_register/sigma_m/**"]),
];

/// A time series: its name, the legend corner, which its lines rarely cross, and its entities.
type Series = (&'static str, Corner2D, &'static [&'static str]);

/// Quantities that determine the tracker's decisions.
#[rustfmt::skip]
const DECISIONS: [Series; 8] = [
    ("scores", Corner2D::LeftBottom, &["/{target}/judge/ncc/**", "/{target}/judge/stereo_ncc/**", "/{target}/locate/match_template/second_peak_ratio"]),
    ("confidence", Corner2D::LeftBottom, &["/{target}/judge/confidence/**"]),
    ("inliers", Corner2D::LeftBottom, &["/{target}/locate/fit_motion/inliers"]),
    ("gates, m", Corner2D::LeftTop, &["/{target}/judge/distance_correction_m/**", "/{target}/judge/position_correction_m/**"]),
    ("scale and roll", Corner2D::LeftTop, &["/{target}/locate/scale_roll/scale", "/{target}/locate/scale_roll/roll_deg"]),
    ("pointing, deg", Corner2D::LeftBottom, &["/{target}/point_mast/wanted_azimuth_deg", "/{target}/point_mast/used_azimuth_deg", "/{target}/point_mast/wanted_elevation_deg", "/{target}/point_mast/used_elevation_deg"]),
    ("slip", Corner2D::LeftTop, &["/{target}/record/visual_odometry/slip", "/{target}/record/visual_odometry/slip_aside"]),
    ("exposure", Corner2D::LeftTop, &["/{target}/capture/subframe_mean", "/{target}/capture/subframe_saturated"]),
];

/// Errors against the ground truth.
#[rustfmt::skip]
const ERRORS: [Series; 4] = [
    ("pixels", Corner2D::LeftTop, &["/truth/{target}/err_px", "/truth/{target}/tolerance_px", "/{target}/update/correction_px", "/{target}/locate/point_stereo/across_px", "/{target}/locate/triangulate/gap_px"]),
    ("metres", Corner2D::RightTop, &["/truth/{target}/err_m", "/{target}/update/sigma_m", "/{target}/update/correction_m"]),
    ("range, m", Corner2D::LeftBottom, &["/{target}/locate/point_stereo/range_m"]),
    ("nees", Corner2D::LeftTop, &["/truth/{target}/nees"]),
];

/// A run as seen by the layout.
pub(super) struct Lane<'a> {
    /// Its name in entity paths.
    pub(super) root: &'a str,
    /// Width and height of the close-up, px.
    pub(super) close_up_px: [u32; 2],
    /// Whether it uses the shape tracker, which needs another tab.
    pub(super) has_shape: bool,
    /// The pair used for tracking its target; `None` for the main pair.
    pub(super) camera: Option<CameraName>,
}

/// Sends the layout for these runs; a live recording follows the newest step, and one with odometry has a tab for it.
pub(super) fn send(
    stream: &rerun::RecordingStream,
    lanes: &[Lane<'_>],
    outlook: &Outlook,
    (odometry, live): (&BTreeSet<Option<CameraName>>, bool),
) -> Logged {
    let roots: Vec<_> = lanes.iter().map(|lane| lane.root).collect();
    let pictures =
        Container::new(Horizontal, pictures(lanes, odometry).into_iter().chain([map(outlook, &roots)]));
    let runs = Container::new(Tabs, lanes.iter().map(run));
    let states = View::new("StateTimeline", "states", of_all(&["/{target}/judge/state"], &roots));
    let words = Container::new(Horizontal, [states.into(), words(&roots)]);
    let rows = Container::new(Vertical, [pictures.into(), runs.into(), words.into()]);
    let collapsed = PanelBlueprint::new().with_state(PanelState::Collapsed);
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TimelineName("step".into()))
        .with_fps(Fps(Float64(2.0)))
        .with_play_state(if live { PlayState::Following } else { PlayState::Paused });
    let panels: [(&str, &dyn AsComponents); 3] =
        [("blueprint_panel", &collapsed), ("selection_panel", &collapsed), ("time_panel", &time)];
    layout::send(rows.with_shares([4.0, 4.0, 2.0]), &panels, stream)
}

/// The images of every pair used for tracking, each with the overlays of its runs.
fn pictures(lanes: &[Lane<'_>], odometry: &BTreeSet<Option<CameraName>>) -> Vec<LayoutNode> {
    let cameras: BTreeSet<_> = lanes.iter().map(|lane| lane.camera).collect();
    let of_camera = |camera: Option<CameraName>| {
        let own = lanes.iter().filter(|lane| lane.camera == camera);
        let roots: Vec<_> = own.map(|lane| lane.root).collect();
        let of = camera.map_or_else(String::new, |name| format!("{name}: "));
        [("left", &LEFT[..]), ("right", &RIGHT[..])].map(|(eye, overlays)| {
            let shown =
                picture(&format!("{of}{eye} image"), &images::of_camera(camera, eye), overlays, &roots);
            if eye == "right" || camera.is_some() || odometry.is_empty() {
                return shown;
            }
            let corners = odometry.iter().map(|pair| {
                let name =
                    pair.map_or_else(|| "odometry".to_owned(), |name| format!("odometry, camera {name}"));
                View::new("2D", &name, ["$origin/**"]).with_origin(images::of_camera(*pair, "left")).into()
            });
            Container::new(Tabs, std::iter::once(shown).chain(corners)).into()
        })
    };
    cameras.into_iter().flat_map(of_camera).collect()
}

fn picture(name: &str, origin: &str, overlays: &[&str], roots: &[&str]) -> LayoutNode {
    let contents = std::iter::once("$origin".to_owned()).chain(of_all(overlays, roots));
    View::new("2D", name, contents).with_origin(origin).into()
}

fn map(outlook: &Outlook, roots: &[&str]) -> LayoutNode {
    let of_rover = ["/rover/**", "/drive/**"].map(str::to_owned);
    let contents = of_rover.into_iter().chain(of_all(&MAP, roots));
    let eye = EyeControls3D::new()
        .with_position(point_3d(&outlook.eye))
        .with_look_target(point_3d(&outlook.target))
        .with_eye_up([0.0, 0.0, -1.0]);
    View::new("3D", "map", contents)
        .with_property("EyeControls3D", eye)
        .with_property("Background", background())
        .into()
}

/// The ground truth is white, so the background must be dark in any theme.
fn background() -> Background {
    Background::new(BackgroundKind::SolidColor).with_color(color(MAP_BACKGROUND))
}

/// The views of one run below the images.
fn run(lane: &Lane<'_>) -> LayoutNode {
    let patch = |(name, entity): (&str, &str)| -> LayoutNode {
        View::new("2D", name, ["$origin"]).with_origin(path(entity, lane.root)).into()
    };
    let surface = View::new("2D", "surface of scores", ["$origin/**"])
        .with_origin(path("/{target}/locate/match_template/surface", lane.root));
    let matched = Container::new(
        Horizontal,
        [
            close_up(lane),
            Container::new(Grid, PATCHES.map(patch)).with_columns(3).into(),
            surface.into(),
            time_series(&DECISIONS, lane.root),
            time_series(&ERRORS, lane.root),
        ],
    )
    .with_shares([5.0, 7.0, 5.0, 5.0, 5.0]);
    if !lane.has_shape {
        return matched.with_name(lane.root).into();
    }
    Container::new(Tabs, [matched.with_name("Match").into(), shape(lane)]).with_name(lane.root).into()
}

/// The views of the shape tracker of a run.
fn shape(lane: &Lane<'_>) -> LayoutNode {
    let picture = |(name, entity): (&str, &str)| -> LayoutNode {
        View::new("2D", name, ["$origin/**"]).with_origin(path(entity, lane.root)).into()
    };
    let meshes = View::new("3D", "meshes", of_all(&MESHES, &[lane.root]));
    let parts = [
        Container::new(Grid, SHAPE.map(picture)).with_columns(5).into(),
        meshes.with_property("Background", background()).into(),
        time_series(&FIT, lane.root),
    ];
    Container::new(Horizontal, parts).with_name("Shape").with_shares([14.0, 7.0, 6.0]).into()
}

fn close_up(lane: &Lane<'_>) -> LayoutNode {
    let contents = std::iter::once(images::of_camera(lane.camera, "left")).chain(of_all(&LEFT, &[lane.root]));
    let [x_range, y_range] = lane.close_up_px.map(|length| [0.0, f64::from(length)].into());
    View::new("2D", "close-up", contents)
        .with_origin(path("/{target}/capture/frame", lane.root))
        .with_property("VisualBounds2D", VisualBounds2D::new(Bounds(Range2D { x_range, y_range })))
        .into()
}

fn time_series(series: &[Series], root: &str) -> LayoutNode {
    let view = |(name, corner, entities): &Series| -> LayoutNode {
        let contents = entities.iter().map(|entity| path(entity, root));
        let legend = PlotLegend::new().with_corner(*corner);
        View::new("TimeSeries", *name, contents).with_property("PlotLegend", legend).into()
    };
    Container::new(Tabs, series.iter().map(view)).into()
}

fn words(roots: &[&str]) -> LayoutNode {
    let decisions = std::iter::once("/drive/decision".to_owned());
    let log = View::new("TextLog", "log", decisions.chain(of_all(&["/{target}/judge/verdict"], roots)));
    let document = |name: &str, origin: String| -> LayoutNode {
        View::new("TextDocument", name, ["$origin"]).with_origin(origin).into()
    };
    let labels = roots.iter().map(|root| document(root, path("/{target}", root)));
    let about = document("traverse", "/traverse".to_owned());
    Container::new(Tabs, [log.into(), about].into_iter().chain(labels)).into()
}

fn of_all(entities: &[&str], roots: &[&str]) -> Vec<String> {
    roots.iter().flat_map(|root| entities.iter().map(|entity| path(entity, root))).collect()
}
