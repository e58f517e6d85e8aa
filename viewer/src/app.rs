//! The application: lays out the panels, and passes their commands to the state, the layout and the network.

use egui::{CentralPanel, Context, Frame, Margin, Panel, Ui};

use crate::access::press;
use crate::command::Command;
use crate::command::keys;
use crate::command::{help, palette};
use crate::exports::window as exports_window;
use crate::figure::request::FigureRequest;
use crate::files::download;
use crate::files::inbox::Inbox;
use crate::files::window as files_window;
use crate::layout::command::LayoutCommand;
use crate::layout::left_image::LeftImage;
use crate::layout::workspace::Workspace;
use crate::layout::{Panels, region};
use crate::net::Net;
use crate::net::events::Connection;
use crate::net::request::Request;
use crate::notes::panel as notes_panel;
use crate::page::link::Fragment;
use crate::page::status::Publisher;
use crate::page::storage;
use crate::panels::pane::{Need, Pane};
use crate::panels::{bars, card, timeline};
use crate::state::State;
use crate::state::effect::Effect;
use crate::state::hovered;
use crate::tour::bubbles;
use crate::trackability::limits_window;
use crate::{figure, theme, tour};

/// The server and the view that a page opens with.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Base URL of the server, without a trailing slash.
    pub origin: String,
    /// The view to open. Without a session: the latest session of the first traverse, or a new one.
    pub fragment: Fragment,
}

/// The application.
pub struct SightlineApp {
    state: State,
    net: Net,
    workspace: Workspace,
    left_image: LeftImage,
    publisher: Publisher,
    /// The link as it is in the page's address.
    linked: Fragment,
    stored: storage::StoredSettings,
    is_tour_stored: bool,
    /// Screen rectangles of the panels, points.
    places: Vec<(Pane, egui::Rect)>,
    inbox: Inbox,
    /// Effects of replies and events, carried out in the next frame.
    waiting: Vec<Effect>,
}

impl SightlineApp {
    /// The application in its initial state.
    pub fn new(context: &Context, link: Link) -> Self {
        let stored = storage::StoredSettings::read();
        let mut state = State::new(link.origin.clone(), link.fragment.session.clone());
        state.colour_theme = stored.colour_theme().unwrap_or_default();
        state.single_keys = stored.single_keys();
        state.stretch = stored.stretch().unwrap_or_default();
        theme::apply(context, state.colour_theme);
        let mut workspace = Workspace::restored(stored.layout());
        if let Some(preset) = link.fragment.preset.filter(|preset| *preset != workspace.preset()) {
            workspace.apply(LayoutCommand::Use(preset));
        }
        state.begin();
        let linked = link.fragment.clone();
        state.open_link(link.fragment);
        state.tour.is_seen = tour::was_seen();
        let is_tour_stored = state.tour.is_seen;
        let net = Net::new(link.origin, context.clone());
        let (left_image, publisher, places) = (None, Publisher::default(), Vec::new());
        let inbox = Inbox::new(context.clone());
        Self {
            state,
            net,
            workspace,
            left_image,
            publisher,
            linked,
            stored,
            is_tour_stored,
            places,
            inbox,
            waiting: Vec::new(),
        }
    }

    /// Applies the replies and events that have arrived, and requests missing data.
    fn exchange(&mut self, context: &Context) {
        let now = context.input(|input| input.time);
        let (events, connection) = self.net.poll_events(now);
        for event in events {
            self.state.apply_event(event);
        }
        self.state.connected(connection);
        for completed in self.net.poll() {
            self.state.apply_reply(completed, now);
        }
        for arrival in self.inbox.poll() {
            self.state.file_arrived(arrival);
        }
        self.state.files.is_hovered = self.inbox.is_hovered();
        self.state.tick(now);
        self.send();
        self.request_missing_items(now);
    }

    /// Requests the items that the current view needs and the cache lacks.
    fn request_missing_items(&mut self, now: f64) {
        if matches!(self.state.connection, Connection::Gone { .. }) {
            return;
        }
        let needed = self.state.needed_items();
        let slow = self.state.unrendered(&needed);
        let (cache, net) = (&mut self.state.cache, &mut self.net);
        for key in cache.request(&needed, |key| net.take_place(key, slow.contains(key)), now) {
            self.net.send(Request::Item(key));
        }
    }

