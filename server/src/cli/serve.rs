//! `sightline serve`: serves the page, the REST interface and the sessions of one or more traverses.

use std::fs::{File, TryLockError};
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Traverse;

use super::{open, terminal};
use crate::access::{Access, Token};
use crate::connections;
use crate::first_session;
use crate::folders::Folders;
use crate::hosts::Hosts;
use crate::limits::Limits;
use crate::memory;
use crate::public_url::PublicUrl;
use crate::state::AppState;

/// How long shutdown waits for work that does not check a cancel flag.
const SHUTDOWN: Duration = Duration::from_secs(1);

/// The environment variable with the access token: unlike arguments, other users of the machine cannot read it.
const TOKEN_VARIABLE: &str = "SIGHTLINE_TOKEN";

/// Open traverses in the browser.
#[derive(Debug, Args)]
pub(super) struct Serve {
    /// Folders or indexes of traverses, or scenarios to simulate; none for the first drive, with a target that is lost.
    traverses: Vec<PathBuf>,
    /// A folder below which pages may open recordings (KITTI, PDS3, drives); can be given more than once.
    #[arg(long, value_name = "FOLDER")]
    recordings: Vec<PathBuf>,
    /// The port; 0 for any free port.
    #[arg(long, default_value_t = 7700)]
    port: u16,
    /// The address to listen on; an address other than loopback also needs --allow-host or --behind-proxy.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    listen: IpAddr,
    /// A further name under which the server may be addressed; can be given more than once.
    #[arg(long, value_name = "NAME")]
    allow_host: Vec<String>,
    /// The address under which a reverse proxy publishes the server, such as https://rover.example/sightline/.
    #[arg(long, value_name = "URL", value_parser = PublicUrl::parse)]
    behind_proxy: Option<PublicUrl>,
    /// The access token, 16 letters or more, instead of a random one; also the variable SIGHTLINE_TOKEN.
    #[arg(long, value_name = "TOKEN", value_parser = Token::chosen)]
    token: Option<Token>,
    /// Allow access without a token, for every user of this machine and every client that reaches the server.
    #[arg(long, conflicts_with = "token")]
    no_token: bool,
    /// Where sessions and simulated traverses are kept.
    #[arg(long, value_name = "FOLDER")]
    data_dir: Option<PathBuf>,
    /// Set a limit of the server; can be given more than once. `--limit help` lists all of them.
    #[arg(long, value_name = "NAME=VALUE")]
    limit: Vec<String>,
}

impl Serve {
    /// Serves until the program is stopped.
    ///
    /// # Errors
    /// A traverse that cannot be opened, a data folder in use, or a port in use.
    pub(super) fn run(self) -> Result<()> {
        let mut limits = Limits::default();
        if self.limit.iter().any(|text| text == "help") {
            return terminal::line(limits.table().trim_end());
        }
        self.limit.iter().try_for_each(|text| limits.set(text))?;
        if !self.listen.is_loopback() && self.allow_host.is_empty() && self.behind_proxy.is_none() {
            let message = "listening beyond this machine needs --allow-host with the name by which pages will \
                           address the server, or --behind-proxy";
            return Err(Error::Request(message.to_owned()));
        }
        if !self.listen.is_loopback() && self.no_token {
            let message = "listening beyond this machine needs an access token; leave --no-token out";
            return Err(Error::Request(message.to_owned()));
        }
        let token = self.token()?;
        let data = open::data_folder(self.data_dir.as_deref())?;
        let listener = bind(SocketAddr::new(self.listen, self.port))?;
        let address = listener.local_addr().map_err(|error| Error::Request(error.to_string()))?;
        let _lock = lock(&data)?;
        let traverses = self.open_traverses(&data)?;
        let folders = Folders { sessions: data.join("sessions"), ..Folders::in_one(&data) };
        let folders = folders.with_recordings(&self.recordings)?;
        let runtime = super::runtime()?;
        let inside = runtime.enter();
        let hosts = Hosts::new(address.port(), &self.allow_host);
        let access = match token.clone() {
            Some(token) => Access::with_token(hosts, token),
            None => Access::without_token(hosts),
        };
        let access = match self.behind_proxy.clone() {
            Some(public) => access.behind_proxy(public),
            None => access,
        };
        let state = AppState::with_folders(traverses, &folders, access, limits)?;
        if token.is_none() {
            terminal::error("warning: without an access token every user of this machine can use the server");
        }
        if self.traverses.is_empty() {
            let begun = first_session::begin(&state, &first_session::scenario()?);
            begun.map_err(|problem| Error::Request(problem.problem().detail.clone()))?;
        }
        let page = self.behind_proxy.as_ref().map_or_else(|| page(address), PublicUrl::to_string);
        let ended = runtime.block_on(serve(listener, &with_token(&page, token.as_ref()), state));
        drop(inside);
        // Unfinished work is lost in any case: none of it is on disk before it is complete.
        runtime.shutdown_timeout(SHUTDOWN);
        ended
    }

