//! `sessions/{session}/targets`: designates, renames and removes targets.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{DesignateTarget, RemoveTarget, RenameTarget};
use sightline_api::location::AtTarget;
use sightline_api::wire::{Designated, NewTarget, TargetLabel};
use sightline_session::Session;
use sightline_session::view::SessionView;
use sightline_track::settings::Settings;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelFlag;
use crate::extract::{Body, SessionPath, TargetPath};
use crate::jobs::blocking;
use crate::limits::Limits;
use crate::live_session::{LABEL_LIMIT, LiveSession};
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::{location, route};
use crate::routes::trackability;
use crate::runner;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<DesignateTarget>(routes!(designate)))
        .routes(route::<RenameTarget>(routes!(rename)))
        .routes(route::<RemoveTarget>(routes!(remove)))
}

/// Designates a target
///
/// The designation is computed before the answer; the later steps follow in the background.
#[utoipa::path(post, operation_id = "designate_target", path = DesignateTarget::PATH, tag = "targets", request_body = NewTarget, responses((status = 201, body = Designated), ApiError))]
async fn designate(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(new): Body<DesignateTarget>,
) -> ApiResult<Response> {
    check_label(new.label.as_deref().unwrap_or_default())?;
    let settings = Settings::default().with(&new.settings)?;
    let work_state = state.clone();
    state.designations().run_until_dropped(move |cancel| add(&work_state, &live, new, settings, cancel)).await
}

/// Checks the length of a label.
///
/// # Errors
/// A problem that names the field and the limit.
fn check_label(label: &str) -> ApiResult<()> {
    if label.chars().count() <= LABEL_LIMIT {
        return Ok(());
    }
    Err(ApiError::invalid("field", format!("label: may have at most {LABEL_LIMIT} characters")))
}

/// Renames a target
///
/// A blank label restores the default one, `target` and the number from 1.
#[utoipa::path(put, operation_id = "rename_target", path = RenameTarget::PATH, tag = "targets", request_body = TargetLabel, responses((status = 200, body = SessionView), ApiError))]
async fn rename(
    State(state): State<AppState>,
    TargetPath { live, target }: TargetPath,
    Body(TargetLabel { label }): Body<RenameTarget>,
) -> ApiResult<Json<SessionView>> {
    check_label(&label)?;
    blocking(move || {
        state.change(&live, |session| {
            session.rename_target(target, &label).map_err(|error| ApiError::from(error).about_path())
        })?;
        Ok(Json(state.view(&live)))
    })
    .await
}

/// Removes a target; its number is not reused
#[utoipa::path(delete, operation_id = "remove_target", path = RemoveTarget::PATH, tag = "targets", responses((status = 200, body = SessionView), ApiError))]
async fn remove(
    State(state): State<AppState>,
    TargetPath { live, target }: TargetPath,
) -> ApiResult<Json<SessionView>> {
    blocking(move || {
        let remove = |session: &mut Session| {
            session.remove_target(target).map_err(|error| ApiError::from(error).about_path())
        };
        state.change_and(&live, remove, |()| live.cancel_runs(target, None))?;
        Ok(Json(state.view(&live)))
    })
    .await
}

/// Computes the designation and adds its target, unless the request was dropped in the meantime.
fn add(
    state: &AppState,
    live: &Arc<LiveSession>,
    new: NewTarget,
    settings: Settings,
    cancel: &CancelFlag,
) -> ApiResult<Response> {
    let limits = state.limits();
    live.with(|session| has_number(session, limits))?;
    let named = new.place().name(&live.traverse().traverse, new.step)?;
    let designation = named.designation;
    let first = runner::designate(&live.traverse(), designation, &settings, cancel)
        .map_err(|error| trackability::refusal(state, &live.traverse(), designation, &settings, error))?;
    let first = Arc::new(first);
    let gap_m = named.gap_m(&first);
    let target = state.change(live, |session| {
        has_number(session, limits)?;
        Ok(session.add_target(new.label, settings, first))
    })?;
    state.prefetch_from(&live.traverse(), designation.step);
    start_or_fail(state, live, target, 0);
    let at = AtTarget { session: live.id.clone(), target };
    Ok((
        StatusCode::CREATED,
        location::<RemoveTarget>(&at),
        Json(Designated { target, gap_m, session: state.view(live) }),
    )
        .into_response())
}

/// Checks the number of targets before another one is added.
///
/// # Errors
/// A problem if there are too many.
pub(crate) fn has_room(session: &Session, limits: &Limits) -> ApiResult<()> {
    let most = limits.targets.count();
    if session.target_count() < most {
        return Ok(());
    }
    let detail = format!("A session may have at most {most} targets.");
    Err(ApiError::conflict(detail).hint(limits.targets.hint("Remove one that is not needed.")))
}

/// Checks the numbers of targets, including removed ones, before another one is added.
fn has_number(session: &Session, limits: &Limits) -> ApiResult<()> {
    has_room(session, limits)?;
    let most = limits.target_numbers.count();
    if session.targets.len() < most {
        return Ok(());
    }
    let detail = format!("A session may have at most {most} targets, the removed ones included.");
    Err(ApiError::conflict(detail).hint(limits.target_numbers.hint("Begin another session.")))
}

/// Continues a run; if the queue is full, the run reports this and can be resumed.
pub(crate) fn start_or_fail(state: &AppState, live: &Arc<LiveSession>, target: usize, run: usize) {
    if let Err(busy) = state.runner().start(live, target, run) {
        // The target may have been removed in the meantime.
        let _ = live.with(|session| session.fail(target, run, busy.problem().detail.clone()));
    }
}
