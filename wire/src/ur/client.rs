//! A client of RTDE: it agrees on the variables, keeps the newest values that the controller sends, and writes inputs.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use thiserror::Error;

use super::package::PROTOCOL_VERSION;
use super::{DataType, Datum, Package, PackageError, PackageKind, PackageReader};

/// Reason why nothing was exchanged.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ClientError {
    /// The connection was closed by the other side.
    #[error("the connection broke: {0}")]
    Broken(#[from] io::Error),
    /// The controller sends nothing: the cable is out, or a device in between has dropped the connection from its table.
    #[error("no answer within {:.1} s", waited.as_secs_f64())]
    Silent {
        /// Time waited.
        waited: Duration,
    },
    /// The bytes received are not of the protocol.
    #[error(transparent)]
    Package(#[from] PackageError),
    /// A package is not what its recipe says.
    #[error("a package is not what was agreed on")]
    Recipe,
    /// The controller does not speak this version of the protocol.
    #[error("the controller does not speak version 2 of RTDE; its software is older than 3.2.19171 or 5.0")]
    Version,
    /// The controller has no such variable.
    #[error("the controller has no variable '{name}'; its software {software} is too old")]
    Unknown {
        /// Name of the variable.
        name: String,
        /// Version of its software.
        software: String,
    },
    /// Another client writes the variable.
    #[error("another client writes '{name}': end that client, or the fieldbus or program that writes it")]
    InUse {
        /// Name of the variable.
        name: String,
    },
    /// The controller does not start to send.
    #[error("the controller does not start the exchange")]
    NotStarted,
}

/// The variables exchanged.
#[derive(Debug, Clone, Copy)]
pub struct Recipes<'a> {
    /// Outputs of the controller.
    pub outputs: &'a [&'a str],
    /// Groups of inputs of the controller; a group is written at once.
    pub inputs: &'a [&'a [&'a str]],
}

/// Values that the controller sent.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Seen {
    /// By the variable's name.
    pub values: BTreeMap<String, Datum>,
}

impl Seen {
    /// A number; 0 if the variable is not exchanged.
    pub fn integer(&self, name: &str) -> i64 {
        self.values.get(name).map(Datum::integer).unwrap_or_default()
    }

    /// A number; 0 if the variable is not exchanged.
    pub fn real(&self, name: &str) -> f64 {
        self.values.get(name).map(Datum::real).unwrap_or_default()
    }

    /// Six numbers; zeros if the variable is not exchanged.
    pub fn six(&self, name: &str) -> [f64; 6] {
        self.values.get(name).map(Datum::six).unwrap_or_default()
    }
}

/// Variables in the order of their values.
#[derive(Debug, Clone, Default)]
struct Recipe {
    number: u8,
    variables: Vec<Variable>,
}

#[derive(Debug, Clone)]
struct Variable {
    name: String,
    kind: DataType,
}

/// What the reading thread shares with the client.
#[derive(Default)]
struct Shared {
    state: Mutex<Received>,
    arrived: Condvar,
}

#[derive(Default)]
struct Received {
    newest: Vec<u8>,
    packages: u64,
    bytes: u64,
    messages: Vec<String>,
    error: Option<ClientError>,
}

/// Packages a second that the controller can send: before the e-Series, and from it on.
const FREQUENCIES: [f64; 2] = [125.0, 500.0];

/// First major version of the software of the e-Series.
const E_SERIES: u32 = 5;

/// Most messages in words that are kept.
const MOST_MESSAGES: usize = 50;

/// A client of RTDE whose exchange has begun. A thread of its own reads what the controller sends, so that the connection never
/// stalls while the program is busy elsewhere.
pub struct Client {
    stream: TcpStream,
    answer_within: Duration,
    software: [u32; 4],
    outputs: Recipe,
    inputs: Vec<Recipe>,
    sent: u64,
    shared: Arc<Shared>,
}

