//! What a person can ask for. Panels and keys make commands; `state` carries them out.

mod entry;
pub(crate) mod table;
pub(crate) mod keys;
pub(crate) mod actions;
pub(crate) mod palette;
pub(crate) mod help;

use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::Pixel;
use sightline_rover::visual_odometry::Fate;
use sightline_track::settings::Changes;

pub(crate) use crate::stage::{Extent, Stage};

use crate::drawing::stretch::Stretch;
use crate::drawing::view2d::View2d;
use crate::layout::command::LayoutCommand;
use crate::picking::aim::Aim;
use crate::pointed::Pointed;
use crate::shape_view::ShapeView;
use crate::state::calculator::Calculator;
use crate::state::targets::Rename;
use crate::studies::Order;
use crate::tables::FeatureView;
use crate::theme::Looks;
use crate::tour::Turn;
use crate::why::Ask;
use crate::{exports, notes};

/// Where to go along the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Go {
    /// To a stop.
    Step(usize),
    /// By so many stops.
    By(isize),
    /// To the first stop.
    First,
    /// To the last stop.
    Last,
    /// To the next change of state.
    NextEvent,
    /// To the previous change of state.
    PreviousEvent,
}

/// Panels with a zoomable view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zoomable {
    /// The left image.
    Left,
    /// The right image.
    Right,
    /// The surface of scores.
    Surface,
}

/// Marks that can be switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layer {
    /// The predicted point and its gate.
    Prediction,
    /// The search window.
    SearchWindow,
    /// The subframe.
    Subframe,
    /// The template window at the match.
    Template,
    /// The match with its ellipse.
    Match,
    /// The target's pixels at the steps before and after.
    Track,
    /// The truth.
    Truth,
    /// The epipolar curve with its ticks.
    Curve,
    /// The other targets.
    Others,
    /// Features without a match, with scale and orientation.
    Keypoints,
    /// Features whose match agrees with the motion.
    Inliers,
    /// Features whose match does not.
    Outliers,
    /// From where the inliers were at the earlier stop.
    Flow,
    /// From where the outliers were.
    OutlierFlow,
    /// From where the motion puts matched features to where they are, magnified.
    Residuals,
    /// Where the bootstrap puts the target.
    Cloud,
    /// How far from the prediction a registration by shape can start.
    Basin,
    /// The runs that are compared with the one looked at.
    Compared,
    /// How well a target would do, while one is picked.
    Trackability,
    /// The goodness of the ground on the left image.
    Ground,
    /// The corners of visual odometry on the left image.
    Odometry,
    /// The corners of one fate, on the left image and in the panel of odometry.
    Corners(Fate),
}

impl Layer {
    /// Those that would drown the picture: they are switched on by whoever wants them.
    pub const HIDDEN_AT_FIRST: [Self; 5] =
        [Self::Keypoints, Self::OutlierFlow, Self::Residuals, Self::Odometry, Self::Ground];
}

/// What the pointer and the keys mean at the moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Mode {
    /// Looking around.
    #[default]
    Look,
    /// The next click in the left image designates a target.
    Pick,
    /// A step is being typed.
    GoTo(String),
    /// The help sheet is open.
    Help,
    /// The palette is open.
    Palette(Search),
}

/// What is being looked for in the palette.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Search {
    /// The words typed so far.
    pub words: String,
    /// Which of the findings is chosen, from 0.
    pub chosen: usize,
}

