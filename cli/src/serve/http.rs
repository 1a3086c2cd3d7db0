//! Goals over HTTP: JSON requests and responses, and a stream of events.

use std::convert::Infallible;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use futures_util::stream;
use http_body_util::combinators::BoxBody;
use http_body_util::{BodyExt, Full, Limited, StreamBody};
use hyper::body::{Bytes, Frame, Incoming};
use hyper::header::{self, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::sync::broadcast::error::RecvError;

use super::Agent;

/// Maximum size of a request, bytes.
const ASKED_BYTES: usize = 64 << 10;
/// Maximum number of open connections; further ones wait.
const MOST_CONNECTIONS: usize = 256;
/// Time within which a client must have sent its request.
const ASK_WITHIN: Duration = Duration::from_secs(10);

const OPENAPI: &str = include_str!("openapi.json");

type Body = BoxBody<Bytes, Infallible>;

/// Body of a request to add a goal.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    goal: String,
    #[serde(default)]
    urgent: bool,
}

/// Serves callers indefinitely.
pub(super) async fn serve(listener: TcpListener, agent: Arc<Agent>) -> io::Result<()> {
    let port = listener.local_addr()?.port();
    let room = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    loop {
        let Ok(place) = Arc::clone(&room).acquire_owned().await else { return Ok(()) };
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(Duration::from_millis(100)).await;
            continue;
        };
        let agent = Arc::clone(&agent);
        let service = service_fn(move |request| answer(request, port, Arc::clone(&agent)));
        tokio::spawn(async move {
            let mut http = http1::Builder::new();
            http.timer(TokioTimer::new()).header_read_timeout(ASK_WITHIN);
            // What goes wrong with one connection is no matter of the others.
            let _ = http.serve_connection(TokioIo::new(stream), service).await;
            drop(place);
        });
    }
}

async fn answer(
    request: Request<Incoming>,
    port: u16,
    agent: Arc<Agent>,
) -> Result<Response<Body>, Infallible> {
    if let Some(refused) = refused(&request, port, &agent) {
        return Ok(refused);
    }
    let path = request.uri().path().trim_matches('/').to_string();
    let id = path.strip_prefix("goals/").map(str::parse::<u64>);
    Ok(match (request.method(), path.as_str(), id) {
        (&Method::GET, "openapi.json" | "", _) => said(StatusCode::OK, OPENAPI.to_string()),
        (&Method::GET, "events", _) => events(&agent),
        (&Method::GET, "goals", _) => {
            let goals =
                serde_json::to_value(agent.inner().goals.all().collect::<Vec<_>>()).unwrap_or_default();
            told(StatusCode::OK, json!({ "goals": goals }))
        }
        (&Method::POST, "goals", _) => add(request, &agent).await,
        (&Method::GET, _, Some(Ok(id))) => match agent.inner().goals.get(id) {
            Some(goal) => told(StatusCode::OK, json!(goal)),
            None => missing(id),
        },
        (&Method::DELETE, _, Some(Ok(id))) => match agent.cancel(id) {
            Ok(Some(goal)) => told(StatusCode::OK, json!(goal)),
            Ok(None) => missing(id),
            Err(e) => error(StatusCode::INTERNAL_SERVER_ERROR, &format!("it cannot be kept: {e}")),
        },
        _ => error(
            StatusCode::NOT_FOUND,
            "expected POST /goals, GET /goals, GET or DELETE /goals/ID, GET /events, or GET /openapi.json",
        ),
    })
}

/// Refusal of a caller: a missing token, or a cross-site request of a browser; `None` if the request is
/// allowed.
fn refused(request: &Request<Incoming>, port: u16, agent: &Agent) -> Option<Response<Body>> {
    match &agent.served.token {
        Some(token) => {
            let shown = request.headers().get(header::AUTHORIZATION).and_then(|value| value.to_str().ok());
            let shown = shown.and_then(|value| value.strip_prefix("Bearer ")).unwrap_or_default();
            let differ = shown.bytes().zip(token.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
            let is_right = shown.len() == token.len() && differ == 0;
            (!is_right)
                .then(|| error(StatusCode::UNAUTHORIZED, "expected the header `Authorization: Bearer TOKEN`"))
        }
        None => {
            let named = request.uri().authority().map(|authority| authority.as_str());
            let why = descry_pages::live::answers::refusal(request.headers(), named, port)?;
            Some(error(StatusCode::FORBIDDEN, why))
        }
    }
}

async fn add(request: Request<Incoming>, agent: &Agent) -> Response<Body> {
    let Ok(body) = Limited::new(request.into_body(), ASKED_BYTES).collect().await else {
        return error(StatusCode::PAYLOAD_TOO_LARGE, &format!("expected at most {ASKED_BYTES} bytes"));
    };
    match serde_json::from_slice::<Given>(&body.to_bytes()) {
        Ok(given) if given.goal.trim().is_empty() => error(StatusCode::BAD_REQUEST, "`goal` is empty"),
        Ok(given) => match agent.add(given.goal, given.urgent) {
            Ok(goal) => told(StatusCode::ACCEPTED, json!(goal)),
            Err(e) => error(StatusCode::INTERNAL_SERVER_ERROR, &format!("it cannot be kept: {e}")),
        },
        Err(e) => {
            let expected = "expected {\"goal\": \"find cup A\", \"urgent\": false}";
            error(StatusCode::BAD_REQUEST, &format!("{e}; {expected}"))
        }
    }
}

/// Events as server-sent events; a listener that lags is told the number of missed events.
fn events(agent: &Agent) -> Response<Body> {
    let news = stream::unfold(agent.news.subscribe(), |mut news| async move {
        let text = match news.recv().await {
            Ok(text) => text,
            Err(RecvError::Lagged(missed)) => json!({ "event": "missed", "count": missed }).to_string(),
            Err(RecvError::Closed) => return None,
        };
        Some((Ok(Frame::data(Bytes::from(format!("data: {text}\n\n")))), news))
    });
    of_kind("text/event-stream", StreamBody::new(news).boxed())
}

fn told(status: StatusCode, value: Value) -> Response<Body> {
    said(status, value.to_string())
}

fn error(status: StatusCode, why: &str) -> Response<Body> {
    told(status, json!({ "error": why }))
}

fn missing(id: u64) -> Response<Body> {
    error(StatusCode::NOT_FOUND, &format!("there is no goal {id}"))
}

fn said(status: StatusCode, text: String) -> Response<Body> {
    let mut response = of_kind("application/json", Full::new(Bytes::from(text)).boxed());
    *response.status_mut() = status;
    response
}

fn of_kind(kind: &'static str, body: Body) -> Response<Body> {
    let mut response = Response::new(body);
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(kind));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    response
}
