//! A device that sends lines of text over TCP. A thread of its own reads them, so that none waits in the network until it is
//! asked for.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use calibench::cell::gauge::open_socket;

use crate::ReadoutError;

/// Which side of a connection this program is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// It connects to a device that listens at `HOST:PORT`.
    Connect(String),
    /// It listens at `HOST:PORT` for a device that connects to it.
    Listen(String),
}

/// Timeout of a connection.
const CONNECTING: Duration = Duration::from_secs(3);
/// Wait before another attempt to connect.
const BREATH: Duration = Duration::from_millis(300);
/// Silence that ends a line of a device that has ended none so far: some never do.
const END_OF_LINE: Duration = Duration::from_millis(500);
/// Longest duration of one read of the socket.
const READ: Duration = Duration::from_millis(100);
/// Longest wait for a connection to be made again: devices that hang up after an answer listen again at once.
const AGAIN: Duration = Duration::from_secs(2);
/// Longest line, bytes: a point with name, time and uncertainty has 200.
const LONGEST_LINE: usize = 4096;
/// Most characters of a line in a message.
const SHOWN: usize = 80;
/// Most lines kept: a tracker that streams sends a thousand a second.
const MOST_LINES: usize = 10_000;

/// A line and when it arrived.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Arrived {
    /// When its last byte arrived.
    pub at: Instant,
    /// Its text, without its end.
    pub text: String,
}

/// A connection to a device that sends lines, made again when it is lost.
pub struct LineLink {
    whom: String,
    shared: Arc<Shared>,
    address: String,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    arrived: Condvar,
    is_closing: AtomicBool,
}

