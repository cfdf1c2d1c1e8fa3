//! The server: addresses, requests and answers. The web types are confined to this module and the gate.

use std::future::Future;
use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{Response, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::routing::{get, post};
use serde_json::{Value, json};
use tokio::runtime;

use super::connections;
use super::gate::{Gate, Turned, random_hex};

/// What a site answers.
pub type Answer = Result<Value, Refusal>;

/// Why a site does not answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// What was asked for cannot be done.
    Refused {
        /// The field of the page that is wrong, if it is one.
        field: Option<&'static str>,
        /// Why.
        message: String,
    },
    /// The body is not what is expected.
    Malformed(String),
    /// Nobody knows what was asked for.
    Unknown(String),
}

/// A live page.
pub trait Site: Send + Sync + 'static {
    /// The page, without any data, which it requests with its token; under this policy, whose script has this nonce.
    fn html(&self, policy: &str, nonce: &str) -> String;

    /// What can be asked for: `/api/NAME` by GET.
    fn views(&self) -> &'static [&'static str];

    /// What can be asked to be done: `/api/NAME` by POST, with a JSON document.
    fn actions(&self) -> &'static [&'static str] {
        &[]
    }

    /// Answers what was asked for or asked to be done.
    ///
    /// # Errors
    /// Why there is no answer.
    fn ask(&self, what: &str, body: &[u8]) -> Answer;

    /// True if an action writes files: it is completed before the program ends.
    fn is_writing(&self, _what: &str) -> bool {
        false
    }
}

/// Longest body, bytes: enough for an expression and some dataset names.
const LONGEST_BODY: usize = 64 << 10;

/// Worker threads of the server itself; computations run beside them.
const WORKERS: usize = 1;

/// A listening server, which answers once it is run.
pub struct Server<S> {
    listener: TcpListener,
    desk: Arc<Desk<S>>,
    header_patience: Duration,
}

/// Shared state from which every answer is made.
struct Desk<S> {
    gate: Gate,
    site: S,
    /// Held while a file is written, so that no file is left incomplete on exit.
    writing: Mutex<()>,
}

type Sent = Response<Body>;

impl<S: Site> Server<S> {
    /// Listens on the loopback address only; port 0 takes a free one. A connection that does not send a complete request header
    /// within `header_patience` ([`crate::HEADER_PATIENCE`]) is closed.
    ///
    /// # Errors
    /// If the port is in use.
    pub fn new(site: S, port: u16, header_patience: Duration) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let gate = Gate::new(listener.local_addr()?.port()).map_err(io::Error::other)?;
        let desk = Arc::new(Desk { gate, site, writing: Mutex::new(()) });
        Ok(Server { listener, desk, header_patience })
    }

    /// Answers until what `until` waits for has happened; `announce` receives the page's address once that can happen.
    ///
    /// # Errors
    /// If the system provides no threads, or closes the socket; those of `until` and `announce`.
    pub fn run<F: Future<Output = ()>>(
        self,
        until: impl FnOnce() -> io::Result<F>,
        announce: impl FnOnce(&str) -> io::Result<()>,
    ) -> io::Result<()> {
        let Server { listener, desk, header_patience } = self;
        listener.set_nonblocking(true)?;
        let runtime = runtime::Builder::new_multi_thread().worker_threads(WORKERS).enable_io().enable_time().build()?;
        let routes = routes(&desk);
        let result = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            let until = until()?;
            announce(&desk.gate.url())?;
            tokio::select! {
                () = connections::answer(listener, routes, header_patience) => {}
                () = until => {}
            }
            Ok(())
        });
        // A computation under way is abandoned; a file being written is completed.
        let _writing = desk.writing.lock().unwrap_or_else(PoisonError::into_inner);
        runtime.shutdown_background();
        result
    }

    /// Answers in a thread of its own until the program ends; returns the page's address.
    ///
    /// # Errors
    /// If the system provides no thread.
    pub fn answer_beside(self) -> io::Result<String> {
        let url = self.desk.gate.url();
        let never = || Ok(std::future::pending());
        thread::Builder::new().name("page".into()).spawn(move || drop(self.run(never, |_| Ok(()))))?;
        Ok(url)
    }
}

