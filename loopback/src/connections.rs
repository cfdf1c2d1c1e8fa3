//! Connections to the workbench, independent of each other; idle ones are closed.

use std::io;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::time::sleep;

/// Time limit for the header of a request, counted from the connection or the previous answer: a browser sends it at once, and
/// opens a new connection if an idle one was closed.
pub const HEADER_PATIENCE: Duration = Duration::from_secs(10);

/// Delay before the next attempt if the system has no resources for another connection.
const NO_ROOM: Duration = Duration::from_secs(1);

/// Serves every connection by `routes`; one that does not send a complete request header within `patience` is closed. Never
/// returns.
pub async fn answer(listener: TcpListener, routes: Router, patience: Duration) {
    let mut http = http1::Builder::new();
    // The server of axum itself has no time limits (tokio-rs/axum, `axum::serve`: "does not support any configuration").
    http.timer(TokioTimer::new()).header_read_timeout(patience);
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(e) if is_of_one_connection(&e) => continue,
            Err(_) => {
                sleep(NO_ROOM).await;
                continue;
            }
        };
        let connection = http.serve_connection(TokioIo::new(stream), TowerToHyperService::new(routes.clone()));
        // An error on one connection ends only that connection.
        tokio::spawn(async move { drop(connection.await) });
    }
}

/// True if a connection was gone before it was accepted.
fn is_of_one_connection(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{Ipv4Addr, SocketAddr, TcpStream};
    use std::time::Instant;

    use axum::routing::get;

    use super::*;

    /// Time limit for a request's header in these tests, short so that they end soon.
    const PATIENCE: Duration = Duration::from_millis(300);

    /// A server that answers `/` with `here` after a delay, until the test process ends.
    fn served(after: Duration) -> SocketAddr {
        let listener = std::net::TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            let here = move || async move {
                sleep(after).await;
                "here"
            };
            runtime.block_on(async {
                let listener = TcpListener::from_std(listener).unwrap();
                answer(listener, Router::new().route("/", get(here)), PATIENCE).await;
            });
        });
        address
    }

    fn connect(address: SocketAddr) -> TcpStream {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// Reads until the other side closes.
    fn rest(stream: &mut TcpStream) -> String {
        let mut bytes = Vec::new();
        // A connection closed while the client still sends is reset.
        drop(stream.read_to_end(&mut bytes));
        String::from_utf8_lossy(&bytes).into_owned()
    }

    #[test]
    fn whoever_sends_no_whole_header_is_sent_away_and_nobody_else() {
        let address = served(Duration::ZERO);
        let mut silent = connect(address);
        let mut dripping = connect(address);
        let began = Instant::now();
        let drips = std::thread::spawn(move || {
            // One byte at a time, so that the connection is never idle until it is closed.
            let header = b"GET / HTTP/1.1\r\nHost: here\r\nX-Slow: ".iter().chain(std::iter::repeat(&b'x'));
            for byte in header {
                if dripping.write_all(&[*byte]).is_err() || began.elapsed() > Duration::from_secs(50) {
                    break;
                }
                std::thread::sleep(Duration::from_millis(10));
            }
            began.elapsed()
        });
        // Other connections are served meanwhile, repeatedly on one connection.
        let mut ordinary = connect(address);
        for _ in 0..3 {
            ordinary.write_all(b"GET / HTTP/1.1\r\nHost: here\r\n\r\n").unwrap();
            let mut answer = [0; 1024];
            let length = ordinary.read(&mut answer).unwrap();
            assert!(String::from_utf8_lossy(&answer[..length]).starts_with("HTTP/1.1 200"));
        }
        assert!(!rest(&mut silent).contains("200"));
        assert!(began.elapsed() >= PATIENCE, "closed after {:?}", began.elapsed());
        assert!(drips.join().unwrap() < Duration::from_secs(50), "dripped on and on");
    }

    #[test]
    fn an_answer_may_take_longer_than_a_header() {
        let mut stream = connect(served(2 * PATIENCE));
        stream.write_all(b"GET / HTTP/1.1\r\nHost: here\r\nConnection: close\r\n\r\n").unwrap();
        assert!(rest(&mut stream).ends_with("here"));
    }
}
