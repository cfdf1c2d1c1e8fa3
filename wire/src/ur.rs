//! Universal Robots: real-time data exchange (RTDE, protocol 2), the tool in the state message of the secondary interface, and
//! the program that moves the arm.
//!
//! Source: the manufacturer's published pages on RTDE and on the client interfaces.

mod client;
mod data;
pub mod modes;
mod package;
pub mod ports;
mod program;
mod state_message;
mod variables;

pub use client::{Client, ClientError, Recipes, Seen};
pub use data::{DataType, Datum};
pub use package::{LONGEST_PACKAGE, Package, PackageError, PackageKind, PackageReader};
pub use program::{Action, Outcome, PROGRAM, PROGRAM_TOKEN, registers};
pub use state_message::{CartesianInfo, StateMessageReader};
pub use variables::{input_type, output_type};