impl Client {
    /// Agrees with the controller behind `stream` on the variables, and starts the exchange. No input is
    /// written. Nothing is waited for longer than `answer_within`.
    ///
    /// # Errors
    /// When the controller does not answer, speaks another version, or a variable is not to be had.
    pub fn start(stream: TcpStream, recipes: &Recipes<'_>, answer_within: Duration) -> Result<Self, ClientError> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(answer_within))?;
        let mut talk = Talk { stream, reader: PackageReader::default(), answer_within, sent: 0 };
        if talk.ask(PackageKind::ProtocolVersion, PROTOCOL_VERSION.to_be_bytes().to_vec())?.first() != Some(&1) {
            return Err(ClientError::Version);
        }
        let version = talk.ask(PackageKind::ControllerVersion, Vec::new())?;
        let mut software = [0; 4];
        for (number, bytes) in software.iter_mut().zip(version.as_chunks::<4>().0) {
            *number = u32::from_be_bytes(*bytes);
        }
        let frequency = if software[0] >= E_SERIES { FREQUENCIES[1] } else { FREQUENCIES[0] };
        let mut asked = frequency.to_be_bytes().to_vec();
        asked.extend_from_slice(recipes.outputs.join(",").as_bytes());
        let outputs = recipe(recipes.outputs, &talk.ask(PackageKind::Outputs, asked)?, software)?;
        let mut inputs = Vec::with_capacity(recipes.inputs.len());
        for group in recipes.inputs {
            let answer = talk.ask(PackageKind::Inputs, group.join(",").into_bytes())?;
            inputs.push(recipe(group, &answer, software)?);
        }
        if talk.ask(PackageKind::Start, Vec::new())?.first() != Some(&1) {
            return Err(ClientError::NotStarted);
        }
        let Talk { stream, reader, sent, .. } = talk;
        stream.set_read_timeout(None)?;
        let shared = Arc::new(Shared::default());
        let (reading, theirs, number) = (stream.try_clone()?, Arc::clone(&shared), outputs.number);
        std::thread::spawn(move || read_on(reading, reader, number, &theirs));
        Ok(Client { stream, answer_within, software, outputs, inputs, sent, shared })
    }

    /// Version of the controller's software: major, minor, bugfix, build.
    pub fn software(&self) -> [u32; 4] {
        self.software
    }

    /// Bytes sent and received since the exchange began.
    pub fn bytes(&self) -> [u64; 2] {
        [self.sent, self.received().bytes]
    }

    /// The messages in words that arrived since the last call.
    pub fn messages(&self) -> Vec<String> {
        std::mem::take(&mut self.received().messages)
    }

    /// Values that the controller took after this call: those of the second package from now on, because the first may have
    /// been on its way already.
    ///
    /// # Errors
    /// When the connection is lost, or nothing arrives in time.
    pub fn fresh(&mut self) -> Result<Seen, ClientError> {
        let began = Instant::now();
        let mut received = self.received();
        let wanted = received.packages + 2;
        while received.packages < wanted {
            if let Some(error) = received.error.take() {
                received.error = Some(ClientError::Broken(ErrorKind::NotConnected.into()));
                return Err(error);
            }
            let waited = began.elapsed();
            let Some(rest) = self.answer_within.checked_sub(waited) else { return Err(ClientError::Silent { waited }) };
            received = match self.shared.arrived.wait_timeout(received, rest) {
                Ok((received, _)) => received,
                Err(poisoned) => poisoned.into_inner().0,
            };
        }
        let newest = std::mem::take(&mut received.newest);
        drop(received);
        let mut rest = &newest[..];
        let mut seen = Seen::default();
        for Variable { name, kind } in &self.outputs.variables {
            seen.values.insert(name.clone(), Datum::decode(*kind, &mut rest).ok_or(ClientError::Recipe)?);
        }
        Ok(seen)
    }

    /// Writes the values of a group of inputs, in the order of its names. The controller does not acknowledge them.
    ///
    /// # Errors
    /// When the connection is lost, or the values are not as many as the group's names.
    pub fn write(&mut self, group: usize, values: &[Datum]) -> Result<(), ClientError> {
        let recipe = self.inputs.get(group).filter(|recipe| recipe.variables.len() == values.len());
        let recipe = recipe.ok_or(ClientError::Recipe)?;
        let mut body = vec![recipe.number];
        for (variable, value) in recipe.variables.iter().zip(values) {
            value.encode(variable.kind, &mut body);
        }
        let bytes = Package { kind: PackageKind::Data, body }.encode();
        self.stream.write_all(&bytes)?;
        self.sent += bytes.len() as u64;
        Ok(())
    }