    /// Schedules a repaint for the next retry. Called from within a frame because egui drops repaint requests made
    /// elsewhere.
    fn wake_for_retries(&self, context: &Context) {
        let is_gone = matches!(self.state.connection, Connection::Gone { .. });
        let item = self.state.cache.next_retry().filter(|_| !is_gone);
        if let Some(at) = item.into_iter().chain(self.net.retry_at()).min_by(f64::total_cmp) {
            let now = context.input(|input| input.time);
            context.request_repaint_after(std::time::Duration::from_secs_f64((at - now).max(0.05)));
        }
    }

    /// Schedules a repaint for the next step of playback.
    fn wake_for_play(&self, context: &Context) {
        if let Some(due) = self.state.breakpoints.play.due_s() {
            let now = context.input(|input| input.time);
            context.request_repaint_after(std::time::Duration::from_secs_f64((due - now).max(0.0)));
        }
    }

    /// Sends the requests that replies and events led to; other effects wait for [`Self::settle`].
    fn send(&mut self) {
        for effect in self.state.take_effects() {
            match effect {
                Effect::Send(request) => self.net.send(request),
                other => self.waiting.push(other),
            }
        }
    }

    /// Carries out the waiting effects. Called within a frame, because egui opens tabs and copies text only there.
    fn settle(&mut self, context: &Context) {
        self.send();
        for effect in std::mem::take(&mut self.waiting) {
            self.carry_out(context, effect);
        }
    }

    /// Carries out one effect.
    fn carry_out(&mut self, context: &Context, effect: Effect) {
        match effect {
            Effect::Send(request) => self.net.send(request),
            Effect::OpenUrl(url) => context.open_url(egui::OpenUrl::new_tab(url)),
            Effect::CopyLink => self.copy_link(context),
            Effect::Layout(command) => self.workspace.apply(command),
            Effect::UseColourTheme(colour_theme) => theme::apply(context, colour_theme),
            Effect::SaveFigure(request) => self.save_figure(context, request),
            #[cfg(target_arch = "wasm32")]
            Effect::ChooseFile | Effect::ReadFile(_) => self.inbox.choose(),
            #[cfg(not(target_arch = "wasm32"))]
            Effect::ReadFile(path) => self.inbox.open_path(std::path::Path::new(&path)),
            #[cfg(target_arch = "wasm32")]
            Effect::ChooseRecording { is_archive } => self.inbox.choose_recording(is_archive),
            #[cfg(target_arch = "wasm32")]
            Effect::SendRecording(upload) => self.inbox.send_recording(&self.state.origin, upload),
            #[cfg(target_arch = "wasm32")]
            Effect::StopSending => self.inbox.stop_sending(),
            // Outside a browser, files are opened by path.
            #[cfg(not(target_arch = "wasm32"))]
            Effect::ChooseFile
            | Effect::ChooseRecording { .. }
            | Effect::SendRecording(_)
            | Effect::StopSending => {}
        }
    }

    /// Lays out all panels and returns their commands.
    fn lay_out(&mut self, ui: &mut Ui) -> Vec<Command> {
        let mut out = Vec::new();
        let state = &self.state;
        let bar = Frame::new().fill(theme::bar()).inner_margin(Margin::symmetric(10, 3));
        let top = Panel::top("top").exact_size(32.0).frame(bar).show(ui, |ui| {
            region(ui, "Status and actions", ui.max_rect());
            bars::top(ui, state, &mut out);
        });
        tour::here(ui.ctx(), tour::TOP, top.response.rect);
        if matches!(state.connection, Connection::Gone { .. }) {
            Panel::top("banner").frame(bar).show(ui, |ui| bars::banner(ui, state, &mut out));
        }
        Panel::bottom("stages").exact_size(28.0).frame(bar).show(ui, |ui| {
            region(ui, "Stages", ui.max_rect());
            bars::stages(ui, state, &mut out);
        });
        let foot = Frame::new().fill(theme::panel()).inner_margin(Margin::symmetric(10, 3));
        let band =
            Panel::bottom("timeline").exact_size(timeline::height(state) + 33.0).frame(foot).show(ui, |ui| {
                region(ui, "Timeline", ui.max_rect());
                bars::transport(ui, state, &mut out);
                timeline::show(ui, state, &mut out);
            });
        tour::here(ui.ctx(), tour::TIMELINE, band.response.rect);
        if let Some(size) = state.left_size() {
            self.workspace.fit_images(size);
        }
        let mut panels = Panels::new(state, &mut out);
        CentralPanel::default()
            .frame(Frame::new().fill(theme::page()))
            .show(ui, |ui| self.workspace.show(ui, &mut panels));
        self.left_image = panels.left_image;
        let needs: Vec<Need> = panels.seen.iter().flat_map(|pane| pane.panel().needs()).copied().collect();
        let places = panels.places;
        help::show(ui, state, &mut out);
        notes_panel::editor(ui, state, &mut out);
        exports_window::show(ui, state, &mut out);
        limits_window::show(ui, state, &mut out);
        files_window::show(ui, state, &mut out);
        card::show(ui, state, &mut out);
        palette::show(ui, state, &mut out);
        files_window::veil(ui, state);
        bubbles::show(ui, state, &mut out);
        self.places = places;
        self.state.exports.panes = self.places.iter().map(|(pane, _)| *pane).collect();
        self.state.fetch_for_panels(&needs);
        out
    }