/// What a person asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Moves along the drive.
    Go(Go),
    /// Opens a traverse.
    OpenTraverse(String),
    /// Looks at a run of a target.
    Look {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// Looks at a stage.
    SelectStage(Stage),
    /// Looks at the stage so many places on.
    StageBy(isize),
    /// Changes what pointer and keys mean.
    SetMode(Mode),
    /// Designates the target under a pixel of the left image.
    Pick(Pixel),
    /// Removes a target.
    RemoveTarget(usize),
    /// Renames a target.
    Rename(Rename),
    /// Hides the marks of a target in the images, or shows them.
    ToggleTarget(usize),
    /// Gives the marks of a target the colour with this number, or grey.
    ColourTarget {
        /// The target's number.
        target: usize,
        /// The number of the colour, as [`theme::run`](crate::theme::run) takes it.
        colour: Option<usize>,
    },
    /// Begins to designate a target again at the cursor's stop, as a target of its own.
    Repick(usize),
    /// Changes a setting of the draft; none takes the change back.
    Draft {
        /// The setting's name.
        key: String,
        /// The new value.
        value: Option<serde_json::Value>,
    },
    /// Makes the draft what takes the run to the named configuration.
    UsePreset(&'static str),
    /// Takes all changes of the draft back.
    ClearDraft,
    /// Runs from the cursor's step with these changes.
    RunFromHere(Changes),
    /// Stops a run.
    CancelRun {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// Lets a stopped run go on.
    ResumeRun {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// Changes what a panel shows.
    View(Zoomable, View2d),
    /// Changes what the calculator of the error budget is given.
    SetCalculator(Calculator),
    /// Shows the images of a further camera of the stops, or of the main pair.
    ShowCamera(Option<CameraName>),
    /// Stretches the grey values of the images on the screen.
    SetStretch(Stretch),
    /// Filters the features and magnifies their residuals.
    SetFeatureView(FeatureView),
    /// Changes what is looked at of a registration by shape.
    SetShapeView(ShapeView),
    /// Changes what the next study is made of.
    OrderStudy(Order),
    /// Starts that study.
    StartStudy,
    /// Stops a study.
    CancelStudy(String),
    /// Lets a stopped study go on.
    ResumeStudy(String),
    /// Looks at a study's table.
    LookAtStudy(String),
    /// Opens a study's report.
    OpenReport(String),
    /// Fits every image to its panel.
    FitAll,
    /// Shows or hides a layer of marks.
    ToggleLayer(Layer),
    /// Shows or hides all marks.
    ToggleMarks,
    /// Opens the session in Rerun.
    OpenRerun,
    /// Closes the live Rerun stream of the session.
    CloseRerun,
    /// Takes a message away.
    Dismiss(u64),
    /// Connects again at once.
    Reconnect,
    /// Moves, closes and shows panels.
    Layout(LayoutCommand),
    /// Copies the link to what is looked at.
    CopyLink,
    /// Chooses the looks of the page.
    SetLooks(Looks),
    /// Lets keys that write a character act, or only those with Ctrl.
    SetSingleKeys(bool),
    /// Something about comparing runs.
    Compare(crate::compare::Ask),
    /// Changes or takes the place that is being chosen.
    Aim(Aim),
    /// Leads through the tour.
    Tour(Turn),
    /// Asks why a step came out as it did, tries a change, or takes a deed back.
    Why(Ask),
    /// Something about driving.
    Drive(crate::driving::Ask),
    /// Something about notes.
    Notes(notes::Ask),
    /// Something about exports.
    Exports(exports::Ask),
    /// Breakpoints, derived columns and time travel.
    Ask(crate::breakpoints::Ask),
    /// Something about files and sessions.
    Files(crate::files::Ask),
    /// Closes the card of a problem.
    CloseCard,
    /// Shows a panel as a table, or as it is painted again.
    Table(crate::panels::pane::Pane),
    /// The limits of trackability.
    Limits(crate::trackability::limits::Ask),
    /// The pointer rests on something.
    Point(Pointed),
}

impl Command {
    /// Whether it does nothing but lead to another step or stage.
    pub fn is_step(&self) -> bool {
        matches!(
            self,
            Command::Go(_)
                | Command::SelectStage(_)
                | Command::StageBy(_)
                | Command::Ask(crate::breakpoints::Ask::NextHit | crate::breakpoints::Ask::PreviousHit)
        )
    }
}
