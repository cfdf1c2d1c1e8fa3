//! The connections to the controller: RTDE, re-established when it is lost; the secondary interface and the dashboard, opened
//! when they are needed.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use calibench_wire::ur::registers::{self, ACTION, ALIVE, BEGIN, CANCEL, DONE, ORDER, RESULT, SEEN, TARGET};
use calibench_wire::ur::{CartesianInfo, Client, ClientError, Datum, PROGRAM, Recipes, Seen, StateMessageReader, ports};
use thiserror::Error;

use super::{UrSettings, UrTorques};
use crate::cell::ManipulatorError;
use crate::cell::gauge::Traffic;
use crate::cell::socket::connect;

/// Reason why the controller was not heard.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum UrError {
    /// There is no answer at the address.
    #[error("no connection to {address}: {error}")]
    NoConnection {
        /// Address.
        address: String,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// RTDE fails.
    #[error(transparent)]
    Rtde(#[from] ClientError),
    /// The secondary interface does not tell the tool.
    #[error("{address} sends no robot state")]
    NoRobotState {
        /// Address.
        address: String,
    },
    /// The software does not convert currents to torques.
    #[error("its software does not tell torques ({error}): give robot.torques.nm_per_a, the N·m per ampere of each joint")]
    NoTorques {
        /// What is missing.
        error: ClientError,
    },
    /// The secondary interface takes no program.
    #[error("{address} takes no program: {error}")]
    NotSent {
        /// Address.
        address: String,
        /// Error of the operating system.
        error: std::io::Error,
    },
}

impl From<UrError> for ManipulatorError {
    fn from(error: UrError) -> Self {
        let words = error.to_string();
        if is_of_connection(&error) {
            ManipulatorError::Lost { detail: words }
        } else {
            ManipulatorError::Refused { reason: words }
        }
    }
}

/// Groups of inputs: what is written at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Group {
    /// The target of an order.
    Target,
    /// The number of the order.
    Order,
    /// The number of the order to be broken off.
    Cancel,
    /// The speed slider.
    Speed,
    /// The number of the order that may begin.
    Begin,
}

/// The inputs of each group, in the order of [`Group`].
const INPUTS: [&[&str]; 5] = [
    &[ACTION, TARGET[0], TARGET[1], TARGET[2], TARGET[3], TARGET[4], TARGET[5], TARGET[6], TARGET[7]],
    &[ORDER],
    &[CANCEL],
    &["speed_slider_mask", "speed_slider_fraction"],
    &[BEGIN],
];

/// The outputs that the driver reads.
const OUTPUTS: [&str; 26] = [
    "actual_q",
    "target_q",
    "actual_TCP_pose",
    "target_TCP_pose",
    "robot_mode",
    "safety_status",
    "runtime_state",
    "robot_status_bits",
    "target_speed_fraction",
    "payload",
    "joint_temperatures",
    ORDER,
    ACTION,
    TARGET[0],
    TARGET[1],
    TARGET[2],
    TARGET[3],
    TARGET[4],
    TARGET[5],
    TARGET[6],
    TARGET[7],
    DONE,
    RESULT,
    registers::PROGRAM,
    ALIVE,
    SEEN,
];

/// Wait before reconnecting; the controller may need it to notice that the old connection is gone.
const BREATH: Duration = Duration::from_millis(200);

/// The connections to a controller.
pub(super) struct Link {
    settings: UrSettings,
    client: Option<Client>,
    before: Traffic,
    connections: usize,
}

impl Link {
    /// Connects.
    pub fn open(settings: &UrSettings) -> Result<Self, UrError> {
        let mut link = Link { settings: settings.clone(), client: None, before: Traffic::default(), connections: 0 };
        for attempt in 0.. {
            match link.client() {
                // A controller that was reached and fell silent, or hung up, is asked again; one that does not answer is not.
                Err(error @ UrError::Rtde(_)) if attempt < settings.patience.reconnects && is_of_connection(&error) => {
                    std::thread::sleep(BREATH);
                }
                Err(error) => return Err(error),
                Ok(_) => break,
            }
        }
        Ok(link)
    }

    /// Bytes exchanged so far.
    pub fn traffic(&self) -> Traffic {
        let [sent, received] = self.client.as_ref().map(Client::bytes).unwrap_or_default();
        Traffic { sent: self.before.sent + sent, received: self.before.received + received }
    }

    /// Number of connections tried so far.
    pub fn connections(&self) -> usize {
        self.connections
    }

    /// The last message in words that the controller sent, if any.
    pub fn message(&self) -> Option<String> {
        self.client.as_ref()?.messages().pop()
    }

