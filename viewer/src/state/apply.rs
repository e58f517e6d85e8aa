//! Applies the user's commands to the state.

use sightline_api::endpoint::{Call, Endpoint, NoBody};
use sightline_api::endpoints::{
    CancelRun, CloseRecording, DesignateTarget, ForkRun, ResumeRun, StreamRecording,
};
use sightline_api::location::{AtRun, AtSession, AtTarget};
use sightline_api::wire::{Designated, NewRun, NewTarget};
use sightline_geometry::frames::Pixel;
use sightline_session::Cursor;
use sightline_track::settings::Changes;

use crate::breakpoints::play::Shuttle;
use crate::command::{Command, Go, Mode, Zoomable};
use crate::exports::update::{close_rerun, stream_to_rerun};
use crate::net::request::Request;
use crate::state::calls::Notice;
use crate::state::effect::Effect;
use crate::state::{ImagePosition, Refusal, State, Views, events, run_letter};

impl State {
    /// Applies one command and returns its effects, in order.
    #[must_use = "the page carries the effects out"]
    pub fn apply(&mut self, command: Command) -> Vec<Effect> {
        self.perform(command);
        self.outbox.take()
    }

    /// Applies one command; its effects are queued with those of replies and events ([`State::take_effects`]).
    pub(crate) fn perform(&mut self, command: Command) {
        let is_draft = matches!(command, Command::Draft { .. } | Command::UsePreset(_) | Command::ClearDraft);
        let draft = is_draft.then(|| self.draft.clone());
        self.carry_out(command);
        if let Some(before) = draft {
            self.drafted(before);
        }
    }

    fn carry_out(&mut self, command: Command) {
        match command {
            Command::Go(go) => self.go(go),
            Command::OpenTraverse(id) => self.open_traverse(id),
            Command::SelectRun { target, run } => self.select_run(target, run),
            Command::SelectStage(stage) => self.stage = stage,
            Command::StageBy(by) => {
                self.stage = self.stage().neighbour(self.tracker(), self.extent(), by);
            }
            Command::SetMode(mode) => self.set_mode(mode),
            Command::Pick(pixel) => self.pick(pixel),
            Command::RemoveTarget(target) => self.remove_target(target),
            Command::Rename(rename) => self.rename(rename),
            Command::ToggleTarget(target) => self.toggle_target(target),
            Command::ColourTarget { target, colour } => self.colour_target(target, colour),
            Command::Repick(target) => self.repick(target),
            Command::Draft { key, value } => {
                match value {
                    Some(value) => self.draft.insert(key, value),
                    None => self.draft.remove(&key),
                };
            }
            Command::UsePreset(name) => self.draft = self.changes_to(name).unwrap_or_default(),
            Command::ClearDraft => self.draft.clear(),
            Command::RunFromHere(changes) => self.run_from_here(changes),
            Command::CancelRun { target, run } => self.switch_run::<CancelRun>(target, run),
            Command::ResumeRun { target, run } => self.switch_run::<ResumeRun>(target, run),
            Command::View(panel, view) => match panel {
                Zoomable::Left => self.views.left = view,
                Zoomable::Right => self.views.right = view,
                Zoomable::ScoreMap => self.views.score_map = view,
            },
            Command::ShowCamera(camera) => self.choose_camera(camera),
            Command::SetCalculator(calculator) => self.calculator = calculator,
            Command::SetStretch(stretch) => self.stretch = stretch,
            Command::SetFeatureView(view) => self.feature_view = view,
            Command::SetShapeView(view) => self.shape_view = view,
            Command::SetStudyForm(form) => self.studies.form = form,
            Command::StartStudy => self.start_study(),
            Command::CancelStudy(job) => self.cancel_study(job),
            Command::ResumeStudy(job) => self.resume_study(job),
            Command::ShowStudy(job) => self.show_study(job),
            Command::OpenReport(job) => {
                self.open_path(&format!("studies/jobs/{job}/report.html"));
            }
            Command::FitAll => self.views = Views::default(),
            Command::ToggleLayer(layer) => {
                if !self.hidden.remove(&layer) {
                    self.hidden.insert(layer);
                }
            }
            Command::ToggleMarks => self.marks = !self.marks,
            Command::OpenRerun => self.open_rerun(),
            Command::CloseRerun => self.close_rerun(),
            Command::Dismiss(id) => self.messages.dismiss(id),
            Command::Reconnect => self.outbox.push(Request::Reconnect),
            Command::SetColourTheme(colour_theme) => {
                self.colour_theme = colour_theme;
                self.outbox.add(Effect::UseColourTheme(colour_theme));
            }
            Command::SetSingleKeys(are_on) => self.single_keys = are_on,
            Command::Layout(command) => self.outbox.add(Effect::Layout(command)),
            Command::CopyLink => self.outbox.add(Effect::CopyLink),
            Command::Compare(command) => self.apply_compare_command(command),
            Command::Aim(aim) => self.aim(aim),
            Command::Tour(turn) => self.turn_tour(turn),
            Command::Why(command) => self.apply_why_command(command),
            Command::Drive(command) => self.apply_driving_command(command),
            Command::Notes(command) => self.apply_notes_command(command),
            Command::Exports(command) => self.apply_exports_command(command),
            Command::Breakpoints(command) => self.apply_breakpoint_command(command),
            Command::Files(command) => self.apply_files_command(command),
            Command::CloseCard => self.messages.close_card(),
            Command::Limits(command) => self.apply_limits_command(command),
            Command::Table(pane) => self.turn_table(pane),
            Command::Hover(at) => self.hovered = Some(at),
        }
    }

