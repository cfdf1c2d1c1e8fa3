//! The server: addresses, requests and answers. The web types are confined to this module and the gate.

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
use calibench_report::{LivePage, Module, page_script};
use calibench_workbench::{ACTIONS, Bench, MARKUP, MODULES, STYLE, Unanswered, VIEWS};
use serde_json::{Value, json};
use tokio::runtime;

use super::connections;
use super::gate::{Gate, Turned, random_hex};
use calibench_serve::interruption::interrupted;

/// The script of the page.
const SCRIPT: Module = Module { name: "calibench-cli/server.js", text: include_str!("server.js") };

/// Longest body, bytes: enough for an expression and some dataset names.
const LONGEST_BODY: usize = 64 << 10;

/// Worker threads of the server itself; computations run beside them.
const WORKERS: usize = 1;

/// A listening workbench, which answers once it is run.
pub struct Server {
    listener: TcpListener,
    desk: Arc<Desk>,
    header_patience: Duration,
}

/// Shared state from which every answer is made.
struct Desk {
    gate: Gate,
    bench: Bench,
    /// Held while a file is written, so that no file is left incomplete on exit.
    writing: Mutex<()>,
}

type Answer = Response<Body>;

impl Server {
    /// Listens on the loopback address only; port 0 takes a free one. A connection that does not send a complete request header
    /// within `header_patience` ([`super::HEADER_PATIENCE`]) is closed.
    ///
    /// # Errors
    /// If the port is in use.
    pub fn new(bench: Bench, port: u16, header_patience: Duration) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let gate = Gate::new(listener.local_addr()?.port()).map_err(io::Error::other)?;
        let desk = Arc::new(Desk { gate, bench, writing: Mutex::new(()) });
        Ok(Server { listener, desk, header_patience })
    }

    /// Answers until interrupted; `announce` receives the page's address once interruptions are handled.
    ///
    /// # Errors
    /// If the system provides no threads or no signals, or closes the socket; that of `announce`.
    pub fn run(self, announce: impl FnOnce(&str) -> io::Result<()>) -> io::Result<()> {
        let Server { listener, desk, header_patience } = self;
        listener.set_nonblocking(true)?;
        // It ends with the program.
        let bench = desk.clone();
        thread::Builder::new().name("bench".into()).spawn(move || bench.bench.work())?;
        let runtime = runtime::Builder::new_multi_thread().worker_threads(WORKERS).enable_io().enable_time().build()?;
        let routes = routes(desk.clone());
        let result = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            let interrupted = interrupted()?;
            announce(&desk.gate.url())?;
            tokio::select! {
                () = connections::answer(listener, routes, header_patience) => {}
                () = interrupted => {}
            }
            Ok(())
        });
        // A running fit is abandoned; a file being written is completed.
        let _writing = desk.writing.lock().unwrap_or_else(PoisonError::into_inner);
        runtime.shutdown_background();
        result
    }
}

fn routes(desk: Arc<Desk>) -> Router {
    let mut routes = Router::new().route("/", get(shell));
    for what in VIEWS {
        routes = routes.route(&format!("/api/{what}"), get(move |State(desk)| answer(desk, what, Bytes::new())));
    }
    for what in ACTIONS {
        routes = routes.route(&format!("/api/{what}"), post(move |State(desk), body| answer(desk, what, body)));
    }
    routes
        .fallback(|| async { problem(StatusCode::NOT_FOUND, None, "there is nothing at this address") })
        .method_not_allowed_fallback(|| async { problem(StatusCode::METHOD_NOT_ALLOWED, None, "this address is not for that") })
        .layer(DefaultBodyLimit::max(LONGEST_BODY))
        .layer(from_fn_with_state(desk.clone(), guard))
        .with_state(desk)
}

/// True if a request declares a body longer than any accepted: it need not be read.
fn is_too_long(headers: &HeaderMap) -> bool {
    let said = headers.get(header::CONTENT_LENGTH).and_then(|l| l.to_str().ok()).and_then(|l| l.parse::<u64>().ok());
    said.is_some_and(|length| length > LONGEST_BODY as u64)
}

/// Rejects unauthorised requests, and sets the security headers of the answer.
async fn guard(State(desk): State<Arc<Desk>>, request: Request, next: Next) -> Answer {
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
async fn shell() -> Answer {
    let Ok(nonce) = random_hex() else {
        return problem(StatusCode::INTERNAL_SERVER_ERROR, None, "the system gives no random numbers");
    };
    let policy = format!(
        "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'unsafe-inline'; img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'"
    );
    let script = page_script(SCRIPT, MODULES);
    let page = LivePage { policy: &policy, nonce: &nonce, style: STYLE, markup: MARKUP, script: &script };
    let answer = Response::builder()
        .header(header::CONTENT_TYPE, "text/html; charset=utf-8")
        .header(header::CONTENT_SECURITY_POLICY, format!("{policy}; frame-ancestors 'none'"))
        .body(Body::from(page.html()));
    answer.unwrap_or_else(|_| problem(StatusCode::INTERNAL_SERVER_ERROR, None, "the page cannot be sent"))
}

/// Asks the bench in a thread separate from the server's.
async fn answer(desk: Arc<Desk>, what: &'static str, body: Bytes) -> Answer {
    let done = tokio::task::spawn_blocking(move || {
        let began = Instant::now();
        let writing = what.starts_with("save-").then(|| desk.writing.lock().unwrap_or_else(PoisonError::into_inner));
        let result = desk.bench.ask(what, &body);
        drop(writing);
        (result, began.elapsed())
    });
    match done.await {
        Ok((Ok(mut value), took)) => {
            value["took_ms"] = json!(took.as_millis() as u64);
            sent(StatusCode::OK, &value)
        }
        Ok((Err(because), _)) => match because {
            Unanswered::Changed => sent(StatusCode::OK, &json!({"changed": true})),
            Unanswered::Refused { field, message } => problem(StatusCode::UNPROCESSABLE_ENTITY, field, &message),
            Unanswered::Malformed(_) => problem(StatusCode::BAD_REQUEST, None, &because.to_string()),
            Unanswered::Unknown => problem(StatusCode::NOT_FOUND, None, &because.to_string()),
        },
        Err(_) => problem(StatusCode::INTERNAL_SERVER_ERROR, None, "this cannot be computed; the bench is as it was before"),
    }
}

fn sent(status: StatusCode, value: &Value) -> Answer {
    let mut answer = Response::new(Body::from(value.to_string()));
    *answer.status_mut() = status;
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
    answer
}

/// An error answer: the reason, and the field of the page in error.
fn problem(status: StatusCode, field: Option<&str>, because: &str) -> Answer {
    sent(status, &json!({"error": because, "field": field}))
}
