//! Command-line choices that map to types of the simulated cell, which is independent of the command line.

use calibench_serve::{Loop, Make, Maker, VariableServer};
use calibench_sim::run::Methods;
use calibench_sim::scenario::PlantKind;
use clap::ValueEnum;

/// Plant that simulates the mechanics.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum PlantChoice {
    /// Closed-form expressions: screws of the arm, geometry of the contact
    Analytic,
    /// MuJoCo, a physics engine that shares no code with the model
    Mujoco,
}

impl From<PlantChoice> for PlantKind {
    fn from(choice: PlantChoice) -> Self {
        match choice {
            PlantChoice::Analytic => PlantKind::Analytic,
            PlantChoice::Mujoco => PlantKind::Mujoco,
        }
    }
}

/// Methods of a study.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum MethodChoice {
    /// TriCal and tracker, on the same robots
    Both,
    /// The TriCal alone
    Trical,
    /// The tracker alone
    Tracker,
}

impl From<MethodChoice> for Methods {
    fn from(choice: MethodChoice) -> Self {
        match choice {
            MethodChoice::Both => Methods::Both,
            MethodChoice::Trical => Methods::Trical,
            MethodChoice::Tracker => Methods::Tracker,
        }
    }
}

/// Command set of the served indicators.
#[derive(Debug, Clone, Copy, Default, ValueEnum)]
pub enum MakerChoice {
    /// `+006.3500` CR, and the full command set
    #[default]
    Sylvac,
    /// The unit after the value, CR LF
    Mahr,
    /// Mitutoyo's converter: `01A+0006.350` CR for each `1`; it accepts no other commands
    Digimatic,
}

impl From<MakerChoice> for Maker {
    fn from(choice: MakerChoice) -> Self {
        match choice {
            MakerChoice::Sylvac => Maker::Sylvac,
            MakerChoice::Mahr => Maker::Mahr,
            MakerChoice::Digimatic => Maker::Digimatic,
        }
    }
}

/// Make of the served robot.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum MakeChoice {
    /// A KUKA behind a variable server
    #[default]
    Kuka,
    /// A Universal Robot behind RTDE
    Ur,
}

impl From<MakeChoice> for Make {
    fn from(choice: MakeChoice) -> Self {
        match choice {
            MakeChoice::Kuka => Make::Kuka,
            MakeChoice::Ur => Make::Ur,
        }
    }
}

/// Program that gives access to the served controller's variables.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum ServerChoice {
    /// KUKAVARPROXY
    #[default]
    Kukavarproxy,
    /// C3 Bridge
    C3,
}

impl From<ServerChoice> for VariableServer {
    fn from(choice: ServerChoice) -> Self {
        match choice {
            ServerChoice::Kukavarproxy => VariableServer::Kukavarproxy,
            ServerChoice::C3 => VariableServer::C3,
        }
    }
}

/// Program that runs on the served controller.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum LoopChoice {
    /// The program of calibench: orders are numbered, and their results reported
    #[default]
    Calibench,
    /// A plain program such as RoboDK's: it moves on every number it knows, and reports nothing
    Plain,
}

impl From<LoopChoice> for Loop {
    fn from(choice: LoopChoice) -> Self {
        match choice {
            LoopChoice::Calibench => Loop::Calibench,
            LoopChoice::Plain => Loop::Plain,
        }
    }
}

/// Parses a seed.
pub fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("give a whole number from 0 to {}", u64::MAX))
}
