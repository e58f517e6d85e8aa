//! The first start without a traverse: a simulated drive of sixty short stops, with a target that is tracked and then lost.
//!
//! The drive is the library's scenario [`library::FIRST`], the target is chosen by its rule, and the configuration is the
//! default; the outcome is computed live. The session is created once; changes by the user persist.

use std::sync::Arc;

use sightline_geometry::error::{Error, Result};
use sightline_session::Cursor;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_world::{Scenario, choose_targets, library};

use crate::cancel::CancelFlag;
use crate::live_session::LiveSession;
use crate::problem::ApiResult;
use crate::runner;
use crate::state::AppState;

/// The label of the target.
const LABEL: &str = "first target";

/// The scenario for a first start.
///
/// # Errors
/// As [`library::scenario`].
pub fn scenario() -> Result<Scenario> {
    library::scenario(library::FIRST)
}

/// Creates the session of the first traverse, if it has none; designates its target and starts its run in the background.
///
/// # Errors
/// A session that cannot be written, or a full queue.
pub fn begin(state: &AppState, scenario: &Scenario) -> ApiResult<()> {
    let Some(open) = state.traverses().first().cloned() else { return Ok(()) };
    if state.sessions().iter().any(|live| live.traverse().id == open.id) {
        return Ok(());
    }
    let live = state.begin_session(open)?;
    let (own, scenario) = (state.clone(), scenario.clone());
    state.jobs().submit(move || {
        if let Err(error) = designate(&own, &live, &scenario) {
            // The drive is available without a target; the page explains how to designate one.
            tracing::warn!(
                "the first target cannot be designated: {}",
                crate::printable::printable(&error.to_string())
            );
        }
    })
}

/// Designates the target chosen by the scenario's rule, and starts its run.
fn designate(state: &AppState, live: &Arc<LiveSession>, scenario: &Scenario) -> Result<()> {
    let open = live.traverse();
    let traverse = &open.traverse;
    let world = traverse.world().ok_or_else(|| Error::Request("the traverse has no world".to_owned()))?;
    let pixel = choose_targets(world, scenario, traverse.index()).first().copied();
    let pixel = pixel.ok_or_else(|| Error::Request("the scenario's rule finds no target".to_owned()))?;
    let settings = Settings::default();
    let designation = Designation::new(0, pixel);
    let first = runner::designate(&live.traverse(), designation, &settings, &CancelFlag::default())?;
    let problem = |error: crate::problem::ApiError| Error::Request(error.problem().detail.clone());
    let added = state.change(live, |session| {
        let target = session.add_target(Some(LABEL.to_owned()), settings, Arc::new(first));
        session.move_cursor(Cursor { target: Some(target), run: 0, step: 0 })?;
        Ok(target)
    });
    let target = added.map_err(problem)?;
    state.runner().start(live, target, 0).map_err(problem)
}
