//! The workbench in a browser.
//!
//! The page puts the files that its user drops into memory, asks by name with a JSON body, as it would ask a server, and takes
//! the files that were written. The answers are those of [`calibench_workbench`]; what a command line does before the
//! workbench opens, importing and checking, is in [`Session`], and so is the simulated robot.

#[cfg(target_family = "wasm")]
mod called;
mod host;
mod opening;
mod play;
mod session;
mod warm_up;

pub use host::Host;
pub use opening::Opened;
pub use session::Session;
pub use warm_up::warm_up;
