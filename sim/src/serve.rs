//! The served cell: the simulated one behind the wires of a real one, so that any program can work with it.
//!
//! Three indicators answer requests in ASCII on pseudo-terminals or sockets, and a robot answers as KUKA's variable servers do, all on the
//! loopback address. One thread holds the whole cell: between two requests it stands still, and no lock is needed.

mod controller;
mod fault;
mod floor;
mod instrument;
mod line;
mod manner;
mod program;
#[cfg(unix)]
mod pty;
mod robot;
mod traffic;
mod variables;

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
pub use program::Loop;
pub use robot::{RobotManner, VariableServer};

use controller::Controller;
use floor::Floor;
use line::Wire;

use crate::interruption::interrupted;
use crate::plant::PlantError;
use crate::random::Streams;
use crate::scenario::Scenario;

/// How a cell is served.
#[derive(Debug, Clone, PartialEq)]
pub struct Service {
    /// Port of the robot on the loopback address; 0 for any.
    pub robot_port: u16,
    /// First of the indicators' three ports on the loopback address, 0 for any three; `None` for pseudo-terminals.
    pub indicator_port: Option<u16>,
    /// Seconds of the cell in one of ours; 0 where nothing takes time.
    pub time_scale: f64,
    /// How the indicators answer.
    pub indicators: Manner,
    /// How the robot answers.
    pub robot: RobotManner,
    /// What runs on the controller.
    pub program: Loop,
    /// The operating mode, without `#`.
    pub mode: String,
    /// What goes wrong.
    pub faults: Vec<Injection>,
    /// Where the arm stands in the beginning, rad; at zero where that is not said.
    pub stands: Option<Vec<f64>>,
    /// Whether the attendant takes commands from standard input.
    pub takes_commands: bool,
}

/// Where the devices of a served cell are.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Addresses {
    /// Path or `HOST:PORT` of each indicator.
    pub indicators: [String; 3],
    /// `HOST:PORT` of the robot.
    pub robot: String,
}

/// Why a cell is not served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The plant cannot play it.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A socket, a pseudo-terminal or a signal is not to be had.
    #[error("{what}")]
    System {
        /// What was wanted.
        what: String,
        /// Why not.
        #[source]
        error: io::Error,
    },
}

fn system(what: impl Into<String>) -> impl FnOnce(io::Error) -> ServeError {
    let what = what.into();
    |error| ServeError::System { what, error }
}

/// Serves the cell of a scenario until it is interrupted; `announce` is told the addresses once they can be used. What went over the wires.
///
/// # Errors
/// When the plant cannot play the scenario, or the system does not give what is needed.
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

        let cell = scenario.dataset();
        let controller =
            Rc::new(Controller::new(Rc::clone(&floor), (*cell.robot).clone(), &cell.tool, cell.gravity, &service.mode));
        let listener = bind(service.robot_port).await?;
        let robot = address(&listener)?;
        let mut indicators = Vec::with_capacity(3);
        for axis in 0..3 {
            indicators.push(connect(&floor, axis, service).await?);
        }
        spawn_local(program::run(Rc::clone(&controller), service.program));
        spawn_local(robot::listen(listener, controller, service.robot));
        let attendant = Rc::clone(&floor);
        spawn_local(async move { attendant.attend().await });
        if service.takes_commands {
            spawn_local(follow_commands(Rc::clone(&floor)));
        }
        let interrupted = interrupted().map_err(system("signals"))?;
        let [x, y, z] = <[String; 3]>::try_from(indicators).unwrap_or_default();
        announce(&Addresses { indicators: [x, y, z], robot }).map_err(system("standard output"))?;
        interrupted.await;
        Ok(floor.traffic.to_string())
    })
}

/// Does what is written on standard input, line by line; the answer on standard output when it is done.
async fn follow_commands(floor: Rc<Floor>) {
    let (sender, mut commands) = unbounded_channel();
    // Nothing wakes a thread that waits for standard input; it ends with the program.
    std::thread::spawn(move || io::stdin().lock().lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));
    while let Some(command) = commands.recv().await {
        let answer = floor.tell_attendant(&command);
        let mut out = io::stdout().lock();
        // Whoever does not read the answer misses nothing.
        drop(writeln!(out, "{answer}").and_then(|()| out.flush()));
    }
}

async fn bind(port: u16) -> Result<TcpListener, ServeError> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port)).await.map_err(system(format!("port {port} of the loopback address")))
}

fn address(listener: &TcpListener) -> Result<String, ServeError> {
    Ok(listener.local_addr().map_err(system("an address"))?.to_string())
}

/// Connects an indicator to its wire, or to its socket; where that is.
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
                        // Whatever ends a connection ends it alone.
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
        // The whole of it, and not its one field that is used: what it keeps open is of use by being open.
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
