//! The variable server on the robot's controller: KUKAVARPROXY, or C3 Bridge's basic functions, over TCP.

use std::io;
use std::rc::Rc;
use std::time::Duration;

use calibench_wire::kuka::{Call, FrameError, FrameReader, Request, Response, Value};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::spawn_local;
use tokio::time::timeout;

use super::controller::Controller;
use super::variables::NotWritten;
use crate::fault::Fault;
use crate::service::{RobotManner, VariableServer};

/// Most clients that KUKAVARPROXY accepts.
const MOST_CLIENTS: usize = 10;

/// Idle time after which KUKAVARPROXY drops a client.
const IDLE: Duration = Duration::from_secs(30);

/// Time the controller takes to look up a variable, s (measured on Cross3: 2 ms; with the proxy and its network 4 ms).
const LOOK_UP_S: f64 = 4e-3;

/// Longest answer, bytes: some clients read no more at once.
const LONGEST_ANSWER: usize = 256;

/// Bytes of an answer besides its value.
const AROUND_VALUE: usize = 10;

/// Accepts clients until the socket is closed.
///
/// # Errors
/// When the socket fails.
pub async fn listen(listener: TcpListener, controller: Rc<Controller>, manner: RobotManner) -> io::Result<()> {
    let clients = Rc::new(());
    loop {
        let (stream, _) = listener.accept().await?;
        if Rc::strong_count(&clients) > MOST_CLIENTS {
            continue;
        }
        let (client, controller) = (Rc::clone(&clients), Rc::clone(&controller));
        spawn_local(async move {
            // An error ends this connection only.
            drop(Connection { stream, controller, manner }.serve().await);
            drop(client);
        });
    }
}

struct Connection {
    stream: TcpStream,
    controller: Rc<Controller>,
    manner: RobotManner,
}

impl Connection {
    async fn serve(mut self) -> io::Result<()> {
        self.stream.set_nodelay(true)?;
        let mut broken = self.controller.arm.broken_links.subscribe();
        let mut frames = FrameReader::default();
        let mut buffer = [0; 2048];
        loop {
            let idle = if self.manner.server == VariableServer::Kukavarproxy { IDLE } else { Duration::MAX };
            let length = tokio::select! {
                read = timeout(idle, self.stream.read(&mut buffer)) => read??,
                _ = broken.changed() => return self.stream.set_zero_linger(),
            };
            if length == 0 {
                return Ok(());
            }
            self.controller.arm.floor.traffic.note_robot_request(length);
            frames.push(&buffer[..length]);
            loop {
                match frames.request() {
                    Ok(None) => break,
                    Ok(Some(request)) => {
                        if self.controller.arm.floor.faults.borrow_mut().strikes(Fault::HalfOpen, 0) {
                            return self.go_mute().await;
                        }
                        self.answer(request).await?;
                    }
                    Err(FrameError::Malformed { .. }) => {}
                    Err(FrameError::TooLong { .. }) => return Ok(()),
                    Err(other) => return Err(io::Error::other(other)),
                }
            }
            if self.manner.no_reassembly && frames.is_amid_frame() {
                frames = FrameReader::default();
            }
        }
    }

    /// Keeps the connection open without answering any more.
    async fn go_mute(&mut self) -> io::Result<()> {
        let mut buffer = [0; 256];
        while self.stream.read(&mut buffer).await? > 0 {}
        Ok(())
    }

    async fn answer(&mut self, Request { tag, call }: Request) -> io::Result<()> {
        self.controller.arm.floor.wait(LOOK_UP_S).await;
        let response = match call {
            Call::Read { name } => self.read(tag, &name),
            Call::Write { name, value } => self.write(tag, &name, value),
            // Neither server answers unknown requests.
            Call::Other { .. } => return Ok(()),
        };
        let Ok(bytes) = response.encode() else { return Ok(()) };
        self.controller.arm.floor.traffic.note_robot_answer(bytes.len());
        // Written in one piece: some clients read only once.
        self.stream.write_all(&bytes).await
    }

    fn read(&self, tag: u16, name: &str) -> Response {
        let c3 = self.manner.server == VariableServer::C3;
        let value = match name.trim() {
            "PING" => Some("PONG".to_owned()),
            "@PROXY_TYPE" if c3 => Some("C3 BRIDGE INTERFACE".into()),
            "@PROXY_VERSION" if c3 => Some("1.7 (OPEN SOURCE)".into()),
            name => self.controller.get(name).map(|value| self.text(&value)),
        };
        match value {
            Some(value) if value.len() + AROUND_VALUE <= LONGEST_ANSWER => {
                Response { tag, function: 0, value, code: 1, success: true }
            }
            // KUKAVARPROXY never reports that a variable could not be read.
            _ if !c3 => Response { tag, function: 0, value: String::new(), code: 1, success: true },
            _ => Response { tag, function: 0, value: String::new(), code: 0, success: false },
        }
    }

    fn write(&self, tag: u16, name: &str, value: String) -> Response {
        let written = match Value::parse(&value) {
            Ok(parsed) => self.controller.set(name, &parsed),
            Err(_) => Err(NotWritten::Refused),
        };
        match (written, self.manner.server) {
            (Ok(()), _) => Response { tag, function: 1, value, code: 1, success: true },
            (Err(_), VariableServer::Kukavarproxy) => Response { tag, function: 1, value, code: 1, success: false },
            (Err(_), VariableServer::C3) => Response { tag, function: 1, value: String::new(), code: 0, success: false },
        }
    }

    fn text(&self, value: &Value) -> String {
        let text = value.to_string();
        if self.manner.seven_digits { in_seven_digits(&text) } else { text }
    }
}

/// Formats a value with its numbers rounded to seven digits.
fn in_seven_digits(text: &str) -> String {
    let round = |piece: &str| {
        let number = piece.trim_end_matches([' ', ',', '}']);
        let rounded =
            number.parse::<f64>().ok().filter(|_| number.contains('.')).and_then(|n| format!("{n:.6e}").parse::<f64>().ok());
        rounded.map_or_else(|| piece.to_owned(), |rounded| format!("{rounded:?}{}", &piece[number.len()..]))
    };
    text.split_inclusive([' ', ',', '}']).map(round).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seven_digits_as_older_controllers_show_them() {
        let text = "{E6POS: X 1991.28198, Y 91.0391846, Z 1659.51501, A 160.255905, S 2, E1 0.0}";
        assert_eq!(in_seven_digits(text), "{E6POS: X 1991.282, Y 91.03918, Z 1659.515, A 160.2559, S 2, E1 0.0}");
        assert_eq!(in_seven_digits("\"1.2 or\""), "\"1.2 or\"");
    }
}
