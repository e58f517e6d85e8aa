//! The application state: all loaded data, the selection and the views. Every panel displays it.
//!
//! It is changed by commands of the user (`apply`), and by replies (`replies`) and events of the server. It does no input or
//! output itself, but returns effects (`effect`).

mod apply;
mod replies;
pub(crate) mod effect;
pub(crate) mod calculator;
mod camera;
pub(crate) mod calls;
mod configurations;
pub(crate) mod undoable;
mod draft;
mod linked;
mod rows;
mod sync;
mod views;
mod sync_state;
pub(crate) mod messages;
mod empty_states;
mod panels;
pub(crate) mod hovered;
pub(crate) mod targets;
pub(crate) mod tracker;
mod undo;
mod prefetch;

pub(crate) use self::rows::{events, row_of, run_letter, state_of};
pub(crate) use self::sync_state::{ImagePosition, Progress, Refusal};
pub(crate) use self::views::Views;

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::LazyLock;

use serde_json::Value;
use sightline_api::wire::{StopView, TraverseEntry, TraverseView};
use sightline_geometry::camera::Camera;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_session::Cursor;
use sightline_session::step::{RunStep, StepRow};
use sightline_session::view::{RunView, SessionView, TargetView};
use sightline_track::limits::SettingInfo;
use sightline_track::locate::template::history::AgainstEarlier;
use sightline_track::settings::{Changes, Settings};
use sightline_track::target::TrackingState;
use sightline_track::trace::ArrayName;

use self::calculator::Calculator;
use self::camera::ChosenCamera;
use self::configurations::Configurations;
use self::effect::{Effect, Outbox};
use self::messages::Messages;
use self::sync_state::Sync;
use self::targets::Renaming;
use self::undoable::Undo;
use crate::breakpoints::BreakpointState;
use crate::cache::{Cache, ImageSide, Key, Slot, StepKey};
use crate::command::{Layer, Mode, Stage, Zoomable};
use crate::compare::Compare;
use crate::drawing::raster::Raster;
use crate::drawing::stretch::Stretch;
use crate::drawing::view2d::View2d;
use crate::driving::Driving;
use crate::exports::Exports;
use crate::files::Files;
use crate::hovered::Hovered;
use crate::net::calls::Calls;
use crate::net::events::Connection;
use crate::notes::Notes;
use crate::shape_view::ShapeView;
use crate::studies::Studies;
use crate::tables::FeatureView;
use crate::theme::ColourTheme;
use crate::tour::Tour;
use crate::trackability::Trackability;
use crate::why::Why;

/// The application state.
pub struct State {
    /// Base URL of the server, without a trailing slash.
    pub origin: String,
    /// State of the event connection.
    pub connection: Connection,
    /// The traverses on the server; `None` until loaded.
    pub traverses: Option<Vec<TraverseEntry>>,
    /// The open traverse.
    pub traverse: Option<TraverseView>,
    /// The open session.
    pub session: Option<SessionView>,
    /// Every setting.
    pub settings: Vec<SettingInfo>,
    /// The named configurations.
    pub configurations: Configurations,
    /// The selected step, target and run; ahead of the server's cursor while a request is pending.
    pub cursor: Cursor,
    /// The stage chosen last, possibly of another tracker. [`State::stage`] is the selected one.
    pub stage: Stage,
    /// The meaning of pointer and keys.
    pub mode: Mode,
    /// Changed settings that no run uses yet.
    pub draft: Changes,
    /// The loaded items.
    pub cache: Cache,
    /// Progress of the runs that are being computed, by target and run.
    pub progress: BTreeMap<(usize, usize), Progress>,
    /// Number of rendered stops and of all stops; `None` when no rendering is under way.
    pub rendering: Option<(usize, usize)>,
    /// The designation that awaits its reply.
    pub designating: Option<ImagePosition>,
    /// The last designation that was advised against or refused.
    pub refusal: Option<Refusal>,
    /// The open field for a target's name.
    pub renaming: Option<Renaming>,
    /// The target that is being designated again at the cursor's stop.
    pub repicks: Option<usize>,
    /// The targets whose marks are hidden in the images.
    pub hidden_targets: BTreeSet<usize>,
    /// Index of the colour that the user gave a target, by target number; other targets are grey.
    pub target_colours: BTreeMap<usize, usize>,
    /// Messages to the user.
    pub messages: Messages,
    /// The visible region of each image.
    pub views: Views,
    /// The user's choice of a camera.
    pub(crate) chosen_camera: Option<ChosenCamera>,
    /// Mapping of the images' grey values to screen brightness.
    pub stretch: Stretch,
    /// Filter of the features, and magnification of their residuals.
    pub feature_view: FeatureView,
    /// The selection in the shape panel.
    pub shape_view: ShapeView,
    /// Inputs of the calculator of the error budget.
    pub calculator: Calculator,
    /// The validation experiments.
    pub studies: Studies,
    /// Whether a visible panel shows the matched windows of all steps.
    pub wants_history: bool,
    /// Whether a visible panel shows the corners of visual odometry.
    pub(crate) wants_odometry: bool,
    /// Whether a visible panel shows the goodness map.
    pub(crate) wants_hazards: bool,
    /// Hidden layers of marks.
    pub hidden: HashSet<Layer>,
    /// Whether any marks are shown.
    pub marks: bool,
    /// The colour scheme of the page.
    pub colour_theme: ColourTheme,
    /// Whether keys that write a character act without Ctrl.
    pub single_keys: bool,
    /// The comparison of the selected run with others.
    pub compare: Compare,
    /// The trackability map of the cursor's stop.
    pub trackability: Trackability,
    /// The commanded drive, and the command being entered.
    pub driving: Driving,
    /// State of the tour.
    pub tour: Tour,
    /// Explanations of a step, its counterfactuals, and the trial.
    pub why: Why,
    /// The changes that can be undone and redone.
    pub undo: Undo,
    /// The user's notes on the drive.
    pub notes: Notes,
    /// The window of exports.
    pub exports: Exports,
    /// The window of files.
    pub files: Files,
    /// Breakpoints, derived columns, and playback.
    pub breakpoints: BreakpointState,
    /// Panels that are shown as tables.
    pub tables: HashSet<crate::panels::pane::Pane>,
    /// The hovered location, in any panel.
    pub hovered: Option<Hovered>,
    pub(crate) outbox: Outbox,
    calls: Calls<State>,
    pub(crate) sync: Sync,
    /// Aligned left camera of the step that was requested last, cached because it is slow to compute.
    aligned: egui::mutex::Mutex<Option<(StepKey, Option<Camera>)>>,
    /// Values read from the settings of one run, by group and name. Reading a value serialises all settings, so they are
    /// cached.
    read_out: egui::mutex::Mutex<ReadOut>,
}

