//! What robot controllers say and hear on the wire. No package knows the arm behind it, or the procedure that moves it.

pub mod kuka;
pub mod ur;

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
