//! The application: lays the panels out and carries their commands to state, arrangement and network.

use egui::{CentralPanel, Context, Frame, Margin, Panel, Ui};

use crate::command::Command;
use crate::inbox::Inbox;
use crate::layout::workspace::{LayoutCommand, Workspace};
use crate::layout::{LeftImage, Pane, Panels, region};
use crate::link::Fragment;
use crate::net::{Net, Request};
use crate::panels::{bars, card, export, help, limits, notes, open, palette, timeline, tour as bubbles};
use crate::state::{Connection, State};
use crate::status::Publisher;
use crate::{figure, keep, keys, picture, pointed, theme, tour};

/// Where a page begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Where the server is, without a slash at the end.
    pub origin: String,
    /// What to open; without a session the latest of the first traverse, or a new one.
    pub fragment: Fragment,
}

/// The application.
pub struct SightlineApp {
    state: State,
    net: Net,
    workspace: Workspace,
    left_image: LeftImage,
    publisher: Publisher,
    /// The link as the page's address has it.
    linked: Fragment,
    kept: keep::Kept,
    is_tour_kept: bool,
    /// Where the panels are on the screen, points.
    places: Vec<(Pane, egui::Rect)>,
    inbox: Inbox,
}

impl SightlineApp {
    /// The application as it is when the page opens.
    pub fn new(context: &Context, link: Link) -> Self {
        let kept = keep::Kept::read();
        let mut state = State::new(link.origin.clone(), link.fragment.session.clone());
        state.looks = kept.looks().unwrap_or_default();
        state.single_keys = kept.single_keys();
        theme::apply(context, state.looks);
        let mut workspace = Workspace::restored(kept.layout());
        if let Some(preset) = link.fragment.preset.filter(|preset| *preset != workspace.preset()) {
            workspace.apply(LayoutCommand::Use(preset));
        }
        state.begin();
        let linked = link.fragment.clone();
        state.open_link(link.fragment);
        state.tour.is_seen = tour::was_seen();
        let is_tour_kept = state.tour.is_seen;
        let net = Net::new(link.origin, context.clone());
        let (left_image, publisher, places) = (None, Publisher::default(), Vec::new());
        let inbox = Inbox::new(context.clone());
        Self { state, net, workspace, left_image, publisher, linked, kept, is_tour_kept, places, inbox }
    }

    /// Takes in what arrived and asks for what is missing.
    fn exchange(&mut self, context: &Context) {
        let now = context.input(|input| input.time);
        let (events, connection) = self.net.poll_events(now);
        for event in events {
            self.state.told(event);
        }
        self.state.connected(connection);
        for arrived in self.net.poll() {
            self.state.arrived(arrived, now);
        }
        for arrival in self.inbox.poll() {
            self.state.file_arrived(arrival);
        }
        self.state.files.is_hovered = self.inbox.is_hovered();
        self.state.tick(now);
        self.send();
        self.ask_for_missing(now);
    }

    /// Asks for what the cursor's step needs and is not there.
    fn ask_for_missing(&mut self, now: f64) {
        if matches!(self.state.connection, Connection::Gone { .. }) {
            return;
        }
        let wanted = self.state.wanted();
        let slow = self.state.unrendered(&wanted);
        let (cache, net) = (&mut self.state.cache, &mut self.net);
        for key in cache.want(&wanted, |key| net.take_place(key, slow.contains(key)), now) {
            self.net.send(Request::Item(key));
        }
    }

    /// Wakes the page when something is to be tried again: only from within a frame does egui keep that.
    fn wake_for_retries(&self, context: &Context) {
        let is_gone = matches!(self.state.connection, Connection::Gone { .. });
        let item = self.state.cache.next_retry().filter(|_| !is_gone);
        if let Some(at) = item.into_iter().chain(self.net.retry_at()).min_by(f64::total_cmp) {
            let now = context.input(|input| input.time);
            context.request_repaint_after(std::time::Duration::from_secs_f64((at - now).max(0.05)));
        }
    }

    /// Wakes the page when the next step is due that plays.
    fn wake_for_play(&self, context: &Context) {
        if let Some(due) = self.state.ask.play.due_s() {
            let now = context.input(|input| input.time);
            context.request_repaint_after(std::time::Duration::from_secs_f64((due - now).max(0.0)));
        }
    }

    fn send(&mut self) {
        for request in self.state.take_requests() {
            self.net.send(request);
        }
    }