#[derive(Default)]
struct State {
    lines: VecDeque<Arrived>,
    stream: Option<TcpStream>,
    trouble: Option<String>,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LineLink {
    /// Connects, or listens. `whom` names the device in messages.
    ///
    /// # Errors
    /// If nobody listens at the address, or it cannot be listened at.
    pub fn open(whom: &str, end: &End) -> Result<Self, ReadoutError> {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let lost = |error: io::Error| ReadoutError::no_connection(whom, &error);
        let address = match end {
            End::Connect(address) => {
                let stream = open_socket(address, CONNECTING).map_err(lost)?;
                let address = address.clone();
                shared.state().stream = Some(stream.try_clone().map_err(lost)?);
                let told = address.clone();
                thread::spawn(move || theirs.read_on(Some(stream), || open_socket(&address, CONNECTING), || None));
                told
            }
            End::Listen(address) => {
                let cannot = |error: io::Error| {
                    ReadoutError::new(
                        whom,
                        format!("cannot listen at {address} ({error})"),
                        "give an address of this computer and a free port",
                    )
                };
                let listener = TcpListener::bind(address).map_err(cannot)?;
                listener.set_nonblocking(true).map_err(cannot)?;
                let told = listener.local_addr().map_err(cannot)?.to_string();
                // A device that was switched off and on leaves a dead connection behind: the newest is listened to.
                let accept = move || listener.accept().map(|(stream, _)| stream);
                thread::spawn(move || theirs.read_on(None, &accept, || accept().ok()));
                told
            }
        };
        Ok(LineLink { whom: whom.into(), shared, address })
    }

    /// The address connected to or listened at.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// True if the device is connected now.
    pub fn is_connected(&self) -> bool {
        self.shared.state().stream.is_some()
    }

    /// Sends a text as it is.
    ///
    /// # Errors
    /// If the device is not connected, or does not take it.
    pub fn send(&self, text: &str) -> Result<(), ReadoutError> {
        let until = Instant::now() + AGAIN;
        let mut state = self.shared.state();
        while state.stream.is_none() && Instant::now() < until {
            state = self.shared.arrived.wait_timeout(state, READ).unwrap_or_else(PoisonError::into_inner).0;
        }
        let Some(stream) = &state.stream else { return Err(self.not_connected(&state)) };
        let mut stream = stream.try_clone().map_err(|e| ReadoutError::no_connection(&self.whom, &e))?;
        drop(state);
        stream.write_all(text.as_bytes()).map_err(|e| ReadoutError::no_connection(&self.whom, &e))
    }

    /// Drops the connection, so that an answer that is late is not taken for the next.
    pub fn hang_up(&self) {
        let mut state = self.shared.state();
        state.lines.clear();
        if let Some(stream) = state.stream.take() {
            drop(stream.shutdown(std::net::Shutdown::Both));
        }
    }

    /// The first line that arrived after `since`, waited for until `until`; earlier ones are dropped. `None` if none came.
    pub fn line_after(&self, since: Instant, until: Instant) -> Option<Arrived> {
        let mut state = self.shared.state();
        loop {
            while let Some(line) = state.lines.pop_front() {
                if line.at > since {
                    return Some(line);
                }
            }
            let wait = until.checked_duration_since(Instant::now()).filter(|wait| !wait.is_zero())?;
            state = self.shared.arrived.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// The error of a device from which nothing came.
    pub fn silent(&self, waited: Duration, remedy: &str) -> ReadoutError {
        let state = self.shared.state();
        if state.stream.is_none() {
            return self.not_connected(&state);
        }
        let problem = format!("nothing came within {:.1} s", waited.as_secs_f64());
        ReadoutError::new(&self.whom, problem, remedy)
    }

    /// The error of a device that sent lines of another form; this was the last.
    pub fn other_line(&self, line: &str) -> ReadoutError {
        let shown: String = line.chars().take(SHOWN).collect();
        ReadoutError::new(&self.whom, format!("sent '{shown}'"), "correct `line`, which is to have the form of what it sends")
    }

    fn not_connected(&self, state: &State) -> ReadoutError {
        let why = state.trouble.as_ref().map(|trouble| format!(" ({trouble})")).unwrap_or_default();
        ReadoutError::new(&self.whom, format!("not connected{why}"), "start its output; the connection is made again by itself")
    }
}

impl Drop for LineLink {
    fn drop(&mut self) {
        self.shared.is_closing.store(true, Ordering::SeqCst);
        if let Some(stream) = self.shared.state().stream.take() {
            // The reading thread ends at once; if that fails, at its next look.
            drop(stream.shutdown(std::net::Shutdown::Both));
        }
    }
}

impl Shared {
    /// Reads lines, from one connection after the other, until the link is closed.
    /// `newer` is a connection that takes the place of one that is still open.
    fn read_on(
        &self,
        first: Option<TcpStream>,
        next: impl Fn() -> io::Result<TcpStream>,
        newer: impl Fn() -> Option<TcpStream>,
    ) {
        let mut stream = first;
        while !self.is_closing.load(Ordering::SeqCst) {
            let Some(open) = stream.take() else {
                match next() {
                    Ok(open) => stream = Some(open),
                    Err(_) => thread::sleep(BREATH),
                }
                continue;
            };
            self.state().stream = open.try_clone().ok();
            let why = match self.read_from(open, &newer) {
                Ok(newer) => {
                    stream = Some(newer);
                    continue;
                }
                Err(why) => why,
            };
            let mut state = self.state();
            (state.stream, state.trouble) = (None, Some(why));
            drop(state);
            thread::sleep(BREATH);
        }
    }

    /// Reads lines until a newer connection takes the place of this one, which is returned.
    ///
    /// # Errors
    /// Why the connection ended.
    fn read_from(&self, mut stream: TcpStream, newer: impl Fn() -> Option<TcpStream>) -> Result<TcpStream, String> {
        if stream.set_nonblocking(false).and_then(|()| stream.set_read_timeout(Some(READ))).is_err() {
            return Err("the connection cannot be read".into());
        }
        let (mut bytes, mut chunk) = (Vec::new(), [0; 4096]);
        let (mut ends_lines, mut last) = (false, Instant::now());
        while !self.is_closing.load(Ordering::SeqCst) {
            if let Some(newer) = newer() {
                return Ok(newer);
            }
            match stream.read(&mut chunk) {
                // What has no end may have been more.
                Ok(0) => return Err("it closed the connection".into()),
                Ok(count) => {
                    last = Instant::now();
                    for &byte in &chunk[..count] {
                        if matches!(byte, b'\n' | b'\r' | 0) {
                            ends_lines |= !bytes.is_empty();
                            self.take_line(&mut bytes);
                        } else {
                            bytes.push(byte);
                        }
                    }
                    if bytes.len() > LONGEST_LINE {
                        return Err(format!("it sends a line of more than {LONGEST_LINE} bytes"));
                    }
                }
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => {
                    if !ends_lines && last.elapsed() >= END_OF_LINE {
                        self.take_line(&mut bytes);
                    }
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e.to_string()),
            }
        }
        Err(String::new())
    }

    /// Keeps a line whose last byte arrived just now; the oldest make room for it.
    fn take_line(&self, bytes: &mut Vec<u8>) {
        let text = String::from_utf8_lossy(bytes).trim().to_owned();
        bytes.clear();
        if text.is_empty() {
            return;
        }
        let mut state = self.state();
        if state.lines.len() == MOST_LINES {
            state.lines.pop_front();
        }
        state.lines.push_back(Arrived { at: Instant::now(), text });
        drop(state);
        self.arrived.notify_all();
    }
}
