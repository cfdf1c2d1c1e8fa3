//! The program `calibench`: one file per verb, and the server of the workbench.

pub mod verbs;
pub mod workbench;
