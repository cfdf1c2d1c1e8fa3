//! The program `calibench`: one file per verb, and the server of the workbench.

mod arguments;
mod tables;
mod terminal;
pub mod verbs;
pub mod workbench;
