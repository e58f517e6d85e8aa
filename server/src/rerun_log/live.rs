//! A live recording: two ports of this machine only, off until a person asks for them.
//!
//! One port streams the data (gRPC), the other serves the viewer's page. Neither asks for a token, so every
//! program and every user of this machine can read the stream while it is on; whoever offers it must say so.
//! The stream ends when the value is dropped.

use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rerun::{MemoryLimit, ServerOptions};
use sightline_geometry::error::{Error, Result};
use sightline_rover::pipeline::Stops;
use sightline_session::Session;
use sightline_session::step::RunStep;

use super::page::ViewerPage;
use super::recorder::{Recorder, RunLog, builder};

/// How much of the stream is kept for pages that are opened later, bytes. Beyond it the oldest rows are
/// forgotten; what is outside of all time never is.
const HISTORY_BYTES: u64 = 1 << 30;

/// How long the stream may take to listen.
const PATIENCE: Duration = Duration::from_secs(5);

/// A live recording.
pub struct LiveStream {
    recorder: Mutex<Recorder>,
    page: ViewerPage,
    port: u16,
}

impl LiveStream {
    /// Opens both ports, which are free ones of the loopback address.
    ///
    /// # Errors
    /// [`Error::Request`] when a port cannot be opened.
    pub fn start() -> Result<Self> {
        let port = free_port().map_err(|error| refused(&error))?;
        let options = ServerOptions {
            memory_limit: MemoryLimit::from_bytes(HISTORY_BYTES),
            ..ServerOptions::default()
        };
        let stream = builder("live")?.serve_grpc_opts(Ipv4Addr::LOCALHOST.to_string(), port, options);
        let recorder = Recorder::new(stream.map_err(|error| refused(&error))?, true);
        wait_for(port)?;
        let page = ViewerPage::start(port).map_err(|error| refused(&error))?;
        Ok(Self { recorder: Mutex::new(recorder), page, port })
    }

    /// The page that shows the stream.
    pub fn viewer_url(&self) -> String {
        let source = format!("rerun%2Bhttp%3A%2F%2F127.0.0.1%3A{}%2Fproxy", self.port);
        format!("{}/?url={source}&hide_welcome_screen&persist=false", self.page.url())
    }

    /// Where the data come from, for a viewer of one's own.
    pub fn stream_url(&self) -> String {
        format!("rerun+http://127.0.0.1:{}/proxy", self.port)
    }

    /// Brings the stream up to a session: every step of every run that is not in it yet. To be called again
    /// whenever the session went on; runs never change, so nothing is sent twice.
    ///
    /// # Errors
    /// [`Error::Request`] when rerun cannot take the rows.
    pub fn log_session(&self, traverse_name: &str, stops: &dyn Stops, session: &Session) -> Result<()> {
        let labels: Vec<_> = session.targets.iter().map(|target| target.label.as_str()).collect();
        let live = session.targets.iter().enumerate().filter(|(_, target)| !target.removed);
        let runs: Vec<_> = live
            .flat_map(|(number, target)| {
                let runs = target.runs.iter().enumerate().filter(|(_, record)| !record.removed);
                runs.map(move |(run, record)| (number, run, record))
            })
            .map(|(target, run, record)| RunLog { target, run, label: labels[target], steps: &record.steps })
            .collect();
        runs.iter().try_for_each(|run| self.log_run(traverse_name, stops, run))
    }

    /// The same for one run.
    ///
    /// # Errors
    /// As [`Self::log_session`].
    pub(crate) fn log_run(&self, traverse_name: &str, stops: &dyn Stops, run: &RunLog<'_>) -> Result<()> {
        run.steps.iter().try_for_each(|trace| self.log_step(traverse_name, stops, run, trace))
    }

    /// The same for one step of a run whose `steps` hold at least the designation.
    ///
    /// # Errors
    /// As [`Self::log_session`].
    pub(crate) fn log_step(
        &self,
        traverse_name: &str,
        stops: &dyn Stops,
        run: &RunLog<'_>,
        trace: &RunStep,
    ) -> Result<()> {
        let mut recorder = self.recorder();
        let logged = recorder
            .log_traverse(traverse_name, stops)
            .and_then(|()| recorder.log_runs(std::slice::from_ref(run), stops))
            .and_then(|()| recorder.log_step(run, stops, trace));
        logged.map_err(|error| refused(&error))
    }

    /// A panic while logging leaves at worst a step half logged, which the next ones do not build on.
    fn recorder(&self) -> MutexGuard<'_, Recorder> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A port that was free a moment ago: rerun takes a number and not a socket.
fn free_port() -> std::io::Result<u16> {
    Ok(TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?.port())
}

/// Waits until the stream's own thread listens, because it reports a failure only to its log.
fn wait_for(port: u16) -> Result<()> {
    let (address, until) = (SocketAddr::from((Ipv4Addr::LOCALHOST, port)), Instant::now() + PATIENCE);
    while Instant::now() < until {
        if TcpStream::connect_timeout(&address, PATIENCE).is_ok() {
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Err(Error::Request(format!("the rerun stream does not listen on port {port}; try again")))
}

fn refused(error: &dyn std::fmt::Display) -> Error {
    Error::Request(format!("the rerun stream could not be used: {error}"))
}
