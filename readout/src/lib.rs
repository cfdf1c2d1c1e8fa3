//! Measuring by hand: somebody jogs an arm, this package reads its joints from the controller and points from an instrument.
//!
//! [`read_station`] reads where they come from, [`ByHand`] is the procedure, [`Journal`] keeps every posture from the moment it is
//! measured. Nothing is written to a controller, and nothing moves.

mod by_hand;
mod error;
mod joints;
mod journal;
mod line_form;
mod line_link;
mod points;
mod station;
mod stillness;
mod typed;

pub use by_hand::{Attendant, ByHand, Ended, Typed};
pub use error::ReadoutError;
pub use joints::{
    AbbSettings, Controller, FanucSettings, JointReader, JointUnit, TextSettings, joints_of_answer, joints_of_page,
};
pub use journal::{Journal, Row};
pub use line_form::LineForm;
pub use line_link::{Arrived, End, LineLink};
pub use points::{Instrument, InstrumentSettings, MeasuredPoint};
pub use station::{STATION_FORMAT, Station, StillSettings, read_station};
pub use stillness::{Motion, Stillness};

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
