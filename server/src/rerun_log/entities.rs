//! Every entity of a recording, in the order in which a step logs them. A test compares this table with the contents of a
//! file; the module's header prints it.

use sightline_session::records::StageQuantity;
use sightline_session::step::RunStep;
use sightline_track::trace::ArrayName;

use super::scores::{self, SCORES, Score};
use super::shape;
use super::step::path;

/// Number of rows of an entity.
#[derive(Clone, Copy, Debug)]
pub enum Rows {
    /// One static row.
    Once,
    /// One row for every stop of the traverse.
    EachStop,
    /// One row for every step of the run: data if the condition is met, else a `Clear`. Entities shared by all runs have one
    /// row for every step of any run.
    EachStep {
        /// The condition for data, in words.
        when: &'static str,
        /// Whether this step has data.
        holds: fn(&RunStep) -> bool,
    },
    /// As `EachStep`, with a number as data.
    EachScore {
        /// The condition for a number, in words.
        when: &'static str,
        /// The number of this step.
        value: Number,
    },
}

/// The source of an entity's number.
#[derive(Clone, Copy, Debug)]
pub struct Number(Reader);

#[derive(Clone, Copy, Debug)]
enum Reader {
    Score(&'static Score),
    Declared(StageQuantity),
}

impl Number {
    fn at(self, trace: &RunStep) -> Option<f64> {
        match self.0 {
            Reader::Score(score) => score.at(trace),
            Reader::Declared(quantity) => quantity.number(trace),
        }
    }
}

/// Description of one entity of a recording.
#[derive(Clone, Debug)]
pub struct EntityDoc {
    /// Its path.
    pub path: String,
    /// The archetype of its rows.
    pub archetype: &'static str,
    /// The archetype of the static row with the drawing style.
    pub style: Option<&'static str>,
    /// Number of rows.
    pub rows: Rows,
}

impl EntityDoc {
    /// Whether the entity has data at a step.
    pub fn has_data_at(&self, trace: &RunStep) -> bool {
        match self.rows {
            Rows::Once => false,
            Rows::EachStop => true,
            Rows::EachStep { holds, .. } => holds(trace),
            Rows::EachScore { value, .. } => value.at(trace).is_some(),
        }
    }
}

/// The entities shared by all runs of a recording.
pub fn shared_entities() -> Vec<EntityDoc> {
    let doc =
        |path: &str, archetype, style, rows| EntityDoc { path: path.to_owned(), archetype, style, rows };
    let measured = Rows::EachStep {
        when: "the stop has odometry in the main pair",
        holds: |t| t.odometry.as_ref().is_some_and(|measured| measured.camera.is_none()),
    };
    let captured = Rows::EachStep { when: "the stop's files are whole", holds: |t| t.capture().is_some() };
    vec![
        doc("/", "ViewCoordinates", None, Rows::Once),
        doc("/traverse", "TextDocument", None, Rows::Once),
        doc("/rover/path", "LineStrips3D", None, Rows::Once),
        doc("/rover/pose", "Transform3D", Some("TransformAxes3D"), Rows::EachStop),
        doc("/rover/pose/left", "LineStrips3D", None, Rows::EachStop),
        doc("/rover/pose/right", "LineStrips3D", None, Rows::EachStop),
        doc("/capture/left", "EncodedImage", None, captured),
        doc("/capture/right", "EncodedImage", None, captured),
        doc("/capture/left/odometry/before", "Points2D", None, measured),
        doc("/capture/left/odometry/after", "Points2D", None, measured),
        doc("/capture/left/odometry/flow", "LineStrips2D", None, measured),
    ]
}

/// The entities of the run with the path name `root`.
pub fn entities_of(root: &str) -> Vec<EntityDoc> {
    let docs = EVIDENCE.iter().map(|&(entity, archetype, when, holds)| {
        let style = (archetype == "StateChange").then_some("StateConfiguration");
        EntityDoc { path: path(entity, root), archetype, style, rows: Rows::EachStep { when, holds } }
    });
    let plotted = SCORES.iter().map(|score| EntityDoc {
        path: path(score.entity, root),
        archetype: "Scalars",
        style: Some("SeriesLines"),
        rows: Rows::EachScore { when: score.when, value: Number(Reader::Score(score)) },
    });
    let declared = scores::declared().map(|number| EntityDoc {
        path: path(&scores::entity_of(number), root),
        archetype: "Scalars",
        style: Some("SeriesLines"),
        rows: Rows::EachScore { when: "the quantity exists", value: Number(Reader::Declared(number)) },
    });
    let label =
        EntityDoc { path: path("/{target}", root), archetype: "TextDocument", style: None, rows: Rows::Once };
    std::iter::once(label).chain(docs).chain(plotted).chain(declared).collect()
}

/// All entities of a recording with `targets` targets of one run each.
pub fn documented_entities(targets: usize) -> Vec<EntityDoc> {
    let own = (0..targets).flat_map(|target| entities_of(&super::root(target, 0)));
    shared_entities().into_iter().chain(own).collect()
}

/// Entity, archetype, condition for data in words, and the condition itself.
type Evidence = (&'static str, &'static str, &'static str, fn(&RunStep) -> bool);

/// The entities of a run except for its numbers, in the order of the stages.
#[rustfmt::skip]
const EVIDENCE: &[Evidence] = &[
    ("/{target}/predict/position", "Points3D", "predicted", |t| t.prediction().is_some()),
    ("/{target}/predict/covariance", "Ellipsoids3D", "predicted", |t| t.prediction().is_some()),
    ("/{target}/predict/left", "Points2D", "predicted in front of the left camera", predicted_left),
    ("/{target}/predict/right", "Points2D", "predicted in front of the right camera", predicted_right),
    ("/{target}/point_mast/gate", "LineStrips2D", "predicted in front of the left camera", predicted_left),
    ("/{target}/capture/subframe", "Boxes2D", "the subframe lies in the image", |t| t.capture().is_some_and(|c| c.subframe.is_some())),
    ("/{target}/capture/frame", "Transform3D", "the subframe lies in the image", |t| t.capture().is_some_and(|c| c.subframe.is_some())),
    ("/{target}/locate/scale_roll/footprint", "LineStrips2D", "prepared", |t| prepared(t) && predicted_left(t)),
    ("/{target}/locate/scale_roll/reference", "DepthImage", "prepared", prepared),
    ("/{target}/locate/scale_roll/scaled", "DepthImage", "prepared", prepared),
    ("/{target}/locate/scale_roll/rolled", "DepthImage", "prepared", prepared),
    ("/{target}/locate/match_template/window", "Boxes2D", "matched", matched),
    ("/{target}/locate/match_template/surface", "DepthImage", "matched", matched),
    ("/{target}/locate/match_template/surface/peak", "Points2D", "matched", matched),
    ("/{target}/locate/match_template/surface/second_peak", "Points2D", "there is a second peak", second_peak),
    ("/{target}/locate/match_template/peak", "Points2D", "matched", matched),
    ("/{target}/locate/match_template/second_peak", "Points2D", "there is a second peak", second_peak),
    ("/{target}/locate/match_template/matched_window", "LineStrips2D", "matched", matched),
    ("/{target}/locate/match_template/matched", "DepthImage", "matched", matched),
    ("/{target}/locate/match_template/difference", "Image", "matched", matched),
    ("/{target}/locate/point_stereo/curve", "LineStrips2D", "stereo matched", stereo_matched),
    ("/{target}/locate/point_stereo/match", "Points2D", "stereo matched", stereo_matched),
    ("/{target}/locate/point_stereo/right_window", "DepthImage", "stereo matched", stereo_matched),
    ("/{target}/locate/triangulate/position", "Points3D", "triangulated", triangulated),
    ("/{target}/locate/triangulate/covariance", "Ellipsoids3D", "triangulated", triangulated),
    ("/{target}/locate/detect/keypoints", "Points2D", "features were looked for", detected),
    ("/{target}/locate/match_features/partners", "Points2D", "features were looked for", detected),
    ("/{target}/locate/triangulate/points", "Points3D", "features were looked for", detected),
    ("/{target}/locate/match_features/inliers", "LineStrips2D", "a motion was fitted", fitted),
    ("/{target}/locate/match_features/outliers", "LineStrips2D", "a motion was fitted", fitted),
    ("/{target}/locate/fit_motion/residuals", "Arrows2D", "a motion was fitted", fitted),
    ("/{target}/locate/bootstrap/cloud", "Points3D", "the motion has a covariance", bootstrapped),
    ("/{target}/locate/bootstrap/left", "Points2D", "the motion has a covariance", bootstrapped),
    ("/{target}/locate/bootstrap/position", "Points3D", "the target was moved", moved),
    ("/{target}/locate/bootstrap/covariance", "Ellipsoids3D", "the target was moved", moved),
    ("/{target}/locate/surface/disparities", "DepthImage", "a surface was measured", |t| shape::has(t, ArrayName::DISPARITIES)),
    ("/{target}/locate/surface/ranges", "DepthImage", "a surface was measured", |t| shape::has(t, ArrayName::RANGES)),
    ("/{target}/locate/coarse_register/sensor", "DepthImage", "surfaces were compared", |t| shape::has(t, ArrayName::SENSOR)),
    ("/{target}/locate/coarse_register/error_before", "Image", "surfaces were compared", |t| shape::has(t, ArrayName::ERROR_BEFORE)),
    ("/{target}/locate/coarse_register/coarse_search", "DepthImage", "shifts were searched", |t| shape::has(t, ArrayName::COARSE_SEARCH)),
    ("/{target}/locate/coarse_register/coarse_search/best", "Points2D", "a shift was found", |t| shape::best(t).is_some()),
    ("/{target}/locate/coarse_register/error_coarse", "Image", "surfaces were compared", |t| shape::has(t, ArrayName::ERROR_COARSE)),
    ("/{target}/locate/refine_register/error_fine", "Image", "surfaces were compared", |t| shape::has(t, ArrayName::ERROR_FINE)),
    ("/{target}/locate/refine_register/mesh_fixed", "Mesh3D", "registered to an earlier mesh", |t| shape::has(t, ArrayName::MESH_FIXED)),
    ("/{target}/locate/refine_register/mesh_moving", "Mesh3D", "there is a present mesh", |t| shape::has(t, ArrayName::MESH_MOVING)),
    ("/{target}/locate/refine_register/position", "Points3D", "the registration is used", |t| shape::registered(t).is_some()),
    ("/{target}/locate/refine_register/covariance", "Ellipsoids3D", "the registration is used", |t| shape::registered(t).is_some()),
    ("/{target}/locate/hand_off/draped", "DepthImage", "the last picture was found at a hand-off", |t| shape::has(t, ArrayName::DRAPED)),
    ("/{target}/locate/hand_off/draped_match", "DepthImage", "the last picture was found at a hand-off", |t| shape::has(t, ArrayName::DRAPED_MATCH)),
    ("/{target}/locate/hand_off/touch", "Points3D", "the arm can touch the surface near the target", |t| shape::touch(t).is_some()),
    ("/{target}/locate/left_covariance", "LineStrips2D", "designated or located", |t| t.located().is_some_and(|l| l.left_pixel.is_some())),
    ("/{target}/judge/state", "StateChange", "always", |_| true),
    ("/{target}/judge/verdict", "TextLog", "always", |_| true),
    ("/{target}/update/position", "Points3D", "always", |_| true),
    ("/truth/{target}/left", "LineStrips2D", "the truth is visible", |t| t.truth.as_ref().is_some_and(|t| t.left_pixel.is_some())),
    ("/truth/{target}/position", "Points3D", "the truth is known", |t| t.truth.is_some()),
];

fn predicted_left(trace: &RunStep) -> bool {
    trace.prediction().is_some() && trace.point_mast.predicted_left.is_some()
}

fn predicted_right(trace: &RunStep) -> bool {
    trace.prediction().is_some() && trace.point_mast.predicted_right.is_some()
}

fn prepared(trace: &RunStep) -> bool {
    trace.template().is_some_and(|e| e.scale_roll.is_some())
}

fn matched(trace: &RunStep) -> bool {
    trace.template().is_some_and(|e| e.match_template.is_some())
}

fn second_peak(trace: &RunStep) -> bool {
    trace.template().and_then(|e| e.match_template.as_ref()).is_some_and(|m| m.second_peak.is_some())
}

fn stereo_matched(trace: &RunStep) -> bool {
    trace.template().is_some_and(|e| e.point_stereo.is_some())
}

fn detected(trace: &RunStep) -> bool {
    trace.features().is_some_and(|e| e.detect.is_some())
}

fn fitted(trace: &RunStep) -> bool {
    trace.features().is_some_and(|e| e.fit_motion.is_some())
}

fn bootstrapped(trace: &RunStep) -> bool {
    trace.features().is_some_and(|e| e.bootstrap.is_some())
}

fn moved(trace: &RunStep) -> bool {
    let located = trace.located();
    bootstrapped(trace)
        && shape::registered(trace).is_none()
        && located.is_some_and(|l| l.position_in_rover.is_some() && l.covariance_in_rover.is_some())
}

fn triangulated(trace: &RunStep) -> bool {
    trace.template().is_some_and(|e| e.triangulate.is_some())
}