fn routes<S: Site>(desk: &Arc<Desk<S>>) -> Router {
    let mut routes = Router::new().route("/", get(shell::<S>));
    for &what in desk.site.views() {
        routes = routes.route(&format!("/api/{what}"), get(move |State(desk)| answer(desk, what, Bytes::new())));
    }
    for &what in desk.site.actions() {
        routes = routes.route(&format!("/api/{what}"), post(move |State(desk), body| answer(desk, what, body)));
    }
    routes
        .fallback(|| async { problem(StatusCode::NOT_FOUND, None, "there is nothing at this address") })
        .method_not_allowed_fallback(|| async { problem(StatusCode::METHOD_NOT_ALLOWED, None, "this address is not for that") })
        .layer(DefaultBodyLimit::max(LONGEST_BODY))
        .layer(from_fn_with_state(Arc::clone(desk), guard::<S>))
        .with_state(Arc::clone(desk))
}

/// True if a request declares a body longer than any accepted: it need not be read.
fn is_too_long(headers: &HeaderMap) -> bool {
    let said = headers.get(header::CONTENT_LENGTH).and_then(|l| l.to_str().ok()).and_then(|l| l.parse::<u64>().ok());
    said.is_some_and(|length| length > LONGEST_BODY as u64)
}

/// Rejects unauthorised requests, and sets the security headers of the answer.
async fn guard<S: Site>(State(desk): State<Arc<Desk<S>>>, request: Request, next: Next) -> Sent {
    let mut answer = match desk.gate.judge(request.method(), request.uri(), request.headers()) {
        Ok(()) if is_too_long(request.headers()) => problem(StatusCode::PAYLOAD_TOO_LARGE, None, "that is too long"),
        Ok(()) => next.run(request).await,
        Err(Turned(status, because)) => problem(status, None, because),
    };
    let always: [(HeaderName, &'static str); 5] = [
        (header::CACHE_CONTROL, "no-store"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ];
    for (name, value) in always {
        answer.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    answer
}

/// The page without any data, which it requests with its token.
async fn shell<S: Site>(State(desk): State<Arc<Desk<S>>>) -> Sent {
    let Ok(nonce) = random_hex() else {
        return problem(StatusCode::INTERNAL_SERVER_ERROR, None, "the system gives no random numbers");
    };
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'"
    );
    let answer = Response::builder()
        .header(header::CONTENT_TYPE, "text/html; charset=utf-8")
        .header(header::CONTENT_SECURITY_POLICY, format!("{policy}; frame-ancestors 'none'"))
        .body(Body::from(desk.site.html(&policy, &nonce)));
    answer.unwrap_or_else(|_| problem(StatusCode::INTERNAL_SERVER_ERROR, None, "the page cannot be sent"))
}

/// Asks the site in a thread separate from the server's.
async fn answer<S: Site>(desk: Arc<Desk<S>>, what: &'static str, body: Bytes) -> Sent {
    let done = tokio::task::spawn_blocking(move || {
        let began = Instant::now();
        let writing = desk.site.is_writing(what).then(|| desk.writing.lock().unwrap_or_else(PoisonError::into_inner));
        let result = desk.site.ask(what, &body);
        drop(writing);
        (result, began.elapsed())
    });
    match done.await {
        Ok((Ok(mut value), took)) => {
            value["took_ms"] = json!(took.as_millis() as u64);
            sent(StatusCode::OK, &value)
        }
        Ok((Err(because), _)) => match because {
            Refusal::Refused { field, message } => problem(StatusCode::UNPROCESSABLE_ENTITY, field, &message),
            Refusal::Malformed(because) => problem(StatusCode::BAD_REQUEST, None, &because),
            Refusal::Unknown(because) => problem(StatusCode::NOT_FOUND, None, &because),
        },
        Err(_) => problem(StatusCode::INTERNAL_SERVER_ERROR, None, "this cannot be computed; everything is as it was before"),
    }
}

fn sent(status: StatusCode, value: &Value) -> Sent {
    let mut answer = Response::new(Body::from(value.to_string()));
    *answer.status_mut() = status;
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
    answer
}

/// An error answer: the reason, and the field of the page in error.
fn problem(status: StatusCode, field: Option<&str>, because: &str) -> Sent {
    sent(status, &json!({"error": because, "field": field}))
}
