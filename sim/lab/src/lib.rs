//! Experiments: repeated runs of the procedure on the simulated cell, and tests of the advice on measured data.

pub mod adaptive;
pub mod bench;
pub mod checks;
pub mod design;
pub mod gallery;
pub mod injection;
pub mod injections_text;
pub mod precision;
pub mod prove;
pub mod study;
pub mod suite;

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
