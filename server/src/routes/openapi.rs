//! All routes with their descriptions: the router that answers requests also generates the OpenAPI document.

use std::sync::LazyLock;

use axum::http::header;
use axum::response::IntoResponse;
use serde_json::{Value, json};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::ShowOpenApi;
use sightline_api::event::Event;
use sightline_api::wire::{ExpressionProblem, Problem};
use utoipa::openapi::OpenApi;
use utoipa::openapi::security::{ApiKey, ApiKeyValue, HttpAuthScheme, HttpBuilder, SecurityScheme};
use utoipa::{Modify, OpenApi as _};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::{
    about, breakpoints, compare, counterfactual, documents, drive, events, exports, expressions, login,
    notes, odometry, photometry, plain, recordings, removal, rerun, runs, sessions, settings, steps, studies,
    targets, trackability, traverses, what_if, why,
};
use crate::routes::route::route;
use crate::state::AppState;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(title = "Sightline", description = "Sessions of the visual debugger for rover target tracking. \
        Units are in the names of fields (`_px`, `_m`, `_deg`, `_s`); `a_from_b` takes points of frame b into \
        frame a; pixel (0, 0) is the centre of the first pixel; what is not known is null."),
    servers((url = "/api/v1")),
    components(schemas(Problem, ExpressionProblem, Event)),
    security(("token" = []), ("cookie" = [])),
    modifiers(&SecuritySchemes)
)]
struct Document;

/// The two ways to send the access token.
struct SecuritySchemes;

impl Modify for SecuritySchemes {
    fn modify(&self, document: &mut OpenApi) {
        let about = "The access token that `sightline serve` prints";
        let bearer = HttpBuilder::new().scheme(HttpAuthScheme::Bearer).description(Some(about)).build();
        let about = "The cookie that `POST login` sets for a page; PORT is the server's port";
        let cookie = ApiKey::Cookie(ApiKeyValue::with_description("sightline-PORT", about));
        let components = document.components.get_or_insert_default();
        components.add_security_scheme("token", SecurityScheme::Http(bearer));
        components.add_security_scheme("cookie", SecurityScheme::ApiKey(cookie));
    }
}

static JSON: LazyLock<String> = LazyLock::new(|| {
    let mut document = serde_json::to_value(router().into_openapi()).unwrap_or_default();
    bound_integers(&mut document);
    document.to_string()
});

/// Adds a maximum to every integer whose type has none.
fn bound_integers(part: &mut Value) {
    match part {
        Value::Array(parts) => parts.iter_mut().for_each(bound_integers),
        Value::Object(parts) => {
            let is_integer = |of: &Value| {
                of == "integer" || of.as_array().is_some_and(|all| all.contains(&json!("integer")))
            };
            if parts.get("type").is_some_and(is_integer) && !parts.contains_key("maximum") {
                let is_signed = !parts.contains_key("minimum");
                let is_small = parts.get("format").is_some_and(|format| format == "int32");
                let max = match (is_signed, is_small) {
                    (true, true) => i32::MAX as u64,
                    (false, true) => u64::from(u32::MAX),
                    (true, false) => i64::MAX as u64,
                    (false, false) => u64::MAX,
                };
                parts.insert("maximum".to_owned(), json!(max));
            }
            parts.values_mut().for_each(bound_integers);
        }
        _ => {}
    }
}

/// The routes below `/api/v1`.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::with_openapi(Document::openapi())
        .merge(about::router())
        .merge(login::router())
        .routes(route::<ShowOpenApi>(routes!(document)))
        .merge(settings::router())
        .merge(traverses::router())
        .merge(recordings::router())
        .merge(sessions::router())
        .merge(targets::router())
        .merge(runs::router())
        .merge(drive::router())
        .merge(photometry::router())
        .merge(compare::router())
        .merge(steps::router())
        .merge(exports::router())
        .merge(rerun::router())
        .merge(studies::router())
        .merge(notes::router())
        .merge(documents::router())
        .merge(plain::router())
        .merge(events::router())
        .merge(trackability::router())
        .merge(odometry::router())
        .merge(what_if::router())
        .merge(why::router())
        .merge(counterfactual::router())
        .merge(removal::router())
        .merge(breakpoints::router())
        .merge(expressions::router())
}

