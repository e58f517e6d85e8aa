//! Pages of plain HTML, made by the server: every step of every run with headings, tables and described pictures. They need
//! neither JavaScript nor WebGL, follow the reader's choice of light and dark, and read well aloud.
//!
//! `/page` lists the sessions, `…/sessions/{s}/page` the targets, runs and notes of one, `…/steps/{n}/page` shows a step.

mod arrays;
mod overview;
mod step;
mod values;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{ShowSessionPage, ShowSessionsPage, ShowStepPage};
use sightline_api::location::{AtSession, AtStep};
use utoipa::IntoResponses;
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{ContentBuilder, Ref, RefOr, ResponseBuilder};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelOnDrop;
use crate::exports::Source;
use crate::extract::Path;
use crate::html::escape;
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult, PROBLEM_JSON};
use crate::routes::route::route;
use crate::state::AppState;

/// The only style that these pages may have.
const STYLE: &str = include_str!("plain.css");

/// What the pages may do: show themselves and the images of this server.
static POLICY: LazyLock<String> = LazyLock::new(|| {
    let hash = STANDARD.encode(Sha256::digest(STYLE.as_bytes()));
    format!(
        "default-src 'none'; style-src 'sha256-{hash}'; img-src 'self' data:; base-uri 'none'; form-action 'none'; \
         frame-ancestors 'none'"
    )
});

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ShowSessionsPage>(routes!(all)))
        .routes(route::<ShowSessionPage>(routes!(session)))
        .routes(route::<ShowStepPage>(routes!(step)))
}

/// A plain page with all sessions
#[utoipa::path(get, operation_id = "plain_sessions", path = ShowSessionsPage::PATH, tag = "plain pages", responses(
    (status = 200, content_type = "text/html", body = String), NoPage))]
async fn all(State(state): State<AppState>) -> Response {
    answer::<ShowSessionsPage>(blocking(move || Ok(overview::all(&state))).await, None)
}

/// A plain page with the targets, runs and notes of a session
#[utoipa::path(get, operation_id = "plain_session", path = ShowSessionPage::PATH, tag = "plain pages",
    responses((status = 200, content_type = "text/html", body = String), NoPage))]
async fn session(State(state): State<AppState>, path: ApiResult<Path<ShowSessionPage>>) -> Response {
    let work = move || {
        let Path(AtSession { session }) = path?;
        let live = state.session(&session)?;
        Ok(overview::session(&Source::of(&live)))
    };
    answer::<ShowSessionPage>(blocking(work).await, None)
}

/// A plain page with everything that a step saw and decided
#[utoipa::path(get, operation_id = "plain_step", path = ShowStepPage::PATH,
    tag = "plain pages", responses((status = 200, content_type = "text/html", body = String), NoPage))]
async fn step(State(state): State<AppState>, path: ApiResult<Path<ShowStepPage>>) -> Response {
    let Path(AtStep { session, target, run, step }) = match path {
        Ok(path) => path,
        Err(problem) => return answer::<ShowStepPage>(Err(problem), None),
    };
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let id = session.clone();
    let find = state.session(&session);
    let made = match find {
        Ok(live) => {
            let work = move || step::html(&Source::of(&live), target, run, step, &flag);
            state.pictures().run(work).await
        }
        Err(problem) => Err(problem),
    };
    answer::<ShowStepPage>(made, Some(&id))
}

/// The answers where there is no page, for the OpenAPI document: a page that says why, or a problem where the request was
/// refused before any route.
struct NoPage;

impl IntoResponses for NoPage {
    fn responses() -> BTreeMap<String, RefOr<utoipa::openapi::Response>> {
        let page =
            || ContentBuilder::new().schema(Some(ObjectBuilder::new().schema_type(Type::String))).build();
        let problem = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem"))).build();
        let missing = ResponseBuilder::new().description("A page that says why there is none");
        let refused = ResponseBuilder::new().description("What is wrong and how to mend it");
        let refused = refused.content("text/html", page()).content(PROBLEM_JSON, problem).build();
        [
            ("404".to_owned(), RefOr::T(missing.content("text/html", page()).build())),
            ("default".to_owned(), RefOr::T(refused)),
        ]
        .into()
    }
}

/// The page, or a page that says why there is none.
fn answer<E: Endpoint>(made: ApiResult<String>, session: Option<&str>) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        (header::CONTENT_SECURITY_POLICY, POLICY.as_str()),
    ];
    match made {
        Ok(html) => (headers, relative(&html, E::PATH)).into_response(),
        Err(problem) => {
            let status = StatusCode::from_u16(problem.problem().status);
            let html = relative(&refused(&problem, session), E::PATH);
            (status.unwrap_or(StatusCode::INTERNAL_SERVER_ERROR), headers, html).into_response()
        }
    }
}

/// The page with its links written from where it is, so that it also works below a path of a reverse proxy. Texts are
/// escaped, so that only our own attributes have this form.
fn relative(html: &str, path: &str) -> String {
    let root = "../".repeat(path.matches('/').count() + 1);
    ["href", "src"]
        .into_iter()
        .fold(html.to_owned(), |html, name| html.replace(&format!("{name}=\"/"), &format!("{name}=\"{root}")))
}

fn refused(problem: &ApiError, session: Option<&str>) -> String {
    let said = problem.problem();
    let hint = said.hint.as_ref().map_or_else(String::new, |hint| format!("<p>{}</p>\n", escape(hint)));
    let back = session.filter(|id| crate::store::number_of(id).is_some()).map_or_else(String::new, |id| {
        format!("<li><a href=\"/api/v1/sessions/{id}/page\">Session {id}</a></li>")
    });
    let links = format!(
        "<nav aria-label=\"Elsewhere\"><ul>{back}<li><a href=\"/api/v1/page\">All sessions</a></li></ul></nav>"
    );
    page(
        "Not there",
        &format!("<h1>{}</h1>\n<p>{}</p>\n{hint}{links}", escape(&said.title), escape(&said.detail)),
    )
}

/// A whole page around its contents; `title` is not escaped yet.
fn page(title: &str, contents: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" type=\"image/svg+xml\" href=\"/icon.svg\">\n<title>{} · \
         Sightline</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>\n{contents}</main>\n</body>\n</html>\n",
        escape(title)
    )
}

/// The path of a step's page.
fn step_path(session: &str, target: usize, run: usize, step: usize) -> String {
    format!("/api/v1/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/page")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_climb_to_the_root_of_the_server() {
        let html =
            relative("<a href=\"/api/v1/page\">=&quot;/x</a><img src=\"/icon.svg\">", ShowSessionPage::PATH);
        let root = "../../../../";
        assert_eq!(html, format!("<a href=\"{root}api/v1/page\">=&quot;/x</a><img src=\"{root}icon.svg\">"));
    }
}
