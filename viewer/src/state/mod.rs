//! What is known and what is looked at: the one value of which every panel is a view.
//!
//! Three things change it: commands of the person (`apply`), answers of the server (`arrive`) and its events.
//! What it wants from the server or the page it returns as effects (`effect`); it does no input or output itself.

mod apply;
mod arrive;
pub(crate) mod effect;
pub(crate) mod calculator;
mod camera;
pub(crate) mod calls;
mod configurations;
pub(crate) mod deeds;
mod draft;
mod linked;
mod rows;
mod sync;
mod views;
mod known;
pub(crate) mod messages;
mod missing;
mod panels;
pub(crate) mod pointed;
pub(crate) mod targets;
pub(crate) mod tracker;
mod undo;
mod wanted;

pub(crate) use self::known::{Place, Progress, Refusal};
pub(crate) use self::rows::{events, row_of, run_letter, state_of};
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
use self::deeds::Undo;
use self::effect::{Effect, Outbox};
use self::known::Sync;
use self::messages::Messages;
use self::targets::Renaming;
use crate::breakpoints::Asking;
use crate::cache::{Cache, Eye, Key, Slot, StepKey};
use crate::command::{Layer, Mode, Stage, Zoomable};
use crate::compare::Compare;
use crate::drawing::raster::Raster;
use crate::drawing::stretch::Stretch;
use crate::drawing::view2d::View2d;
use crate::driving::Driving;
use crate::exports::Exports;
use crate::files::Files;
use crate::net::calls::Calls;
use crate::net::events::Connection;
use crate::notes::Notes;
use crate::pointed::Pointed;
use crate::shape_view::ShapeView;
use crate::studies::Studies;
use crate::tables::FeatureView;
use crate::theme::Looks;
use crate::tour::Tour;
use crate::trackability::Trackability;
use crate::why::Why;

/// Everything that is known and looked at.
pub struct State {
    /// Where the server is, without a slash at the end.
    pub origin: String,
    /// How the server's events come in.
    pub connection: Connection,
    /// The traverses that the server has; none before it has said.
    pub traverses: Option<Vec<TraverseEntry>>,
    /// The traverse that is open.
    pub traverse: Option<TraverseView>,
    /// The session that is open.
    pub session: Option<SessionView>,
    /// Every setting.
    pub settings: Vec<SettingInfo>,
    /// The named configurations.
    pub configurations: Configurations,
    /// What is looked at; ahead of the server's cursor by the time of a request.
    pub cursor: Cursor,
    /// The stage that was chosen last, perhaps in a run of another tracker: what is looked at is [`State::stage`].
    pub stage: Stage,
    /// What pointer and keys mean.
    pub mode: Mode,
    /// Changed settings that no run uses yet.
    pub draft: Changes,
    /// What was loaded.
    pub cache: Cache,
    /// Runs that go on, by target and run.
    pub progress: BTreeMap<(usize, usize), Progress>,
    /// Stops rendered, and stops in all, while rendering goes on.
    pub rendering: Option<(usize, usize)>,
    /// A designation that waits for its answer.
    pub designating: Option<Place>,
    /// The last designation that was advised against or refused.
    pub refusal: Option<Refusal>,
    /// The name of a target that is being typed.
    pub renaming: Option<Renaming>,
    /// The target that is designated again at the cursor's stop.
    pub repicks: Option<usize>,
    /// The targets whose marks are hidden in the images.
    pub hidden_targets: BTreeSet<usize>,
    /// The colours that the user gave targets, by their numbers; the others are grey.
    pub target_colours: BTreeMap<usize, usize>,
    /// What was said to the person.
    pub messages: Messages,
    /// What each panel shows.
    pub views: Views,
    /// The camera of the stops that a person chose for the images.
    pub(crate) chosen_camera: Option<ChosenCamera>,
    /// How the images' grey values become brightness on the screen.
    pub stretch: Stretch,
    /// Which features are shown, and how long their residuals are drawn.
    pub feature_view: FeatureView,
    /// What is looked at of a registration by shape.
    pub shape_view: ShapeView,
    /// What the calculator of the error budget is given.
    pub calculator: Calculator,
    /// The validation experiments.
    pub studies: Studies,
    /// Whether the windows of all steps are on the screen.
    pub wants_history: bool,
    /// Whether a panel shows the corners of visual odometry.
    pub(crate) wants_odometry: bool,
    /// Whether a panel on the screen shows the goodness map.
    pub(crate) wants_hazards: bool,
    /// Layers of marks that are switched off.
    pub hidden: HashSet<Layer>,
    /// Whether marks are shown at all.
    pub marks: bool,
    /// Which colours the page has.
    pub looks: Looks,
    /// Whether keys that write a character act without Ctrl.
    pub single_keys: bool,
    /// Runs that are compared with the one looked at.
    pub compare: Compare,
    /// How well a target would do at the stop that is looked at.
    pub trackability: Trackability,
    /// The drive on commands, and the command in its form.
    pub driving: Driving,
    /// Where the tour is.
    pub tour: Tour,
    /// Why a step came out as it did, what would have saved it, and what is tried.
    pub why: Why,
    /// What can be taken back.
    pub undo: Undo,
    /// What a person wrote about places of the drive.
    pub notes: Notes,
    /// What the session can be had as.
    pub exports: Exports,
    /// What can be opened.
    pub files: Files,
    /// Breakpoints, derived columns, and time travel.
    pub ask: Asking,
    /// Panels that are looked at as tables.
    pub tables: HashSet<crate::panels::pane::Pane>,
    /// What the pointer rests on, in whatever panel.
    pub pointed: Option<Pointed>,
    pub(crate) outbox: Outbox,
    calls: Calls<State>,
    pub(crate) sync: Sync,
    /// The aligned left camera of the step that was asked for last: it takes a while to compute.
    aligned: egui::mutex::Mutex<Option<(StepKey, Option<Camera>)>>,
    /// Settings of the run that was asked about last, by group and name: reading one writes all of them as a document.
    read_out: egui::mutex::Mutex<ReadOut>,
}

