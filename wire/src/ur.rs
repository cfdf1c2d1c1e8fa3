//! Universal Robots: real-time data exchange (RTDE, protocol 2), the tool in the state message of the secondary interface, and
//! the program that moves the arm.
//!
//! Source: the manufacturer's published pages on RTDE and on the client interfaces.

mod client;
mod data;
mod modes;
mod package;
mod program;
mod state_message;
mod variables;

pub use client::{Client, ClientError, Deadlines, Recipes, Seen};
pub use data::{DataType, Datum};
pub use modes::{robot_mode, runtime_state, safety_status};
pub use package::{LONGEST_PACKAGE, Package, PackageError, PackageKind, PackageReader};
pub use program::{Action, Outcome, PROGRAM, PROGRAM_TOKEN, registers};
pub use state_message::{CartesianInfo, StateMessageReader};
pub use variables::{input_type, output_type};