/// This document
#[utoipa::path(get, operation_id = "show_openapi", path = ShowOpenApi::PATH, tag = "about", responses(
    (status = 200, description = "The OpenAPI document", body = serde_json::Value)))]
async fn document() -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "application/json")], JSON.as_str())
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use sightline_api::endpoints::ALL;

    use super::*;
    use crate::routes::route;

    #[test]
    fn the_router_has_exactly_the_declared_endpoints() {
        let document: Value = serde_json::from_str(&JSON).unwrap();
        let paths = document["paths"].as_object().unwrap();
        let described = paths.iter().flat_map(|(path, item)| {
            item.as_object().unwrap().keys().map(move |method| (method.to_uppercase(), path.clone()))
        });
        let declared = ALL.iter().map(|(method, path)| (method.to_string(), (*path).to_owned()));
        assert_eq!(described.collect::<BTreeSet<_>>(), declared.collect::<BTreeSet<_>>());
    }

    #[test]
    fn every_integer_states_its_largest_value() {
        let document: Value = serde_json::from_str(&JSON).unwrap();
        let parameters =
            document["paths"]["/traverses/{id}/prefetch"]["post"]["parameters"].as_array().unwrap();
        let from = parameters.iter().find(|parameter| parameter["name"] == "from").unwrap();
        assert_eq!(from["schema"]["maximum"], u64::MAX);
        let bits = &document["paths"]["/traverses/{id}/steps/{step}/images/{file}"]["get"]["parameters"];
        let bits = bits.as_array().unwrap().iter().find(|parameter| parameter["name"] == "bits").unwrap();
        assert_eq!(bits["schema"]["maximum"], 16, "what a type states itself stays");
    }

    #[test]
    fn every_schema_is_of_one_type() {
        let own = Document::openapi().components.unwrap().schemas;
        drop(router());
        let mut by_name = BTreeMap::<String, Value>::new();
        let mut clashes = BTreeSet::new();
        for (name, schema) in own.into_iter().chain(route::schemas_of_all_routes()) {
            let schema = serde_json::to_value(schema).unwrap();
            if *by_name.entry(name.clone()).or_insert_with(|| schema.clone()) != schema {
                clashes.insert(name);
            }
        }
        assert!(by_name.len() > 100, "the schemas are collected");
        assert!(clashes.is_empty(), "two types have the same name, say `#[schema(as = …)]`: {clashes:?}");
    }

    #[test]
    fn references_resolve_and_problems_have_a_media_type() {
        let document: Value = serde_json::from_str(&JSON).unwrap();
        for named in JSON.split("\"#/components/schemas/").skip(1) {
            let name = named.split('"').next().unwrap();
            assert!(document["components"]["schemas"][name].is_object(), "{name}");
        }
        for (method, path) in ALL {
            let responses = &document["paths"][*path][&method.to_string().to_lowercase()]["responses"];
            let responses = responses.as_object().unwrap();
            assert!(responses.contains_key("default"), "{method} {path} has no answer for problems");
            let problems = responses.iter().filter(|(status, _)| status.starts_with('4'));
            for (status, response) in problems {
                let types: Vec<_> = response["content"].as_object().unwrap().keys().collect();
                let is_page = path.ends_with("/page");
                let expected = if is_page { "text/html" } else { "application/problem+json" };
                assert_eq!(types, [expected], "{method} {path} {status}");
            }
        }
    }

    #[test]
    fn every_name_in_a_path_is_described() {
        let document: Value = serde_json::from_str(&JSON).unwrap();
        for (method, path) in ALL {
            let method = method.to_string().to_lowercase();
            let operation = &document["paths"][*path][&method];
            let all = operation["parameters"].as_array().cloned().unwrap_or_default();
            let of_path = all.iter().filter(|parameter| parameter["in"] == "path");
            let described: Vec<_> = of_path.map(|parameter| parameter["name"].as_str().unwrap()).collect();
            let named: Vec<_> = path.split('{').skip(1).filter_map(|rest| rest.split_once('}')).collect();
            let named: Vec<_> = named.into_iter().map(|(name, _)| name).collect();
            assert_eq!(described, named, "{method} {path}");
        }
    }
}
