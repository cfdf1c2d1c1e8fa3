//! The served cell: the simulated cell behind the interfaces of a real one, so that any program can work with it.
//!
//! Three indicators answer ASCII requests on pseudo-terminals or sockets, and a robot answers as KUKA's variable servers or as
//! Universal Robots' controllers do, all on the loopback address. One thread owns the whole cell: between two requests nothing
//! changes, and no lock is needed.

mod arm;
mod fault;
mod floor;
mod instrument;
pub mod interruption;
mod kuka;
mod line;
mod manner;
#[cfg(unix)]
mod pty;
pub mod script;
mod service;
mod tracker;
mod traffic;
mod ur;

use std::cell::RefCell;
use std::io::{self, BufRead, Write};
use std::net::Ipv4Addr;
use std::rc::Rc;

use serde::Serialize;
use tokio::net::TcpListener;
use tokio::runtime;
use tokio::sync::mpsc::unbounded_channel;
use tokio::task::{LocalSet, spawn_local};

pub use fault::{Fault, Injection, InjectionError, When};
pub use instrument::Instrument;
pub use manner::{Maker, Manner};
pub use service::{Loop, Make, RobotManner, Service, VariableServer};

use floor::Floor;
use line::Wire;
use tracker::Tracker;

use calibench_sim::mechanics::PlantError;
use calibench_sim::random::Streams;
use calibench_sim::scenario::Scenario;
use interruption::interrupted;

/// Addresses of the devices of a served cell.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Addresses {
    /// Path or `HOST:PORT` of each indicator.
    pub indicators: [String; 3],
    /// `HOST:PORT` of the robot.
    pub robot: String,
    /// `HOST:PORT` of the tracker, if one is served.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracker: Option<String>,
}

/// Reasons why a cell cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The plant cannot simulate it.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A socket, a pseudo-terminal or a signal is not available.
    #[error("{what}")]
    System {
        /// The requested resource.
        what: String,
        /// The reason.
        #[source]
        error: io::Error,
    },
}

fn system(what: impl Into<String>) -> impl FnOnce(io::Error) -> ServeError {
    let what = what.into();
    |error| ServeError::System { what, error }
}

/// Serves the cell of a scenario until it is interrupted; `announce` receives the addresses once they can be used. Returns a
/// summary of the traffic on the wires.
///
/// # Errors
/// When the plant cannot simulate the scenario, or the system does not provide a needed resource.
pub fn serve(
    scenario: &Scenario,
    streams: Streams,
    session_s: f64,
    service: &Service,
    announce: impl FnOnce(&Addresses) -> io::Result<()>,
) -> Result<String, ServeError> {
    let runtime = runtime::Builder::new_current_thread().enable_all().build().map_err(system("a reactor"))?;
    LocalSet::new().block_on(&runtime, async {
        let floor = Rc::new(Floor::new(scenario, streams, session_s, service)?);

        let (robot, attended) = robot(&floor, scenario, service).await?;
        let mut indicators = Vec::with_capacity(3);
        for axis in 0..3 {
            indicators.push(connect(&floor, axis, service).await?);
        }
        let tracker = match service.tracker_port {
            None => None,
            Some(port) => {
                let listener = bind(port).await?;
                let at = address(&listener)?;
                let tracker = Tracker::new(Rc::clone(&floor), scenario, streams.stream("served tracker"));
                spawn_local(Rc::new(tracker).listen(listener));
                Some(at)
            }
        };
        let attendant = Rc::clone(&floor);
        spawn_local(async move { attendant.attend().await });
        if service.takes_commands {
            spawn_local(follow_commands(Rc::clone(&floor), attended));
        }
        let interrupted = interrupted().map_err(system("signals"))?;
        let [x, y, z] = <[String; 3]>::try_from(indicators).unwrap_or_default();
        announce(&Addresses { indicators: [x, y, z], robot, tracker }).map_err(system("standard output"))?;
        interrupted.await;
        Ok(floor.traffic.to_string())
    })
}

/// What an operator does after a stop; false if nothing is stopped.
type Restart = Box<dyn Fn() -> bool>;

