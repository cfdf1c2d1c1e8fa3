//! A live page of a program on the loopback address, closed to strangers.
//!
//! A [`Site`] has a page, views that are asked for and actions that are asked to be done; a [`Server`] answers for it. The page is
//! requested with the token in its address, everything else with the token in a header.

mod connections;
mod gate;
mod server;

pub use connections::HEADER_PATIENCE;
pub use server::{Answer, Refusal, Server, Site};

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
