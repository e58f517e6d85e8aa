//! `Idempotency-Key`: a client can repeat a creating request after a broken connection without creating the resource twice.
//!
//! The same key with the same request returns the same answer while the server runs and the answer is among the most recent
//! ones (limits `answers` and `answer_bytes`); with another request the key is rejected. A request with a key completes even
//! if its sender disconnects, because the sender will repeat it. Only successful answers are stored: a rejected request has
//! created nothing.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex};

use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use sha2::{Digest, Sha256};
use sightline_api::endpoints::CREATING;
use tokio::sync::watch;
use utoipa::openapi::path::{Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{ObjectBuilder, Type};

use crate::extract::whole_body;
use crate::jobs::lock;
use crate::limits::SharedLimits;
use crate::problem::{ApiError, ApiResult};

/// The header with the key.
const HEADER: &str = "idempotency-key";
/// Maximum length of a key, characters.
const KEY_LIMIT: usize = 255;

/// Stored answers to requests with keys.
pub(crate) struct Answers {
    stored: Mutex<StoredAnswers>,
    limits: SharedLimits,
}

#[derive(Default)]
struct StoredAnswers {
    by_key: HashMap<String, KnownRequest>,
    /// The keys with stored answers, oldest first.
    order: VecDeque<String>,
    bytes: usize,
}

/// A request that has a key.
#[derive(Clone)]
struct KnownRequest {
    /// SHA-256 of path and body.
    request: [u8; 32],
    state: watch::Receiver<Progress>,
}

/// Progress of a request.
#[derive(Clone)]
enum Progress {
    /// The request is being processed.
    Begun,
    /// The request succeeded.
    Done(Arc<Answer>),
    /// The request was rejected and may be repeated.
    Refused,
}

/// A stored answer.
struct Answer {
    status: StatusCode,
    headers: HeaderMap,
    body: Bytes,
}

impl IntoResponse for &Answer {
    fn into_response(self) -> Response {
        (self.status, self.headers.clone(), self.body.clone()).into_response()
    }
}

/// The header parameter for the OpenAPI document.
pub(crate) fn parameter() -> Parameter {
    let schema =
        ObjectBuilder::new().schema_type(Type::String).min_length(Some(1)).max_length(Some(KEY_LIMIT));
    let description = "A key of your own, such as a UUID: the same request with the same key is carried out once and has the \
                       same answer; the most recent answers are kept while the server runs (limits `answers` and `answer_bytes`)";
    ParameterBuilder::new()
        .name("Idempotency-Key")
        .parameter_in(ParameterIn::Header)
        .description(Some(description))
        .schema(Some(schema.pattern(Some("^[!-~]+$"))))
        .build()
}

/// Processes a request with a key once.
pub(crate) async fn once(State(answers): State<Arc<Answers>>, request: Request, next: Next) -> Response {
    let is_creating = request.method() == Method::POST && is_creating(request.uri().path());
    if !is_creating || !request.headers().contains_key(HEADER) {
        return next.run(request).await;
    }
    with_key(&answers, request, next).await.unwrap_or_else(IntoResponse::into_response)
}

async fn with_key(answers: &Arc<Answers>, request: Request, next: Next) -> ApiResult<Response> {
    let key = key(request.headers())?;
    let (parts, body) = request.into_parts();
    let body = {
        let mut copy = Request::new(body);
        *copy.extensions_mut() = parts.extensions.clone();
        whole_body(copy, &()).await?
    };
    let mut sum = Sha256::new();
    sum.update(parts.uri.path());
    sum.update([0]);
    sum.update(&body);
    let digest: [u8; 32] = sum.finalize().into();
    loop {
        let mut known = match answers.find_or_begin(&key, digest)? {
            Ok(known) => known,
            Err(begun) => {
                let request = Request::from_parts(parts, Body::from(body));
                return begun.carry_out(request, next).await;
            }
        };
        let progress = match known.state.wait_for(|progress| !matches!(progress, Progress::Begun)).await {
            Ok(progress) => progress.clone(),
            // The sender was dropped without an answer.
            Err(_) => Progress::Refused,
        };
        if let Progress::Done(answer) = progress {
            return Ok(answer.as_ref().into_response());
        }
    }
}

/// Whether a path below `/api/v1` is that of a creating endpoint.
fn is_creating(path: &str) -> bool {
    let path = path.strip_prefix("/api/v1").unwrap_or(path);
    let fits = |template: &&str| {
        let (mut given, mut wanted) = (path.split('/'), template.split('/'));
        loop {
            match (given.next(), wanted.next()) {
                (None, None) => return true,
                (Some(given), Some(wanted)) if given == wanted || wanted.starts_with('{') => {}
                _ => return false,
            }
        }
    };
    CREATING.iter().any(fits)
}

fn key(headers: &HeaderMap) -> ApiResult<String> {
    let mut all = headers.get_all(HEADER).iter();
    let first = all.next().and_then(|value| value.to_str().ok()).unwrap_or_default();
    let is_plain = first.bytes().all(|byte| byte.is_ascii_graphic());
    if all.next().is_none() && is_plain && (1..=KEY_LIMIT).contains(&first.len()) {
        Ok(first.to_owned())
    } else {
        let detail =
            format!("Idempotency-Key: must be given once, with 1 to {KEY_LIMIT} visible ASCII characters");
        Err(ApiError::invalid("idempotency_key", detail))
    }
}

impl Answers {
    /// An empty store.
    pub(crate) fn new(limits: &SharedLimits) -> Self {
        Self { stored: Mutex::default(), limits: Arc::clone(limits) }
    }

    /// Memory used by the stored answers, bytes.
    pub(crate) fn bytes(&self) -> usize {
        lock(&self.stored).bytes
    }

    /// The known request with that key, or the right to process it.
    ///
    /// # Errors
    /// A problem if the key was used for another request.
    fn find_or_begin(
        self: &Arc<Self>,
        key: &str,
        request: [u8; 32],
    ) -> ApiResult<Result<KnownRequest, Begun>> {
        let mut stored = lock(&self.stored);
        if let Some(known) = stored.by_key.get(key) {
            if known.request == request {
                return Ok(Ok(known.clone()));
            }
            let detail = "Idempotency-Key: was used for another request";
            return Err(ApiError::invalid("idempotency_key", detail).hint("Use a new key for each request."));
        }
        let (sender, state) = watch::channel(Progress::Begun);
        stored.by_key.insert(key.to_owned(), KnownRequest { request, state });
        Ok(Err(Begun { answers: Arc::clone(self), key: key.to_owned(), sender, is_done: false }))
    }

    /// Stores an answer and discards the oldest ones beyond the limits.
    fn keep(&self, key: &str, bytes: usize) {
        let mut stored = lock(&self.stored);
        stored.order.push_back(key.to_owned());
        stored.bytes += bytes;
        let (most, most_bytes) = (self.limits.answers.count(), self.limits.answer_bytes.count());
        while stored.order.len() > most || (stored.bytes > most_bytes && stored.order.len() > 1) {
            let Some(oldest) = stored.order.pop_front() else { break };
            let gone = stored.by_key.remove(&oldest);
            if let Some(Progress::Done(answer)) = gone.map(|known| known.state.borrow().clone()) {
                stored.bytes -= answer.body.len();
            }
        }
    }
}

/// The right to process a request; without success the key becomes free again.
struct Begun {
    answers: Arc<Answers>,
    key: String,
    sender: watch::Sender<Progress>,
    is_done: bool,
}

impl Begun {
    /// Processes the request even if its sender disconnects.
    async fn carry_out(self, request: Request, next: Next) -> ApiResult<Response> {
        let work = tokio::spawn(async move {
            let mut begun = self;
            let (parts, body) = next.run(request).await.into_parts();
            let body = axum::body::to_bytes(body, usize::MAX).await;
            let body = body.map_err(|error| ApiError::internal(error.to_string()))?;
            let answer = Answer { status: parts.status, headers: parts.headers, body };
            let response = (&answer).into_response();
            if answer.status.is_success() {
                begun.is_done = true;
                let bytes = answer.body.len();
                begun.sender.send_replace(Progress::Done(Arc::new(answer)));
                begun.answers.keep(&begun.key, bytes);
            }
            Ok(response)
        });
        work.await.unwrap_or_else(|failed| Err(ApiError::internal(failed.to_string())))
    }
}

impl Drop for Begun {
    fn drop(&mut self) {
        if !self.is_done {
            lock(&self.answers.stored).by_key.remove(&self.key);
            self.sender.send_replace(Progress::Refused);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn creating_paths_are_recognised() {
        for path in ["/api/v1/sessions", "/sessions", "/sessions/s1/targets/0/runs", "/studies/jobs"] {
            assert!(is_creating(path), "{path}");
        }
        for path in ["/sessions/s1", "/sessions/s1/targets/0", "/studies", "/"] {
            assert!(!is_creating(path), "{path}");
        }
    }

    #[test]
    fn memory_is_bounded() {
        let limits = SharedLimits::default();
        let (most, most_bytes) = (limits.answers.count(), limits.answer_bytes.count());
        let answers = Arc::new(Answers::new(&limits));
        let keep = |key: String, bytes: usize| {
            let Ok(Err(mut begun)) = answers.find_or_begin(&key, [0; 32]) else { panic!("a new key") };
            let body = Bytes::from(vec![0; bytes]);
            let answer = Answer { status: StatusCode::CREATED, headers: HeaderMap::new(), body };
            begun.is_done = true;
            begun.sender.send_replace(Progress::Done(Arc::new(answer)));
            answers.keep(&key, bytes);
        };
        (0..most + 5).for_each(|number| keep(number.to_string(), 1));
        let count = || {
            let stored = lock(&answers.stored);
            (stored.by_key.len(), stored.order.len(), stored.bytes)
        };
        assert_eq!(count(), (most, most, most));
        keep("large".to_owned(), most_bytes);
        assert_eq!(count(), (1, 1, most_bytes));
    }
}
