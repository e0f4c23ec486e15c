//! The answers to requests: the page at `/`, its stream at `/events`, and headers that keep other pages out.

use std::net::{IpAddr, Ipv6Addr};
use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HOST, HeaderName, HeaderValue,
    REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse as _, Response, Sse};
use axum::routing::get;
use axum::{Extension, Router};
use tokio::sync::watch;

use super::connections::Peer;
use super::parts::Parts;
use super::slots::Slots;
use super::{document, events};

/// Most streams, in all and to one address.
const STREAMS: (usize, usize) = (32, 16);

/// Tells browsers that no other site may load an answer.
const RESOURCE_POLICY: HeaderName = HeaderName::from_static("cross-origin-resource-policy");

/// The state that all requests share.
struct Shared {
    page: watch::Receiver<Parts>,
    version: String,
    policy: HeaderValue,
    names: Vec<String>,
    streams: Slots,
}

/// The service of a page. Browsers may reach it under an address, as localhost, and under `names`.
pub(crate) fn router(page: watch::Receiver<Parts>, names: &[String]) -> Router {
    let policy = HeaderValue::try_from(document::policy());
    let shared = Arc::new(Shared {
        page,
        version: document::version(),
        policy: policy.expect("base 64 and ASCII words"),
        names: names.to_vec(),
        streams: Slots::new(STREAMS.0, STREAMS.1),
    });
    Router::new()
        .route("/", get(page_now))
        .route("/events", get(stream))
        .fallback(async || (StatusCode::NOT_FOUND, "nothing here: the page is at /\n"))
        .layer(middleware::from_fn_with_state(Arc::clone(&shared), guard))
        .with_state(shared)
}

async fn page_now(State(shared): State<Arc<Shared>>) -> Response {
    let parts = shared.page.borrow().clone();
    let page = document::page(&parts, &shared.version).into_string();
    ([(CONTENT_TYPE, "text/html; charset=utf-8")], page).into_response()
}

async fn stream(
    State(shared): State<Arc<Shared>>,
    Extension(Peer(address)): Extension<Peer>,
) -> Response {
    match shared.streams.take(address) {
        Some(slot) => {
            Sse::new(events::events(shared.page.clone(), &shared.version, slot)).into_response()
        }
        None => (StatusCode::SERVICE_UNAVAILABLE, "too many pages are open: close one\n")
            .into_response(),
    }
}

/// Refuses requests by another name, and sets the headers of every answer.
async fn guard(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    let host = request.headers().get(HOST).and_then(|host| host.to_str().ok());
    let mut response = if host.is_some_and(|host| is_ours(host, &shared.names)) {
        next.run(request).await
    } else {
        let refusal = "this name is not known: open the page by address, or start flexid web with --name NAME\n";
        (StatusCode::MISDIRECTED_REQUEST, refusal).into_response()
    };
    let headers = response.headers_mut();
    headers.insert(CONTENT_SECURITY_POLICY, shared.policy.clone());
    for (name, value) in [
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
        (RESOURCE_POLICY, "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Returns whether a Host header has an address, localhost or one of `names`. Another site can make its own name point here (DNS
/// rebinding) and read the answers as its own; it cannot do so with an address.
fn is_ours(host: &str, names: &[String]) -> bool {
    if let Some(bracketed) = host.strip_prefix('[') {
        return bracketed
            .split_once(']')
            .is_some_and(|(address, port)| address.parse::<Ipv6Addr>().is_ok() && is_port(port));
    }
    let (name, port) = host.split_at(host.find(':').unwrap_or(host.len()));
    let known = || names.iter().any(|own| own.eq_ignore_ascii_case(name));
    is_port(port)
        && (name.parse::<IpAddr>().is_ok() || name.eq_ignore_ascii_case("localhost") || known())
}

/// Returns whether `text` is empty, or a port after a colon.
fn is_port(text: &str) -> bool {
    text.is_empty() || text.strip_prefix(':').is_some_and(|port| port.parse::<u16>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_is_an_address_localhost_or_a_name_that_was_given() {
        let names = ["robot.local".to_owned()];
        for host in [
            "127.0.0.1:8080",
            "10.0.0.7",
            "localhost",
            "LOCALHOST:1",
            "[::1]:8080",
            "[::1]",
            "Robot.local:80",
        ] {
            assert!(is_ours(host, &names), "{host}");
        }
        for host in [
            "",
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.evil.example:8080",
            "[::1",
            "[evil]:80",
            "10.0.0.7:x",
            "10.0.0.7@evil.example",
            "robot.local.evil.example",
        ] {
            assert!(!is_ours(host, &names), "{host}");
        }
    }
}
