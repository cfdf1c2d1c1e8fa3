//! The program `calibench`: one file per verb, and the workbench.

pub mod case;
mod proposal_files;
pub mod step;
pub mod verbs;
pub mod workbench;
