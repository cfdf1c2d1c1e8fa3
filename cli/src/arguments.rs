//! Arguments that several verbs share, and the data that they name.

pub mod choices;
pub mod choosing;
pub mod data;
pub mod data_gate;
pub mod logs;
pub mod quantities;
pub mod scenario;
