//! The user's commands. Panels and keys create them; `state` carries them out.

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

pub(crate) use crate::stage::{Stage, StageBarExtent};

use crate::breakpoints::BreakpointCommand;
use crate::drawing::stretch::Stretch;
use crate::drawing::view2d::View2d;
use crate::hovered::Hovered;
use crate::layout::command::LayoutCommand;
use crate::picking::aim::Aim;
use crate::shape_view::ShapeView;
use crate::state::calculator::Calculator;
use crate::state::targets::Rename;
use crate::studies::StudyForm;
use crate::tables::FeatureView;
use crate::theme::ColourTheme;
use crate::tour::Turn;
use crate::why::WhyCommand;
use crate::{exports, notes};

/// A destination along the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Go {
    /// To a stop.
    Step(usize),
    /// Forward by this many stops; backward if negative.
    By(isize),
    /// To the first stop.
    First,
    /// To the last stop.
    Last,
    /// To the next change of the tracking state.
    NextEvent,
    /// To the previous change of the tracking state.
    PreviousEvent,
}

/// Panels with a zoomable view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zoomable {
    /// The left image.
    Left,
    /// The right image.
    Right,
    /// The score map.
    ScoreMap,
}

/// Layers of marks that can be hidden.
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
    /// The target's pixels at the previous and the next steps.
    Track,
    /// The ground truth.
    Truth,
    /// The epipolar curve with its ticks.
    Curve,
    /// The other targets.
    Others,
    /// Features without a match, with scale and orientation.
    Keypoints,
    /// Features whose match is an inlier of the motion.
    Inliers,
    /// Features whose match is an outlier.
    Outliers,
    /// Displacement of the inliers from the earlier stop.
    Flow,
    /// Displacement of the outliers from the earlier stop.
    OutlierFlow,
    /// Residuals of matched features, from the position predicted by the motion to the measured one, magnified.
    Residuals,
    /// The bootstrap distribution of the target.
    Cloud,
    /// Basin of convergence of a registration by shape, about the prediction.
    Basin,
    /// The runs that are compared with the selected one.
    Compared,
    /// The trackability map, while a target is being picked.
    Trackability,
    /// The goodness of the ground on the left image.
    Ground,
    /// The corners of visual odometry on the left image.
    Odometry,
    /// The corners with one outcome, on the left image and in the odometry panel.
    Corners(Fate),
}

impl Layer {
    /// The layers that are hidden by default, because they would obscure the image.
    pub const HIDDEN_AT_FIRST: [Self; 5] =
        [Self::Keypoints, Self::OutlierFlow, Self::Residuals, Self::Odometry, Self::Ground];
}

/// The meaning of pointer and keys.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Mode {
    /// The default: viewing, without picking.
    #[default]
    Look,
    /// The next click in the left image designates a target.
    Pick,
    /// The user is entering a step; the text so far.
    GoTo(String),
    /// The help sheet is open.
    Help,
    /// The palette is open.
    Palette(Search),
}

/// The search in the palette.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Search {
    /// The words typed so far.
    pub words: String,
    /// Index of the selected result, from 0.
    pub chosen: usize,
}

/// A command of the user.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Moves along the drive.
    Go(Go),
    /// Opens a traverse.
    OpenTraverse(String),
    /// Selects a run of a target.
    SelectRun {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// Selects a stage.
    SelectStage(Stage),
    /// Selects the stage this many positions further in the stage bar.
    StageBy(isize),
    /// Changes the meaning of pointer and keys.
    SetMode(Mode),
    /// Designates the target at a pixel of the left image.
    Pick(Pixel),
    /// Removes a target.
    RemoveTarget(usize),
    /// Renames a target.
    Rename(Rename),
    /// Hides the marks of a target in the images, or shows them.
    ToggleTarget(usize),
    /// Sets the colour of a target's marks; `None`: grey.
    ColourTarget {
        /// The target's number.
        target: usize,
        /// Index of the colour for [`theme::run`](crate::theme::run).
        colour: Option<usize>,
    },
    /// Starts to designate a target again at the cursor's stop, as a separate target.
    Repick(usize),
    /// Changes a setting of the draft; `None` reverts it.
    Draft {
        /// The setting's name.
        key: String,
        /// The new value.
        value: Option<serde_json::Value>,
    },
    /// Sets the draft to the changes that lead from the run to the named configuration.
    UsePreset(&'static str),
    /// Reverts all changes of the draft.
    ClearDraft,
    /// Forks the run at the cursor's step with these changes.
    RunFromHere(Changes),
    /// Stops a run.
    CancelRun {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// Resumes a stopped run.
    ResumeRun {
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// Changes the visible region of an image.
    View(Zoomable, View2d),
    /// Changes the inputs of the calculator of the error budget.
    SetCalculator(Calculator),
    /// Shows the images of a further camera; `None`: the main pair.
    ShowCamera(Option<CameraName>),
    /// Sets the contrast stretch of the displayed images.
    SetStretch(Stretch),
    /// Filters the features and sets the magnification of their residuals.
    SetFeatureView(FeatureView),
    /// Changes the selection in the shape panel.
    SetShapeView(ShapeView),
    /// Changes the inputs of the next study.
    SetStudyForm(StudyForm),
    /// Starts the study.
    StartStudy,
    /// Stops a study.
    CancelStudy(String),
    /// Resumes a stopped study.
    ResumeStudy(String),
    /// Shows the table of a study.
    ShowStudy(String),
    /// Opens the report of a study.
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
    /// Removes a message.
    Dismiss(u64),
    /// Reconnects to the server at once.
    Reconnect,
    /// Moves, closes or shows panels.
    Layout(LayoutCommand),
    /// Copies the link to the current view.
    CopyLink,
    /// Chooses the colour scheme of the page.
    SetColourTheme(ColourTheme),
    /// Whether keys that type a character act as shortcuts without Ctrl.
    SetSingleKeys(bool),
    /// A command about comparing runs.
    Compare(crate::compare::CompareCommand),
    /// Moves or confirms the aim of a designation by keyboard.
    Aim(Aim),
    /// A command about the tour.
    Tour(Turn),
    /// A command about explanations, trials, and undo.
    Why(WhyCommand),
    /// A command about driving.
    Drive(crate::driving::DrivingCommand),
    /// A command about notes.
    Notes(notes::NotesCommand),
    /// A command about exports.
    Exports(exports::ExportsCommand),
    /// A command about breakpoints, derived columns and playback.
    Breakpoints(BreakpointCommand),
    /// A command about files and sessions.
    Files(crate::files::FilesCommand),
    /// Closes the card of a problem.
    CloseCard,
    /// Toggles between a panel's table and its graphical form.
    Table(crate::panels::pane::Pane),
    /// A command about the limits of trackability.
    Limits(crate::trackability::limits::LimitsCommand),
    /// Sets the hovered location.
    Hover(Hovered),
}

impl Command {
    /// Whether the command only goes to another step or stage.
    pub fn is_step(&self) -> bool {
        matches!(
            self,
            Command::Go(_)
                | Command::SelectStage(_)
                | Command::StageBy(_)
                | Command::Breakpoints(BreakpointCommand::NextHit | BreakpointCommand::PreviousHit)
        )
    }
}