/// Settings, with the values of them that were read.
type ReadOut = (Settings, BTreeMap<(String, String), Option<Value>>);

impl State {
    /// A state without data; `linked` is the session in the page's link.
    pub fn new(origin: String, linked: Option<String>) -> Self {
        Self {
            origin,
            connection: Connection::default(),
            traverses: None,
            traverse: None,
            session: None,
            settings: Vec::new(),
            configurations: Configurations::default(),
            cursor: Cursor::default(),
            stage: Stage::MATCH_TEMPLATE,
            mode: Mode::default(),
            draft: Changes::new(),
            cache: Cache::default(),
            progress: BTreeMap::new(),
            rendering: None,
            designating: None,
            refusal: None,
            renaming: None,
            repicks: None,
            hidden_targets: BTreeSet::new(),
            target_colours: BTreeMap::new(),
            messages: Messages::default(),
            views: Views::default(),
            chosen_camera: None,
            stretch: Stretch::default(),
            feature_view: FeatureView::default(),
            shape_view: ShapeView::default(),
            calculator: Calculator::default(),
            studies: Studies::default(),
            wants_history: false,
            wants_odometry: false,
            wants_hazards: false,
            hidden: HashSet::from(Layer::HIDDEN_AT_FIRST),
            marks: true,
            colour_theme: ColourTheme::default(),
            single_keys: true,
            compare: Compare::default(),
            trackability: Trackability::default(),
            driving: Driving::default(),
            tour: Tour::default(),
            why: Why::default(),
            undo: Undo::default(),
            notes: Notes::default(),
            exports: Exports::default(),
            files: Files::default(),
            breakpoints: BreakpointState::default(),
            tables: HashSet::new(),
            hovered: None,
            outbox: Outbox::default(),
            calls: Calls::default(),
            sync: Sync { linked, ..Sync::default() },
            aligned: egui::mutex::Mutex::default(),
            read_out: egui::mutex::Mutex::default(),
        }
    }

    /// Number of stops of the traverse.
    pub fn stop_count(&self) -> usize {
        self.traverse.as_ref().map_or(0, |traverse| traverse.stops.len())
    }

    /// The cursor's stop.
    pub fn stop(&self) -> Option<&StopView> {
        self.traverse.as_ref()?.stops.get(self.cursor.step)
    }

    /// The selected target.
    pub fn target(&self) -> Option<&TargetView> {
        let number = self.cursor.target?;
        self.session.as_ref()?.targets.iter().find(|target| target.number == number)
    }

    /// The selected run.
    pub fn run(&self) -> Option<&RunView> {
        self.target()?.runs.iter().find(|run| run.number == self.cursor.run)
    }

    /// The row of a step of the selected run; `None` before the designation, or if the step was not computed.
    pub fn row_at(&self, step: usize) -> Option<&StepRow> {
        row_of(self.run()?, step)
    }

    /// The row of the cursor's step.
    pub fn row(&self) -> Option<&StepRow> {
        self.row_at(self.cursor.step)
    }

    /// Progress of the selected run while it is being computed.
    pub fn run_progress(&self) -> Option<&Progress> {
        self.progress.get(&(self.cursor.target?, self.cursor.run))
    }