/// Puts the robot behind its interface; returns its address, and what starts it again after a stop.
async fn robot(floor: &Rc<Floor>, scenario: &Scenario, service: &Service) -> Result<(String, Restart), ServeError> {
    let cell = scenario.dataset();
    let (floor, robot) = (Rc::clone(floor), (*cell.robot).clone());
    match service.make {
        Make::Kuka => {
            let mode = service.mode.as_deref().unwrap_or("AUT");
            let controller = Rc::new(kuka::Controller::new(floor, robot, &cell.tool, cell.gravity, mode));
            let listener = bind(service.robot_port).await?;
            let at = address(&listener)?;
            spawn_local(kuka::run(Rc::clone(&controller), service.program));
            spawn_local(kuka::listen(listener, Rc::clone(&controller), service.robot));
            Ok((at, Box::new(move || controller.restart())))
        }
        Make::Ur => {
            let is_remote = service.mode.as_deref() != Some("LOCAL");
            let controller = Rc::new(ur::Controller::new(floor, robot, is_remote));
            let ports =
                ur::Ports::bind(service.robot_port).await.map_err(system("ports for the robot on the loopback address"))?;
            let at = ports.address().map_err(system("an address"))?;
            ports.listen(&controller);
            Ok((at, Box::new(move || controller.restart())))
        }
    }
}

/// Carries out commands from standard input, line by line; each answer is written to standard output when the command is done.
async fn follow_commands(floor: Rc<Floor>, restart: Restart) {
    let (sender, mut commands) = unbounded_channel();
    // A thread that waits for standard input cannot be woken; it ends with the program.
    std::thread::spawn(move || io::stdin().lock().lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    while let Some(command) = commands.recv().await {
        let answer = match command.trim() {
            "reset" if restart() => "ok",
            "reset" => "nothing is stopped",
            _ => floor.tell_attendant(&command),
        };
        let mut out = io::stdout().lock();
        // Losing the answer does no harm.
        drop(writeln!(out, "{answer}").and_then(|()| out.flush()));
    }
}

async fn bind(port: u16) -> Result<TcpListener, ServeError> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await.map_err(system(format!("port {port} of the loopback address")))
}

fn address(listener: &TcpListener) -> Result<String, ServeError> {
    Ok(listener.local_addr().map_err(system("an address"))?.to_string())
}

/// Connects an indicator to its pseudo-terminal or its socket; returns its address.
async fn connect(floor: &Rc<Floor>, axis: usize, service: &Service) -> Result<String, ServeError> {
    let instrument = Rc::new(RefCell::new(Instrument::new(format!("SIM{}", axis + 1), service.indicators)));
    let floor = Rc::clone(floor);
    match service.indicator_port {
        Some(first) => {
            let offset = if first == 0 { 0 } else { axis as u16 };
            let listener = bind(first.saturating_add(offset)).await?;
            let address = address(&listener)?;
            spawn_local(async move {
                while let Ok((mut stream, _)) = listener.accept().await {
                    let (floor, instrument) = (Rc::clone(&floor), Rc::clone(&instrument));
                    spawn_local(async move {
                        let wire = Wire { floor: &floor, axis, instrument: &instrument };
                        // An error ends this connection only.
                        drop(wire.converse(&mut stream).await);
                    });
                }
            });
            Ok(address)
        }
        None => pseudo_terminal(floor, axis, instrument),
    }
}

#[cfg(unix)]
fn pseudo_terminal(floor: Rc<Floor>, axis: usize, instrument: Rc<RefCell<Instrument>>) -> Result<String, ServeError> {
    let pty = pty::Pty::open().map_err(system("a pseudo-terminal"))?;
    let path = pty.path().display().to_string();
    spawn_local(async move {
        // Moves the whole value into the task, not only the one field used here: its other fields must stay open.
        let mut pty = pty;
        let wire = Wire { floor: &floor, axis, instrument: &instrument };
        // Its client's end is kept open, so it ends with the program.
        drop(wire.converse(&mut pty.instrument).await);
    });
    Ok(path)
}

#[cfg(not(unix))]
fn pseudo_terminal(_: Rc<Floor>, _: usize, _: Rc<RefCell<Instrument>>) -> Result<String, ServeError> {
    let error = io::Error::new(io::ErrorKind::Unsupported, "this system has none; give --indicator-port 0");
    Err(ServeError::System { what: "a pseudo-terminal".into(), error })
}

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