    /// The access token; `None` with `--no-token`.
    fn token(&self) -> Result<Option<Token>> {
        if self.no_token {
            return Ok(None);
        }
        if let Some(token) = &self.token {
            return Ok(Some(token.clone()));
        }
        let chosen = std::env::var(TOKEN_VARIABLE).ok().filter(|text| !text.is_empty());
        chosen.map_or_else(Token::random, |text| Token::chosen(&text)).map(Some)
    }

    fn open_traverses(&self, data: &Path) -> Result<Vec<Traverse>> {
        if self.traverses.is_empty() {
            return Ok(vec![open::simulated(&first_session::scenario()?, data)?]);
        }
        self.traverses.iter().map(|path| open::open(path, Some(data))).collect()
    }
}

async fn serve(listener: TcpListener, url: &str, state: AppState) -> Result<()> {
    let failed = |error: std::io::Error| Error::Request(format!("the server stopped: {error}"));
    let listener = tokio::net::TcpListener::from_std(listener).map_err(failed)?;
    let (app, connections) = (crate::app(state.clone()), Arc::clone(state.connections()));
    terminal::line(&format!("Sightline is ready: {url}"))?;
    let ended = tokio::select! {
        never = connections::serve(listener, app, state.limits(), connections) => match never {},
        never = memory::return_freed_memory() => match never {},
        () = shutdown_signal() => Ok(()),
    };
    // Only a cursor that moved very recently is not on disk yet.
    state.store().flush()?;
    ended
}

/// Waits for Ctrl-C or a termination signal.
async fn shutdown_signal() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        // SIGHUP: the terminal was closed.
        let signals = (signal(SignalKind::terminate()), signal(SignalKind::hangup()));
        if let (Ok(mut terminate), Ok(mut hang_up)) = signals {
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {}
                _ = terminate.recv() => {}
                _ = hang_up.recv() => {}
            }
            return;
        }
    }
    // If the handlers cannot be installed, the signals end the program at once, which is the default.
    let _ = tokio::signal::ctrl_c().await;
}

/// Binds the port before any long work begins.
fn bind(address: SocketAddr) -> Result<TcpListener> {
    let listener = TcpListener::bind(address).map_err(|error| match error.kind() {
        std::io::ErrorKind::AddrInUse => {
            let port = address.port();
            Error::Request(format!(
                "port {port} is taken; choose another one with --port, or --port 0 for a free one"
            ))
        }
        _ => Error::Request(format!("cannot listen on {address}: {error}")),
    })?;
    listener.set_nonblocking(true).map_err(|error| Error::Request(error.to_string()))?;
    Ok(listener)
}

/// The address of the page for a browser.
fn page(address: SocketAddr) -> String {
    if address.ip().is_unspecified() {
        format!("http://127.0.0.1:{}/", address.port())
    } else {
        format!("http://{address}/")
    }
}

/// The address with the token in its fragment, which a browser never sends.
fn with_token(page: &str, token: Option<&Token>) -> String {
    let fragment = token.map(|token| format!("#token={}", token.secret())).unwrap_or_default();
    format!("{page}{fragment}")
}

/// Locks the data folder against a second server; the system releases the lock when the program ends.
fn lock(data: &Path) -> Result<File> {
    let path = data.join("lock");
    let unwritable = |source| Error::Write { path: path.clone(), source };
    crate::folders::make(data).map_err(unwritable)?;
    let file = File::create(&path).map_err(unwritable)?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::Error(source)) => Err(unwritable(source)),
        Err(TryLockError::WouldBlock) => {
            let folder = data.display();
            Err(Error::Request(format!(
                "another server uses {folder}; choose another folder with --data-dir"
            )))
        }
    }
}
