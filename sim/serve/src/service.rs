//! Settings of a served cell.

use super::fault::Injection;
use super::manner::Manner;

/// Settings of a served cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Service {
    /// Port of the robot on the loopback address; 0 for any.
    pub robot_port: u16,
    /// First of the indicators' three ports on the loopback address, 0 for any three; `None` for pseudo-terminals.
    pub indicator_port: Option<u16>,
    /// Port of the tracker on the loopback address, 0 for any; `None` for no tracker.
    pub tracker_port: Option<u16>,
    /// Seconds of the cell per second of wall-clock time; 0 if nothing takes time.
    pub time_scale: f64,
    /// Response format of the indicators.
    pub indicators: Manner,
    /// The make of the robot.
    pub make: Make,
    /// Behaviour of a KUKA's server.
    pub robot: RobotManner,
    /// Program running on a KUKA's controller.
    pub program: Loop,
    /// Operating mode: of a KUKA without `#`, of a Universal Robot `REMOTE` or `LOCAL`; the usual one if not given.
    pub mode: Option<String>,
    /// Faults to inject.
    pub faults: Vec<Injection>,
    /// Initial joints of the arm, rad; zero if not given.
    pub stands: Option<Vec<f64>>,
    /// True if the attendant takes commands from standard input.
    pub takes_commands: bool,
}

impl Default for Service {
    /// Any ports, pseudo-terminals, real time, no faults: as `calibench sim serve` without flags.
    fn default() -> Self {
        Service {
            robot_port: 0,
            indicator_port: None,
            tracker_port: None,
            time_scale: 1.0,
            indicators: Manner::default(),
            robot: RobotManner::default(),
            program: Loop::default(),
            make: Make::default(),
            mode: None,
            faults: Vec::new(),
            stands: None,
            takes_commands: false,
        }
    }
}

/// Makes of robots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Make {
    /// KUKA, behind a variable server.
    #[default]
    Kuka,
    /// Universal Robots, behind RTDE.
    Ur,
}

/// The variable server and its behaviour.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RobotManner {
    /// The server.
    pub server: VariableServer,
    /// Numbers have seven digits, as on older controllers, instead of nine.
    pub seven_digits: bool,
    /// A request that arrives in pieces is lost, as with the real KUKAVARPROXY.
    pub no_reassembly: bool,
}

/// Programs that give access to variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum VariableServer {
    /// KUKAVARPROXY.
    #[default]
    Kukavarproxy,
    /// C3 Bridge.
    C3,
}

/// Programs on the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Loop {
    /// The program of calibench: orders are numbered, and their results reported.
    #[default]
    Calibench,
    /// A plain one, like RoboDK's: it executes every action number it knows, and reports nothing.
    Plain,
}