    /// Whether the selected run is still being computed. A page opened during a run reads rows before its first progress
    /// event.
    pub(crate) fn is_running(&self) -> bool {
        let is_incomplete =
            self.run().is_some_and(|run| !run.complete && run.stopped.is_none() && !self.is_paused(run));
        self.run_progress().is_some() || is_incomplete
    }

    /// The newest message that still applies.
    pub(crate) fn newest_message(&self) -> Option<&messages::Message> {
        let is_running = || self.is_running() || !self.progress.is_empty();
        self.messages.newest().filter(|message| !message.is_of_running || is_running())
    }

    /// The cache key of a step of the selected run.
    pub fn step_key(&self, step: usize) -> Option<StepKey> {
        let (session, target) = (self.session.as_ref()?, self.target()?);
        Some(StepKey { session: session.id.clone(), target: target.number, run: self.cursor.run, step })
    }

    /// The record of a step.
    pub fn trace_at(&self, step: usize) -> Slot<'_, RunStep> {
        self.step_key(step).map_or(Slot::Absent, |key| self.cache.trace(&key))
    }

    /// The record of the cursor's step; `None` until loaded.
    pub fn trace(&self) -> Option<&RunStep> {
        self.trace_at(self.cursor.step).ready()
    }

    /// The motion to a stop as measured by visual odometry; `None` if it was not measured.
    pub fn measured_motion(&self, step: usize) -> Option<&MeasuredMotion> {
        self.traverse.as_ref()?.stops.get(step)?.odometry.as_ref()
    }

    /// The comparison of the cursor's step with the earlier templates of its run.
    pub fn earlier_templates(&self) -> Slot<'_, [AgainstEarlier]> {
        let key = self.row().and_then(|_| self.step_key(self.cursor.step));
        key.map_or(Slot::Absent, |key| self.cache.earlier_templates(&key))
    }

    /// The cache key of an image of a stop in the camera that is shown; `None` if the stop lacks it.
    pub fn image_key(&self, step: usize, side: ImageSide) -> Option<Key> {
        self.image_key_in(step, self.camera(), side)
    }

    /// The cache key of the cameras of a stop.
    pub fn stop_detail_key(&self, step: usize) -> Option<Key> {
        Some(Key::Stop { traverse: self.traverse.as_ref()?.id.clone(), step })
    }

    /// An image of the cursor's stop.
    pub fn image(&self, side: ImageSide) -> Slot<'_, Raster> {
        self.image_key(self.cursor.step, side).map_or(Slot::Absent, |key| self.cache.raster(&key))
    }

    /// An array of the cursor's step.
    pub fn array(&self, name: ArrayName) -> Slot<'_, Raster> {
        let key = self.step_key(self.cursor.step).map(|key| Key::Array(key, name));
        key.map_or(Slot::Absent, |key| self.cache.raster(&key))
    }

    /// A setting of the selected run by group and name, for forms generated from the table of settings.
    ///
    /// Code for one particular setting reads the field of [`State::run_settings`].
    pub fn setting(&self, group: &str, key: &str) -> Option<Value> {
        let settings = &self.run()?.settings;
        let mut cached = self.read_out.lock();
        if cached.0 != *settings {
            *cached = (settings.clone(), BTreeMap::new());
        }
        let name = (group.to_owned(), key.to_owned());
        cached.1.entry(name).or_insert_with(|| settings.value(group, key)).clone()
    }

    /// The settings of the selected run; the defaults without a run.
    pub(crate) fn run_settings(&self) -> &Settings {
        static DEFAULTS: LazyLock<Settings> = LazyLock::new(Settings::default);
        self.run().map_or(&DEFAULTS, |run| &run.settings)
    }

    /// Whether a layer of marks is shown.
    pub fn shows(&self, layer: Layer) -> bool {
        self.marks && !self.hidden.contains(&layer)
    }

    /// The visible region of an image.
    pub fn view(&self, panel: Zoomable) -> View2d {
        match panel {
            Zoomable::Left => self.views.left,
            Zoomable::Right => self.views.right,
            Zoomable::ScoreMap => self.views.score_map,
        }
    }

    /// The tracking state at the cursor's step: from its record if loaded, otherwise from its row.
    pub fn tracking(&self) -> Option<TrackingState> {
        if let Some(trace) = self.trace() {
            return Some(trace.update.state);
        }
        self.row().map(state_of)
    }

    /// The effects of replies and events, with the requests that synchronise server and page.
    #[must_use = "the page carries the effects out"]
    pub fn take_effects(&mut self) -> Vec<Effect> {
        self.sync_all();
        self.outbox.take()
    }

    /// The requests among these effects; the others remain queued.
    #[cfg(test)]
    pub fn take_requests(&mut self) -> Vec<crate::net::request::Request> {
        self.sync_all();
        self.outbox.take_requests()
    }

    fn sync_all(&mut self) {
        self.sync_session();
        self.sync_trackability();
        self.sync_driving();
        self.sync_trial_drives();
        self.sync_tour();
        self.sync_breakpoints();
    }
}