    /// The state of the controller after this call. Reading changes nothing, so a lost connection is re-established.
    pub fn state(&mut self) -> Result<Seen, UrError> {
        self.patiently(|client| client.fresh())
    }

    /// Writes inputs. They are absolute, so they are written again when the connection was lost.
    pub fn write(&mut self, group: Group, values: &[Datum]) -> Result<(), UrError> {
        self.patiently(|client| client.write(group as usize, values))
    }

    /// Re-establishes nothing from now on.
    pub fn wait_no_longer(&mut self) {
        self.settings.patience.reconnects = 0;
        self.settings.patience.connect = BREATH;
    }

    /// Drops the connection, without a new one.
    pub fn close(&mut self) {
        self.before = self.traffic();
        self.client = None;
    }

    fn patiently<T>(&mut self, mut act: impl FnMut(&mut Client) -> Result<T, ClientError>) -> Result<T, UrError> {
        let mut attempts = 0;
        loop {
            let done = match self.client() {
                Ok(client) => act(client).map_err(UrError::from),
                Err(error) => Err(error),
            };
            match done {
                Ok(value) => return Ok(value),
                Err(error) if attempts >= self.settings.patience.reconnects || !is_of_connection(&error) => return Err(error),
                Err(_) => {
                    attempts += 1;
                    self.close();
                    std::thread::sleep(BREATH);
                }
            }
        }
    }

    fn client(&mut self) -> Result<&mut Client, UrError> {
        let client = match self.client.take() {
            Some(client) => client,
            None => {
                self.connections += 1;
                self.connect()?
            }
        };
        Ok(self.client.insert(client))
    }

    fn connect(&self) -> Result<Client, UrError> {
        let UrSettings { address, patience, torques, .. } = &self.settings;
        let stream =
            connect(address, patience.connect).map_err(|error| UrError::NoConnection { address: address.clone(), error })?;
        let asked = torques.map(UrTorques::variable);
        let outputs: Vec<&str> = OUTPUTS.into_iter().chain(asked).collect();
        let recipes = Recipes { outputs: &outputs, inputs: &INPUTS };
        Client::start(stream, &recipes, patience.answer).map_err(|error| match error {
            ClientError::Unknown { ref name, .. } if Some(name.as_str()) == asked => UrError::NoTorques { error },
            error => error.into(),
        })
    }

    /// The tool as the controller's state message has it.
    pub fn tool(&self) -> Result<CartesianInfo, UrError> {
        let address = self.settings.beside(ports::SECONDARY);
        let failed = |error| UrError::NoConnection { address: address.clone(), error };
        let patience = &self.settings.patience;
        let mut stream = connect(&address, patience.connect).map_err(failed)?;
        stream.set_read_timeout(Some(patience.answer)).map_err(failed)?;
        let (mut reader, mut buffer) = (StateMessageReader::default(), [0; 4096]);
        let began = Instant::now();
        while began.elapsed() < patience.answer {
            match stream.read(&mut buffer) {
                Ok(0) => break,
                Ok(length) => {
                    if let Some(tool) = reader.push(&buffer[..length]) {
                        return Ok(tool);
                    }
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(_) => break,
            }
        }
        Err(UrError::NoRobotState { address })
    }

    /// Sends the program to the controller, which starts it at once.
    pub fn send_program(&self) -> Result<(), UrError> {
        let address = self.settings.beside(ports::SECONDARY);
        let mut stream = connect(&address, self.settings.patience.connect)
            .map_err(|error| UrError::NoConnection { address: address.clone(), error })?;
        stream.write_all(PROGRAM.as_bytes()).map_err(|error| UrError::NotSent { address, error })
    }

    /// True if the dashboard says that the controller is not in remote control, where it takes no programs.
    pub fn is_in_local_control(&self) -> bool {
        self.ask_dashboard("is in remote control").is_some_and(|answer| answer.trim() == "false")
    }

    /// The dashboard's answer; `None` where there is no dashboard.
    fn ask_dashboard(&self, question: &str) -> Option<String> {
        let patience = &self.settings.patience;
        let mut stream = connect(&self.settings.beside(ports::DASHBOARD), patience.connect).ok()?;
        stream.set_read_timeout(Some(patience.answer)).ok()?;
        stream.write_all(format!("{question}\n").as_bytes()).ok()?;
        // The first line is its greeting.
        BufReader::new(stream.take(4096)).lines().nth(1)?.ok()
    }
}

fn is_of_connection(error: &UrError) -> bool {
    !matches!(
        error,
        UrError::NoTorques { .. }
            | UrError::Rtde(ClientError::InUse { .. } | ClientError::Unknown { .. } | ClientError::Version)
    )
}
