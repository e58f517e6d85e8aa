//! Registers a handler for an endpoint; method and path are defined by the endpoint type.

use axum::http::header::{self, HeaderName};
use sightline_api::endpoint::{self, Endpoint, Method};
use sightline_api::endpoints::CREATING;
use utoipa::openapi::RefOr;
use utoipa::openapi::path::{Operation, ParameterIn, PathItem};
use utoipa::{IntoParams, IntoResponses};
use utoipa_axum::router::UtoipaMethodRouter;

use crate::idempotency;
use crate::problem::ApiError;
use crate::state::AppState;

/// The handler described by `routes!`, as the route of `E`; adds the path parameters to its description.
///
/// # Panics
/// A handler that declares another method or path than `E`.
pub(crate) fn route<E: Endpoint<At: IntoParams>>(
    described: UtoipaMethodRouter<AppState>,
) -> UtoipaMethodRouter<AppState> {
    let (schemas, mut paths, handler) = described;
    #[cfg(test)]
    SCHEMAS.with_borrow_mut(|all| all.extend(schemas.iter().cloned()));
    let operation = paths.paths.get_mut(E::PATH).and_then(|item| operation(item, E::METHOD));
    assert!(operation.is_some(), "the handler of {} {} declares another route", E::METHOD, E::PATH);
    if let Some(operation) = operation {
        let declared = operation.parameters.take().unwrap_or_default();
        let is_missing = |name: &str| {
            declared.iter().all(|known| !matches!(known, RefOr::T(parameter) if parameter.name == name))
        };
        let of_path = E::At::into_params(|| Some(ParameterIn::Path)).into_iter();
        let mut all: Vec<_> = of_path.filter(|parameter| is_missing(&parameter.name)).collect();
        // The names are sufficient; the doc comments of the fields are for developers.
        all.iter_mut().for_each(|parameter| parameter.description = None);
        let mut all: Vec<_> = all.into_iter().map(RefOr::T).collect();
        all.extend(declared);
        if E::METHOD == Method::Post && CREATING.contains(&E::PATH) {
            all.push(RefOr::T(idempotency::parameter()));
        }
        operation.parameters = (!all.is_empty()).then_some(all);
        // The guard in front of every handler may answer with a problem.
        for (status, response) in ApiError::responses() {
            operation.responses.responses.entry(status).or_insert(response);
        }
    }
    (schemas, paths, handler)
}

/// A schema with its name.
#[cfg(test)]
type NamedSchema = (String, RefOr<utoipa::openapi::Schema>);

#[cfg(test)]
thread_local! {
    /// The schemas of the routes registered by this thread, including those replaced by others of the same name.
    static SCHEMAS: std::cell::RefCell<Vec<NamedSchema>> = const { std::cell::RefCell::new(Vec::new()) };
}

/// The schemas of all routes registered by this thread.
#[cfg(test)]
pub(super) fn schemas_of_all_routes() -> Vec<NamedSchema> {
    SCHEMAS.take()
}

fn operation(item: &mut PathItem, method: Method) -> Option<&mut Operation> {
    match method {
        Method::Get => item.get.as_mut(),
        Method::Post => item.post.as_mut(),
        Method::Put => item.put.as_mut(),
        Method::Patch => item.patch.as_mut(),
        Method::Delete => item.delete.as_mut(),
    }
}

/// The header with the path of the resource of `E` at this location.
pub(crate) fn location<E: Endpoint>(at: &E::At) -> [(HeaderName, String); 1] {
    let path = endpoint::path::<E>(at, &E::Query::default());
    // Defaults of query parameters are not part of the path.
    let name = path.split('?').next().unwrap_or_default();
    [(header::LOCATION, format!("/api/v1/{name}"))]
}