    fn open_rerun(&mut self) {
        if let Some(session) = self.session_id() {
            self.call::<StreamRecording>(stream_to_rerun(session), Self::rerun_opened);
        }
        self.messages.note("Opening the session in Rerun …");
    }

    fn close_rerun(&mut self) {
        if let Some(session) = self.session_id() {
            self.call::<CloseRecording>(close_rerun(session), |state, _| {
                state.messages.note("The Rerun stream of this session is closed.");
            });
        }
    }

    fn go(&mut self, go: Go) {
        let Some(last) = self.stop_count().checked_sub(1) else { return };
        // Stepping by hand ends playing.
        self.shuttle(Shuttle::Stop);
        let events = self.run().map(events).unwrap_or_default();
        let step = self.cursor.step;
        let to = match go {
            Go::Step(to) => to,
            Go::By(by) => step.saturating_add_signed(by),
            Go::First => 0,
            Go::Last => last,
            Go::NextEvent => events.iter().copied().find(|&event| event > step).unwrap_or(step),
            Go::PreviousEvent => events.iter().copied().rev().find(|&event| event < step).unwrap_or(step),
        };
        if let Go::Step(to) = go
            && to > last
        {
            self.messages.problem(format!("Step {to} does not exist: the last one is {last}."), None);
        }
        self.cursor.step = to.min(last);
        if self.refusal.as_ref().is_some_and(|refusal| refusal.place.step != self.cursor.step) {
            self.refusal = None;
        }
    }

    fn open_traverse(&mut self, id: String) {
        if self.traverse.as_ref().is_some_and(|open| open.id == id) {
            return;
        }
        self.open(id);
    }

    fn select_run(&mut self, target: usize, run: usize) {
        let is_other = self.cursor.target != Some(target) || self.cursor.run != run;
        let (before, camera) = (self.own_name(), self.camera());
        self.cursor = Cursor { target: Some(target), run, ..self.cursor };
        if self.camera() != camera {
            self.fit_images();
        }
        self.keep_comparison(before, self.cursor);
        if is_other {
            self.draft.clear();
        }
    }

