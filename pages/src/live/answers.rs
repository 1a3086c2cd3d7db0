//! Responses to HTTP requests, and refusals.

use std::convert::Infallible;
use std::sync::Arc;

use http_body_util::combinators::BoxBody;
use http_body_util::{BodyExt, Full, StreamBody};
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderMap, HeaderName};
use hyper::http::uri::Authority;
use hyper::{Method, Request, Response, StatusCode};
use tokio::sync::watch;

use super::news::{self, News};
use super::{Found, Shown};

type Body = BoxBody<Bytes, std::io::Error>;

/// Path at which readers subscribe to updates.
const NEWS: &str = "/news";

/// Security headers of every response: the page loads nothing from elsewhere, and other sites may neither
/// embed nor read it.
const SAFETY: [(HeaderName, &str); 6] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'; \
         frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::CACHE_CONTROL, "no-store"),
];

/// Responds to a request.
pub async fn answer(
    request: Request<Incoming>,
    port: u16,
    shown: Arc<dyn Shown>,
    news: Arc<watch::Sender<News>>,
) -> Result<Response<Body>, Infallible> {
    let named = request.uri().authority().map(Authority::as_str);
    let mut response = if let Some(why) = refusal(request.headers(), named, port) {
        said(StatusCode::FORBIDDEN, why)
    } else if request.method() != Method::GET {
        let mut response = said(StatusCode::METHOD_NOT_ALLOWED, "this page is only read: GET was expected");
        response.headers_mut().insert(header::ALLOW, header::HeaderValue::from_static("GET"));
        response
    } else if request.uri().path() == NEWS {
        of_kind("text/event-stream", StreamBody::new(news::events(news.subscribe())).boxed())
    } else {
        let path = request.uri().path().to_owned();
        match tokio::task::spawn_blocking(move || shown.at(&path)).await {
            Ok(Ok(Some(Found { kind, text }))) => of_kind(kind, full(text)),
            Ok(Ok(None)) => said(StatusCode::NOT_FOUND, "there is nothing here; the page is at /"),
            Ok(Err(e)) => said(StatusCode::SERVICE_UNAVAILABLE, &e.to_string()),
            Err(_) => said(StatusCode::INTERNAL_SERVER_ERROR, "this is a bug of descry"),
        }
    };
    for (name, value) in SAFETY {
        response.headers_mut().insert(name, header::HeaderValue::from_static(value));
    }
    Ok(response)
}

fn full(text: impl Into<Bytes>) -> Body {
    Full::new(text.into()).map_err(|never| match never {}).boxed()
}

fn of_kind(kind: &'static str, body: Body) -> Response<Body> {
    let mut response = Response::new(body);
    response.headers_mut().insert(header::CONTENT_TYPE, header::HeaderValue::from_static(kind));
    response
}

fn said(status: StatusCode, why: &str) -> Response<Body> {
    let mut response = of_kind("text/plain; charset=utf-8", full(format!("{why}\n")));
    *response.status_mut() = status;
    response
}

/// Reason to refuse a request: a `Host` other than this machine, or a cross-site origin; `None` if the request is
/// allowed. `named`: host in the request's URL, if any.
pub fn refusal(headers: &HeaderMap, named: Option<&str>, port: u16) -> Option<&'static str> {
    let own = |host: &str| {
        let names = ["127.0.0.1", "localhost"];
        names.iter().any(|name| host == format!("{name}:{port}") || (port == 80 && host == *name))
    };
    let mut hosts = headers.get_all(header::HOST).iter().map(|host| host.to_str().ok());
    let is_own_host = matches!((hosts.next(), hosts.next()), (Some(Some(host)), None) if own(host));
    if !is_own_host || !named.is_none_or(own) {
        return Some(
            "this page is for this machine alone: it is at 127.0.0.1 or localhost, and has no other name",
        );
    }
    let is_own = |origin: &header::HeaderValue| {
        origin.to_str().is_ok_and(|origin| origin.strip_prefix("http://").is_some_and(own))
    };
    match headers.get_all(header::ORIGIN).iter().all(is_own) {
        true => None,
        false => Some("pages from elsewhere may not read this one"),
    }
}