    fn received(&self) -> MutexGuard<'_, Received> {
        self.shared.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        // Ends the reading thread; a connection that is closed already needs no more.
        drop(self.stream.shutdown(Shutdown::Both));
    }
}

/// Questions and answers before the exchange begins.
struct Talk {
    stream: TcpStream,
    reader: PackageReader,
    answer_within: Duration,
    sent: u64,
}

impl Talk {
    /// Sends a package; returns the body of the answer of the same type.
    fn ask(&mut self, kind: PackageKind, body: Vec<u8>) -> Result<Vec<u8>, ClientError> {
        let bytes = Package { kind, body }.encode();
        self.stream.write_all(&bytes)?;
        self.sent += bytes.len() as u64;
        let began = Instant::now();
        let mut buffer = [0; 4096];
        loop {
            while let Some(package) = self.reader.next_package()? {
                if package.kind == kind {
                    return Ok(package.body);
                }
            }
            let waited = began.elapsed();
            let rest = self.answer_within.checked_sub(waited).filter(|rest| !rest.is_zero());
            let Some(rest) = rest else { return Err(ClientError::Silent { waited }) };
            self.stream.set_read_timeout(Some(rest))?;
            match self.stream.read(&mut buffer) {
                Ok(0) => return Err(ClientError::Broken(ErrorKind::UnexpectedEof.into())),
                Ok(length) => self.reader.push(&buffer[..length]),
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                Err(e) => return Err(e.into()),
            }
        }
    }
}

/// The recipe that the controller answered with.
fn recipe(names: &[&str], answer: &[u8], software: [u32; 4]) -> Result<Recipe, ClientError> {
    let (&number, types) = answer.split_first().ok_or(ClientError::Recipe)?;
    let types = String::from_utf8_lossy(types);
    let types: Vec<&str> = types.split(',').collect();
    if types.len() != names.len() {
        return Err(ClientError::Recipe);
    }
    let variable = |(name, kind): (&&str, &&str)| match DataType::of(kind) {
        Some(kind) => Ok(Variable { name: (*name).to_owned(), kind }),
        None if kind.trim() == "IN_USE" => Err(ClientError::InUse { name: (*name).to_owned() }),
        None => {
            let [major, minor, bugfix, _] = software;
            Err(ClientError::Unknown { name: (*name).to_owned(), software: format!("{major}.{minor}.{bugfix}") })
        }
    };
    let variables = names.iter().zip(&types).map(variable).collect::<Result<_, _>>()?;
    Ok(Recipe { number, variables })
}

/// Reads packages until the connection ends; keeps the newest values of this recipe.
fn read_on(mut stream: TcpStream, mut reader: PackageReader, number: u8, shared: &Shared) {
    let mut buffer = [0; 16_384];
    let error = loop {
        match reader.next_package() {
            Err(error) => break error.into(),
            Ok(Some(package)) => {
                let mut state = shared.state.lock().unwrap_or_else(PoisonError::into_inner);
                match (package.kind, package.body.split_first()) {
                    (PackageKind::Data, Some((&recipe, values))) if recipe == number => {
                        state.newest = values.to_vec();
                        state.packages += 1;
                        shared.arrived.notify_all();
                    }
                    (PackageKind::Message, _) if state.messages.len() < MOST_MESSAGES => {
                        state.messages.extend(package.words());
                    }
                    _ => {}
                }
                continue;
            }
            Ok(None) => {}
        }
        match stream.read(&mut buffer) {
            Ok(0) => break ClientError::Broken(ErrorKind::UnexpectedEof.into()),
            Ok(length) => {
                reader.push(&buffer[..length]);
                shared.state.lock().unwrap_or_else(PoisonError::into_inner).bytes += length as u64;
            }
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) => break e.into(),
        }
    };
    shared.state.lock().unwrap_or_else(PoisonError::into_inner).error = Some(error);
    shared.arrived.notify_all();
}