    /// Lays everything out and gathers what was asked for.
    fn lay_out(&mut self, ui: &mut Ui) -> Vec<Command> {
        let mut out = Vec::new();
        let state = &self.state;
        let bar = Frame::new().fill(theme::bar()).inner_margin(Margin::symmetric(10, 3));
        let top = Panel::top("top").exact_size(34.0).frame(bar).show(ui, |ui| {
            region(ui, "Status and actions", ui.max_rect());
            bars::top(ui, state, &mut out);
        });
        tour::here(ui.ctx(), tour::TOP, top.response.rect);
        if matches!(state.connection, Connection::Gone { .. }) {
            Panel::top("banner").frame(bar).show(ui, |ui| bars::banner(ui, state, &mut out));
        }
        Panel::bottom("stages").exact_size(30.0).frame(bar).show(ui, |ui| {
            region(ui, "Stages", ui.max_rect());
            bars::stages(ui, state, &mut out);
        });
        let foot = Frame::new().fill(theme::panel()).inner_margin(Margin::symmetric(10, 4));
        let band =
            Panel::bottom("timeline").exact_size(timeline::height(state) + 36.0).frame(foot).show(ui, |ui| {
                region(ui, "Timeline", ui.max_rect());
                bars::transport(ui, state, &mut out);
                timeline::show(ui, state, &mut out);
            });
        tour::here(ui.ctx(), tour::TIMELINE, band.response.rect);
        let mut panels = Panels::new(state, &mut out);
        CentralPanel::default()
            .frame(Frame::new().fill(theme::page()))
            .show(ui, |ui| self.workspace.show(ui, &mut panels));
        self.left_image = panels.left_image;
        let [is_history_seen, is_studies_seen, is_why_seen, is_surface_seen] =
            [Pane::History, Pane::Studies, Pane::Why, Pane::Surface].map(|pane| panels.seen.contains(&pane));
        let wants_metrics = [Pane::Runs, Pane::Uncertainty].iter().any(|pane| panels.seen.contains(pane));
        let places = panels.places;
        help::show(ui, state, &mut out);
        notes::editor(ui, state, &mut out);
        export::show(ui, state, &mut out);
        limits::show(ui, state, &mut out);
        open::show(ui, state, &mut out);
        card::show(ui, state, &mut out);
        palette::show(ui, state, &mut out);
        open::veil(ui, state);
        bubbles::show(ui, state, &mut out);
        self.places = places;
        self.state.exports.panes = self.places.iter().map(|(pane, _)| *pane).collect();
        self.state.compare.wants_metrics = wants_metrics;
        self.state.want_tried_scores(is_surface_seen);
        // Every step's window is worth fetching only while the panel that shows them is on the screen.
        self.state.wants_history = is_history_seen;
        if is_why_seen {
            self.state.want_question();
            self.state.follow_why();
        }
        if is_studies_seen {
            self.state.want_studies();
        }
        out
    }

    /// Takes in what the pointer rests on: the next frame shows it in all panels.
    fn point(&mut self, context: &Context, commands: &mut Vec<Command>) {
        let pointed = pointed::taken_out(commands);
        if pointed != self.state.pointed {
            self.state.pointed = pointed;
            context.request_repaint();
        }
    }

    /// Takes the keys in. Steps are taken at once, so that the frame of the key shows where they lead; the rest, which
    /// follows what the page shows, is returned.
    fn take_keys(&mut self, context: &Context) -> Vec<Command> {
        let mut all = keys::commands(context, &self.state);
        let steps = all.iter().take_while(|command| command.is_step()).count();
        if steps == 0 {
            return all;
        }
        all.truncate(steps);
        self.carry_out(all);
        self.ask_for_missing(context.input(|input| input.time));
        // What follows is meant for the step to which they led.
        keys::commands(context, &self.state).into_iter().skip(steps).collect()
    }

    /// Carries out what was asked for of the page, and then of the state.
    fn follow(&mut self, context: &Context, commands: Vec<Command>) {
        if commands.is_empty() {
            return;
        }
        for command in &commands {
            match command {
                Command::Layout(command) => self.workspace.apply(*command),
                Command::CopyLink => self.copy_link(context),
                Command::SetLooks(looks) => theme::apply(context, *looks),
                _ => {}
            }
        }
        self.carry_out(commands);
        // What was asked for shows in the next frame, which otherwise only comes with the next event.
        context.request_repaint();
    }