    /// Takes the hovered location out of the commands; all panels show it in the next frame.
    fn point(&mut self, context: &Context, commands: &mut Vec<Command>) {
        let hovered = hovered::take_hovered(context, commands);
        if hovered != self.state.hovered {
            self.state.hovered = hovered;
            context.request_repaint();
        }
    }

    /// Handles the keys of this frame. Steps are applied at once, so that this frame shows their destination. The remaining
    /// commands depend on the view and are returned.
    fn take_keys(&mut self, context: &Context) -> Vec<Command> {
        let mut all = keys::commands(context, &self.state);
        let steps = all.iter().take_while(|command| command.is_step()).count();
        if steps == 0 {
            return all;
        }
        all.truncate(steps);
        self.apply(context, all);
        self.request_missing_items(context.input(|input| input.time));
        // Later keys apply to the step that the earlier ones led to.
        keys::commands(context, &self.state).into_iter().skip(steps).collect()
    }

    /// Applies the commands of a frame.
    fn follow(&mut self, context: &Context, commands: Vec<Command>) {
        if commands.is_empty() {
            return;
        }
        self.apply(context, commands);
        // The result is visible in the next frame, which egui would otherwise draw only at the next input event.
        context.request_repaint();
    }

    /// Applies commands to the state and carries out their effects.
    fn apply(&mut self, context: &Context, commands: Vec<Command>) {
        for command in commands {
            for effect in self.state.apply(command) {
                self.carry_out(context, effect);
            }
        }
        self.send();
    }

    /// Saves the requested figure.
    fn save_figure(&mut self, context: &Context, request: FigureRequest) {
        let file = figure::save::take(context, &self.state, &self.places, request);
        let saved = file.and_then(|file| {
            download::save(&file.name, file.media_type, &file.bytes)?;
            Ok(file.sentence)
        });
        match saved {
            Ok(sentence) => self.state.messages.note(sentence),
            Err(sentence) => self.state.messages.problem(sentence, None),
        }
    }

    /// The current view as the fragment of the page's address.
    fn fragment(&self) -> Fragment {
        let preset = Some(self.workspace.preset());
        Fragment { preset, unknown: self.linked.unknown.clone(), ..self.state.fragment() }
    }

    /// Stores that the tour was seen.
    fn keep_tour(&mut self) {
        if self.state.tour.is_seen && !self.is_tour_stored {
            tour::remember_seen();
            self.is_tour_stored = true;
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

    /// Follows an address that the user changed, by Back or by hand; otherwise writes the current view into the address.
    fn keep_link(&mut self) {
        #[cfg(target_arch = "wasm32")]
        {
            let present = Fragment::parse(&crate::page::web::hash());
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
            crate::page::web::keep_link(&fragment.text(), fragment.is_another_place(&self.linked));
            self.linked = Fragment::parse(&fragment.text());
        }
    }
}

impl eframe::App for SightlineApp {
    fn logic(&mut self, context: &Context, _frame: &mut eframe::Frame) {
        press::limit(context);
        self.exchange(context);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        keys::leave_clicked(ui.ctx());
        let context = ui.ctx().clone();
        let keys = self.take_keys(&context);
        // Pointer commands go first: Esc at the end of a drag undoes what the drag tried.
        let mut commands = self.lay_out(ui);
        self.point(&context, &mut commands);
        commands.extend(keys);
        self.follow(&context, commands);
        self.settle(&context);
        self.keep_link();
        self.keep_tour();
        self.stored.write(&context, &self.state, || self.workspace.to_stored());
        self.wake_for_retries(&context);
        self.wake_for_play(&context);
        self.publisher.publish(&self.state, &self.left_image, context.zoom_factor());
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        theme::page().to_normalized_gamma_f32()
    }
}
