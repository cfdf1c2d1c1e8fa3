//! One client's connection to the variable server, re-established when it is lost.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use calibench_wire::kuka::{Call, FrameError, FrameReader, Request, Response, Value};
use thiserror::Error;

use crate::cell::ManipulatorError;
use crate::cell::gauge::Traffic;
use crate::cell::patience::Patience;
use crate::cell::socket::connect;

/// Reason why a variable was not read or written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LinkError {
    /// There is no answer at the address.
    #[error("no connection to {address}: {error}")]
    NoConnection {
        /// Address.
        address: String,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// The connection gives no answer: the cable is out, the server hangs, or a device in between has dropped the connection
    /// from its table.
    #[error("no answer within {:.1} s", waited.as_secs_f64())]
    Silent {
        /// Time waited.
        waited: Duration,
    },
    /// The connection was closed by the other side.
    #[error("the connection broke: {0}")]
    Broken(std::io::Error),
    /// The bytes received are not of the protocol.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// No such variable.
    #[error("the controller knows no variable '{name}'")]
    Unknown {
        /// Its name.
        name: String,
    },
    /// The controller refused a value.
    #[error("the controller does not accept {value} for '{name}'")]
    NotTaken {
        /// Name.
        name: String,
        /// Value.
        value: String,
    },
    /// A value of another kind than expected.
    #[error("'{name}' is {value}, which is not {expected}")]
    Unexpected {
        /// Name.
        name: String,
        /// Value received.
        value: String,
        /// Kind expected.
        expected: &'static str,
    },
}

impl LinkError {
    /// True if the connection failed, not the variable.
    pub fn is_of_connection(&self) -> bool {
        !matches!(self, LinkError::Unknown { .. } | LinkError::NotTaken { .. } | LinkError::Unexpected { .. })
    }
}

impl From<LinkError> for ManipulatorError {
    fn from(error: LinkError) -> Self {
        if error.is_of_connection() {
            ManipulatorError::Lost { detail: error.to_string() }
        } else {
            ManipulatorError::Refused { reason: error.to_string() }
        }
    }
}

/// Wait before reconnecting; the server may need it to notice that the old connection is gone.
const BREATH: Duration = Duration::from_millis(200);

/// Longest duration of one read of the socket.
const LOOK: Duration = Duration::from_millis(20);

/// A connection to the variable server.
pub struct Link {
    address: String,
    patience: Patience,
    connection: Option<(TcpStream, FrameReader)>,
    tag: u16,
    traffic: Traffic,
}

impl Link {
    /// Connects.
    ///
    /// # Errors
    /// When there is no answer.
    pub fn open(address: &str, patience: Patience) -> Result<Self, LinkError> {
        let mut link = Link { address: address.into(), patience, connection: None, tag: 0, traffic: Traffic::default() };
        link.connect()?;
        Ok(link)
    }

    /// Bytes transferred so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Reads a variable. Reading changes nothing, so a lost connection is re-established.
    ///
    /// # Errors
    /// When the connection stays lost, or there is no such variable.
    pub fn read(&mut self, name: &str) -> Result<Value, LinkError> {
        let call = Call::Read { name: name.into() };
        let response = self.patiently(&call)?;
        // One server reports failure, the other success with an empty value.
        if !response.success || response.value.is_empty() {
            return Err(LinkError::Unknown { name: name.into() });
        }
        Value::parse(&response.value).map_err(|_| LinkError::Unexpected {
            name: name.into(),
            value: response.value,
            expected: "a value of KRL",
        })
    }

    /// Writes a variable; only for writes that may be repeated, as a lost connection is re-established.
    ///
    /// # Errors
    /// When the connection stays lost, or the controller does not accept the value.
    pub fn write(&mut self, name: &str, value: &str) -> Result<(), LinkError> {
        let response = self.patiently(&Call::Write { name: name.into(), value: value.into() })?;
        taken(&response, name, value)
    }

    /// Writes a variable with a single attempt: after an error of the connection it is unknown whether the value arrived.
    ///
    /// # Errors
    /// When the connection fails, or the controller does not accept the value.
    pub fn write_once(&mut self, name: &str, value: &str) -> Result<(), LinkError> {
        let response = self.exchange(&Call::Write { name: name.into(), value: value.into() })?;
        taken(&response, name, value)
    }

    fn patiently(&mut self, call: &Call) -> Result<Response, LinkError> {
        let mut left = self.patience.reconnects;
        loop {
            match self.exchange(call) {
                Err(error) if error.is_of_connection() && left > 0 => {
                    left -= 1;
                    std::thread::sleep(BREATH);
                }
                answer => return answer,
            }
        }
    }

    fn connect(&mut self) -> Result<(), LinkError> {
        let fail = |error| LinkError::NoConnection { address: self.address.clone(), error };
        let stream = connect(&self.address, self.patience.connect).map_err(fail)?;
        stream.set_read_timeout(Some(LOOK)).map_err(fail)?;
        stream.set_write_timeout(Some(self.patience.answer)).map_err(fail)?;
        self.connection = Some((stream, FrameReader::default()));
        Ok(())
    }

    /// Sends one request and returns its answer. A connection on which that fails is dropped, as its answer may still come
    /// late.
    fn exchange(&mut self, call: &Call) -> Result<Response, LinkError> {
        if self.connection.is_none() {
            self.connect()?;
        }
        self.tag = self.tag.wrapping_add(1);
        let request = Request { tag: self.tag, call: call.clone() };
        let answer = self.speak(&request);
        if answer.as_ref().is_err_and(LinkError::is_of_connection) {
            self.connection = None;
        }
        answer
    }

    fn speak(&mut self, request: &Request) -> Result<Response, LinkError> {
        let Some((stream, frames)) = &mut self.connection else {
            return Err(LinkError::Broken(ErrorKind::NotConnected.into()));
        };
        let bytes = request.encode()?;
        // Sent in one write: KUKAVARPROXY does not reassemble a fragmented request.
        stream.write_all(&bytes).map_err(LinkError::Broken)?;
        self.traffic.sent += bytes.len() as u64;
        let began = Instant::now();
        let mut received = [0; 1024];
        loop {
            while let Some(response) = frames.response()? {
                // A late answer to an earlier request is ignored.
                if response.tag == request.tag {
                    return Ok(response);
                }
            }
            if began.elapsed() >= self.patience.answer {
                return Err(LinkError::Silent { waited: self.patience.answer });
            }
            match stream.read(&mut received) {
                Ok(0) => return Err(LinkError::Broken(ErrorKind::UnexpectedEof.into())),
                Ok(count) => {
                    self.traffic.received += count as u64;
                    frames.push(&received[..count]);
                }
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
                Err(e) => return Err(LinkError::Broken(e)),
            }
        }
    }
}

fn taken(response: &Response, name: &str, value: &str) -> Result<(), LinkError> {
    if response.success { Ok(()) } else { Err(LinkError::NotTaken { name: name.into(), value: value.into() }) }
}
