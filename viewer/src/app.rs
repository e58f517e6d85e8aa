//! The application: lays the panels out and carries their commands to state and network.

use egui::{CentralPanel, Context, Frame, Margin, Panel, Ui};
use egui_tiles::{Tile, Tree};

use crate::command::Command;
use crate::layout::{LeftImage, Pane, Panels, overview};
use crate::net::{Net, Request};
use crate::panels::{bars, help, timeline};
use crate::state::{Connection, State};
use crate::status::Publisher;
use crate::{keys, theme};

/// Where a page begins.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Where the server is, without a slash at the end.
    pub origin: String,
    /// The session to open; none opens the latest of the first traverse, or begins one.
    pub session: Option<String>,
}

/// The application.
pub struct SightlineApp {
    state: State,
    net: Net,
    tree: Tree<Pane>,
    left_image: LeftImage,
    publisher: Publisher,
    linked: Option<String>,
}

impl SightlineApp {
    /// The application as it is when the page opens.
    pub fn new(context: &Context, link: Link) -> Self {
        theme::apply(context);
        let mut state = State::new(link.origin.clone(), link.session);
        state.begin();
        let net = Net::new(link.origin, context.clone());
        let (left_image, publisher, linked) = (None, Publisher::default(), None);
        Self { state, net, tree: overview(), left_image, publisher, linked }
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
        self.state.tick(now);
        self.send();
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
        let mut out = keys::commands(ui.ctx(), &self.state);
        let state = &self.state;
        let bar = Frame::new().fill(theme::BAR).inner_margin(Margin::symmetric(10, 3));
        Panel::top("top").exact_size(34.0).frame(bar).show(ui, |ui| bars::top(ui, state, &mut out));
        if matches!(state.connection, Connection::Gone { .. }) {
            Panel::top("banner").frame(bar).show(ui, |ui| bars::banner(ui, state, &mut out));
        }
        Panel::bottom("stages").exact_size(30.0).frame(bar).show(ui, |ui| bars::stages(ui, state, &mut out));
        let foot = Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(10, 4));
        Panel::bottom("timeline").exact_size(timeline::height(state) + 36.0).frame(foot).show(ui, |ui| {
            bars::transport(ui, state, &mut out);
            timeline::show(ui, state, &mut out);
        });
        let mut panels = Panels { state, out: &mut out, left_image: None, seen: Vec::new() };
        CentralPanel::default()
            .frame(Frame::new().fill(theme::PAGE))
            .show(ui, |ui| self.tree.ui(&mut panels, ui));
        self.left_image = panels.left_image;
        let [is_history_seen, is_studies_seen] =
            [Pane::History, Pane::Studies].map(|pane| panels.seen.contains(&pane));
        help::show(ui, state, &mut out);
        // Every step's window is worth fetching only while the panel that shows them is on the screen.
        self.state.wants_history = is_history_seen;
        if is_studies_seen {
            self.state.want_studies();
        }
        out
    }

    /// Carries out what was asked for.
    fn carry_out(&mut self, context: &Context, commands: Vec<Command>) {
        if commands.is_empty() {
            return;
        }
        for command in commands {
            self.state.apply(command);
        }
        if self.state.ask.take_reveal() {
            let is_box = |tile: &Tile<Pane>| matches!(tile, Tile::Pane(Pane::Breakpoints));
            self.tree.make_active(|_, tile| is_box(tile));
        }
        self.send();
        // What was asked for shows in the next frame, which otherwise only comes with the next event.
        context.request_repaint();
    }

    /// Tells the page what is open, so that its link opens the same again.
    fn keep_link(&mut self) {
        let session = self.state.session.as_ref().map(|session| session.id.clone());
        if session != self.linked {
            #[cfg(target_arch = "wasm32")]
            if let Some(id) = &session {
                crate::web::keep_link(id);
            }
            self.linked = session;
        }
    }
}

impl eframe::App for SightlineApp {
    fn logic(&mut self, context: &Context, _frame: &mut eframe::Frame) {
        self.exchange(context);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        let commands = self.lay_out(ui);
        let context = ui.ctx().clone();
        self.carry_out(&context, commands);
        if let Some(url) = self.state.open_url.take() {
            context.open_url(egui::OpenUrl::new_tab(url));
        }
        self.keep_link();
        self.wake_for_retries(&context);
        self.wake_for_play(&context);
        self.publisher.publish(&self.state, &self.left_image, context.zoom_factor());
    }

    fn clear_color(&self, _visuals: &egui::Visuals) -> [f32; 4] {
        theme::PAGE.to_normalized_gamma_f32()
    }
}