    /// Carries out what was asked for of the state.
    fn carry_out(&mut self, commands: Vec<Command>) {
        for command in commands {
            self.state.apply(command);
        }
        if std::mem::take(&mut self.state.why.is_called) {
            self.workspace.apply(LayoutCommand::Show(Pane::Why));
        }
        self.take_files();
        if self.state.ask.take_reveal() {
            self.workspace.apply(LayoutCommand::Show(Pane::Breakpoints));
        }
        self.send();
    }

    /// Lets a file be chosen, or reads the one that was named.
    fn take_files(&mut self) {
        let wants_choice = std::mem::take(&mut self.state.files.wants_choice);
        let path = self.state.files.wants_path.take();
        #[cfg(target_arch = "wasm32")]
        if wants_choice || path.is_some() {
            self.inbox.choose();
        }
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(path) = path.filter(|_| !wants_choice) {
            self.inbox.open_path(std::path::Path::new(&path));
        }
    }

    /// Brings the panel to the front into which a file went.
    fn reveal(&mut self) {
        if let Some(pane) = self.state.files.reveal.take() {
            self.workspace.apply(LayoutCommand::Show(pane));
        }
    }

    /// Saves the figure that was asked for.
    fn save_figure(&mut self, context: &Context) {
        let Some(wish) = self.state.exports.figure_of.take() else { return };
        let file = figure::take::take(context, &self.state, &self.places, wish);
        let kept = file.and_then(|file| {
            picture::keep(&file.name, file.media_type, &file.bytes)?;
            Ok(file.sentence)
        });
        match kept {
            Ok(sentence) => self.state.messages.note(sentence),
            Err(sentence) => self.state.messages.problem(sentence, None),
        }
    }

    /// What the page's address should say.
    fn fragment(&self) -> Fragment {
        let preset = Some(self.workspace.preset());
        Fragment { preset, unknown: self.linked.unknown.clone(), ..self.state.fragment() }
    }

    /// Remembers that the tour was seen.
    fn keep_tour(&mut self) {
        if self.state.tour.is_seen && !self.is_tour_kept {
            tour::remember_seen();
            self.is_tour_kept = true;
        }
    }

    fn copy_link(&mut self, context: &Context) {
        let fragment = self.fragment().text();
        if fragment.is_empty() {
            self.state.messages.problem("There is nothing to link to yet: no session is open.", None);
            return;
        }
        context.copy_text(format!("{}/#{fragment}", self.state.origin));
        self.state.messages.note("The link to what you see is copied.");
    }

    /// Follows an address that was changed by Back or by hand, and writes what is looked at into it.
    fn keep_link(&mut self) {
        #[cfg(target_arch = "wasm32")]
        {
            let present = Fragment::parse(&crate::web::hash());
            if present != self.linked && present.session.is_some() {
                if let Some(preset) = present.preset.filter(|preset| *preset != self.workspace.preset()) {
                    self.workspace.apply(LayoutCommand::Use(preset));
                }
                self.linked = present.clone();
                self.state.open_link(present);
                return;
            }
        }
        let fragment = self.fragment();
        if fragment.session.is_some() && fragment.text() != self.linked.text() {
            #[cfg(target_arch = "wasm32")]
            crate::web::keep_link(&fragment.text(), fragment.is_another_place(&self.linked));
            self.linked = Fragment::parse(&fragment.text());
        }
    }
}

impl eframe::App for SightlineApp {
    fn logic(&mut self, context: &Context, _frame: &mut eframe::Frame) {
        self.exchange(context);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        keys::leave_clicked(ui.ctx());
        let context = ui.ctx().clone();
        let keys = self.take_keys(&context);
        // What the pointer did comes first: Esc at the end of a drag takes back what the drag tried.
        let mut commands = self.lay_out(ui);
        self.point(&context, &mut commands);
        commands.extend(keys);
        self.follow(&context, commands);
        if let Some(url) = self.state.open_url.take() {
            context.open_url(egui::OpenUrl::new_tab(url));
        }
        self.save_figure(&context);
        self.reveal();
        self.keep_link();
        self.keep_tour();
        self.kept.write(&context, &self.state, || self.workspace.kept());
        self.wake_for_retries(&context);
        self.wake_for_play(&context);
        self.publisher.publish(&self.state, &self.left_image, context.zoom_factor());
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        theme::page().to_normalized_gamma_f32()
    }
}
