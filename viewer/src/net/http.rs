//! HTTP requests; failures are returned as problems.

use ehttp::Headers;
use sightline_api::endpoint::Method;
use sightline_api::wire::Problem;

use crate::net::items;
use crate::net::request::{CompletedRequest, Reply, Request};

/// Sends `request` to the server at `origin` and passes the answer to `done`, possibly on another thread.
pub(super) fn send(
    origin: &str,
    request: Request,
    context: &egui::Context,
    done: impl FnOnce(CompletedRequest) + Send + 'static,
) {
    let call = match &request {
        Request::Call { call, .. } => call.clone(),
        Request::Item(key) => items::call(key),
        Request::Reconnect => return,
    };
    let mut http = ehttp::Request::get(format!("{origin}/api/v1/{}", call.path));
    http.method = method(call.method);
    // No timeout: rendering an image or designating a target can take long.
    http.timeout = None;
    // Sends the cookie with the access token, which `ehttp` omits by default.
    #[cfg(target_arch = "wasm32")]
    {
        http.credentials = ehttp::Credentials::SameOrigin;
    }
    if let Some(body) = call.body {
        http.headers = Headers::new(&[("Accept", "application/json"), ("Content-Type", "application/json")]);
        http.body = body;
    }
    if let Some(revision) = call.revision {
        http.headers.insert("If-Match", format!("\"{revision}\""));
    }
    let context = context.clone();
    ehttp::fetch(http, move |answer| {
        let outcome = match answer {
            Ok(response) if response.ok => match &request {
                // 202: the server is still computing the item.
                Request::Item(_) if response.status == 202 => Err(problem(&response)),
                Request::Item(key) => items::read(key, &response.bytes, &context).map(Reply::Item),
                Request::Call { .. } | Request::Reconnect => Ok(Reply::Body(response.bytes)),
            },
            Ok(response) => Err(problem(&response)),
            Err(why) => Err(unreachable(&why.to_string())),
        };
        done(CompletedRequest { request, outcome });
    });
}

const fn method(method: Method) -> ehttp::Method {
    match method {
        Method::Get => ehttp::Method::GET,
        Method::Post => ehttp::Method::POST,
        Method::Put => ehttp::Method::PUT,
        Method::Patch => ehttp::Method::PATCH,
        Method::Delete => ehttp::Method::DELETE,
    }
}

/// The problem that an unsuccessful response describes.
fn problem(response: &ehttp::Response) -> Problem {
    serde_json::from_slice(&response.bytes).unwrap_or_else(|_| {
        let detail = format!("The server answered {} {}.", response.status, response.status_text);
        Problem::new(response.status, "unexpected", &response.status_text, detail)
    })
}

fn unreachable(why: &str) -> Problem {
    Problem::new(0, "unreachable", "no answer", format!("The server does not answer ({why})."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_without_a_problem_document_is_still_a_problem() {
        let response = ehttp::Response {
            url: String::new(),
            ok: false,
            status: 502,
            status_text: "Bad Gateway".to_owned(),
            headers: Headers::default(),
            bytes: b"<html>".to_vec(),
        };
        let problem = problem(&response);
        assert_eq!(problem.status, 502);
        assert!(problem.detail.contains("Bad Gateway"));
    }
}