    pub(crate) fn set_mode(&mut self, mode: Mode) {
        if mode == Mode::Look {
            (self.repicks, self.refusal, self.trackability.judged) = (None, None, None);
        }
        if mode == Mode::Look && self.mode == Mode::Look {
            self.messages.close_card();
        }
        if mode == Mode::Pick {
            self.refusal = None;
            if self.session.is_none() {
                self.messages.problem("There is nothing to pick yet: no traverse is open.", None);
                return;
            }
        }
        self.mode = mode;
    }

    /// Designates a target at a pixel, or advises against it, once its trackability is computed. The first click starts
    /// picking.
    pub(crate) fn pick(&mut self, pixel: Pixel) {
        let place = ImagePosition { step: self.cursor.step, pixel, camera: self.camera() };
        if self.mode == Mode::Look {
            self.set_mode(Mode::Pick);
            self.sync_trackability();
        }
        if self.is_to_be_judged(place) {
            (self.trackability.judged, self.refusal) = (Some(place), None);
            return;
        }
        self.trackability.judged = None;
        self.refusal = self.advised_against(place);
        if self.refusal.is_none() {
            self.designate(place);
        }
    }

    /// Designates a target at an image position.
    pub(crate) fn designate(&mut self, place: ImagePosition) {
        if self.designating.is_some() {
            self.messages.note("The last designation is still being computed.");
            return;
        }
        let Some(session) = self.session_id() else { return };
        let again = self.repicked(place.step);
        let (label, settings) = again.map(|(label, settings)| (Some(label), settings)).unwrap_or_default();
        let at = NewTarget::at_pixel(place.step, place.pixel);
        let target = NewTarget { camera: place.camera, label, settings, ..at };
        let call = Call::with_body::<DesignateTarget>(&AtSession { session }, &target);
        let take = |state: &mut Self, Designated { target, session, .. }| state.designated(target, session);
        self.call_or::<DesignateTarget>(call, take, |state, problem| {
            if let Some(place) = state.designating.take() {
                let (sentence, nearest) = (problem.detail.clone(), problem.nearest_pixel.as_deref().copied());
                state.refusal = Some(Refusal { place, sentence, nearest, is_advice: false });
            }
            Notice::List
        });
        (self.designating, self.refusal) = (Some(place), None);
    }

    /// Stops a run, or resumes a stopped one.
    fn switch_run<E: Endpoint<At = AtRun, Body = NoBody>>(&mut self, target: usize, run: usize) {
        let Some(session) = self.session_id() else { return };
        let call = Call::to::<E>(&AtRun { session, target, run });
        self.call::<E>(call, |state, _| state.sync.session_stale = true);
    }

    /// Forks the selected run at the cursor; at the designation, the whole run is recomputed.
    fn run_from_here(&mut self, changes: Changes) {
        let Some((target, run)) = self.target().map(|t| t.number).zip(self.run().map(|r| r.number)) else {
            self.messages.problem("There is no run to leave: pick a target first.", None);
            return;
        };
        let first = self.run().and_then(|run| run.rows.first()).map_or(0, |row| row.step);
        let computed = self.run().and_then(|run| run.rows.last()).map_or(first, |row| row.step);
        let from_step = self.cursor.step.clamp(first, computed + 1);
        let new = NewRun { run, from_step, settings: changes, prediction_px: None };
        if self.fork(target, &new) {
            self.messages
                .note_of_session(format!("Running {} again from step {from_step} …", run_letter(run)));
        }
    }

    /// Opens a path below `/api/v1/` in a new tab.
    pub(crate) fn open_path(&mut self, path: &str) {
        self.outbox.add(Effect::OpenUrl(format!("{}/api/v1/{path}", self.origin)));
    }

    /// Forks a run of a target; false if no session is open.
    pub(crate) fn fork(&mut self, target: usize, new: &NewRun) -> bool {
        let Some(session) = self.session_id() else { return false };
        let call = Call::with_body::<ForkRun>(&AtTarget { session, target }, new);
        self.call::<ForkRun>(call, move |state, run| state.on_run_reply(target, run));
        true
    }
}