/// Settings, and those of their values that were asked for.
type ReadOut = (Settings, BTreeMap<(String, String), Option<Value>>);

impl State {
    /// Nothing known yet; `linked` is the session that the page's link names.
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
            looks: Looks::default(),
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
            ask: Asking::default(),
            tables: HashSet::new(),
            pointed: None,
            outbox: Outbox::default(),
            calls: Calls::default(),
            sync: Sync { linked, ..Sync::default() },
            aligned: egui::mutex::Mutex::default(),
            read_out: egui::mutex::Mutex::default(),
        }
    }

    /// How many stops the traverse has.
    pub fn stop_count(&self) -> usize {
        self.traverse.as_ref().map_or(0, |traverse| traverse.stops.len())
    }

    /// The stop that is looked at.
    pub fn stop(&self) -> Option<&StopView> {
        self.traverse.as_ref()?.stops.get(self.cursor.step)
    }

    /// The target that is looked at.
    pub fn target(&self) -> Option<&TargetView> {
        let number = self.cursor.target?;
        self.session.as_ref()?.targets.iter().find(|target| target.number == number)
    }

    /// The run that is looked at.
    pub fn run(&self) -> Option<&RunView> {
        self.target()?.runs.iter().find(|run| run.number == self.cursor.run)
    }

    /// A step of the run that is looked at, as one line; none before the designation or where it was not computed.
    pub fn row_at(&self, step: usize) -> Option<&StepRow> {
        row_of(self.run()?, step)
    }

    /// The cursor's step as one line.
    pub fn row(&self) -> Option<&StepRow> {
        self.row_at(self.cursor.step)
    }

    /// How the cursor's run goes on, while it does.
    pub fn run_progress(&self) -> Option<&Progress> {
        self.progress.get(&(self.cursor.target?, self.cursor.run))
    }

    /// Whether the selected run is still being computed. A page that opens during a run reads rows before its first progress event.
    pub(crate) fn is_running(&self) -> bool {
        let is_incomplete =
            self.run().is_some_and(|run| !run.complete && run.stopped.is_none() && !self.is_held(run));
        self.run_progress().is_some() || is_incomplete
    }

    /// The newest message that still applies.
    pub(crate) fn newest_message(&self) -> Option<&messages::Message> {
        let is_running = || self.is_running() || !self.progress.is_empty();
        self.messages.newest().filter(|message| !message.is_of_running || is_running())
    }

    /// The name of a step of the run that is looked at.
    pub fn step_key(&self, step: usize) -> Option<StepKey> {
        let (session, target) = (self.session.as_ref()?, self.target()?);
        Some(StepKey { session: session.id.clone(), target: target.number, run: self.cursor.run, step })
    }

    /// What a step saw and decided.
    pub fn trace_at(&self, step: usize) -> Slot<'_, RunStep> {
        self.step_key(step).map_or(Slot::Absent, |key| self.cache.trace(&key))
    }

    /// What the cursor's step saw and decided, once it is here.
    pub fn trace(&self) -> Option<&RunStep> {
        self.trace_at(self.cursor.step).ready()
    }

    /// How vision measured the motion to a stop; `None` where it did not.
    pub fn measured_motion(&self, step: usize) -> Option<&MeasuredMotion> {
        self.traverse.as_ref()?.stops.get(step)?.odometry.as_ref()
    }

    /// The view of the cursor's step against the earlier templates of its run.
    pub fn earlier_templates(&self) -> Slot<'_, [AgainstEarlier]> {
        let key = self.row().and_then(|_| self.step_key(self.cursor.step));
        key.map_or(Slot::Absent, |key| self.cache.earlier_templates(&key))
    }

    /// The name of an image of a stop, of the camera that is shown; `None` where the stop lacks it.
    pub fn image_key(&self, step: usize, eye: Eye) -> Option<Key> {
        self.image_key_in(step, self.camera(), eye)
    }

    /// The name of the cameras of a stop.
    pub fn stop_detail_key(&self, step: usize) -> Option<Key> {
        Some(Key::Stop { traverse: self.traverse.as_ref()?.id.clone(), step })
    }

    /// An image of the cursor's stop.
    pub fn image(&self, eye: Eye) -> Slot<'_, Raster> {
        self.image_key(self.cursor.step, eye).map_or(Slot::Absent, |key| self.cache.raster(&key))
    }

    /// An array of the cursor's step.
    pub fn array(&self, name: ArrayName) -> Slot<'_, Raster> {
        let key = self.step_key(self.cursor.step).map(|key| Key::Array(key, name));
        key.map_or(Slot::Absent, |key| self.cache.raster(&key))
    }

    /// A setting of the run that is looked at by its name, for forms that are made from the table of settings.
    ///
    /// Code that knows the setting reads the field of [`State::run_settings`].
    pub fn setting(&self, group: &str, key: &str) -> Option<Value> {
        let settings = &self.run()?.settings;
        let mut kept = self.read_out.lock();
        if kept.0 != *settings {
            *kept = (settings.clone(), BTreeMap::new());
        }
        let name = (group.to_owned(), key.to_owned());
        kept.1.entry(name).or_insert_with(|| settings.value(group, key)).clone()
    }

    /// The settings of the run that is looked at; the defaults without a run.
    pub(crate) fn run_settings(&self) -> &Settings {
        static DEFAULTS: LazyLock<Settings> = LazyLock::new(Settings::default);
        self.run().map_or(&DEFAULTS, |run| &run.settings)
    }

    /// Whether a layer of marks is shown.
    pub fn shows(&self, layer: Layer) -> bool {
        self.marks && !self.hidden.contains(&layer)
    }

    /// The view of a panel.
    pub fn view(&self, panel: Zoomable) -> View2d {
        match panel {
            Zoomable::Left => self.views.left,
            Zoomable::Right => self.views.right,
            Zoomable::Surface => self.views.surface,
        }
    }

    /// The latest tracking state of the cursor's step.
    pub fn tracking(&self) -> Option<TrackingState> {
        if let Some(trace) = self.trace() {
            return Some(trace.update.state);
        }
        self.row().map(state_of)
    }

    /// What answers and events led to, with the requests that bring server and page into step.
    #[must_use = "the page carries the effects out"]
    pub fn take_effects(&mut self) -> Vec<Effect> {
        self.sync_all();
        self.outbox.take()
    }

    /// The requests among these effects; the others keep waiting.
    #[cfg(test)]
    pub fn take_requests(&mut self) -> Vec<crate::net::request::Request> {
        self.sync_all();
        self.outbox.take_requests()
    }

    fn sync_all(&mut self) {
        self.sync_session();
        self.sync_trackability();
        self.sync_driving();
        self.sync_tried_drives();
        self.sync_tour();
        self.sync_ask();
    }
}
