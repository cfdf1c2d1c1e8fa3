//! Measuring points: somebody jogs an arm, or a plan drives it, and an instrument measures where its tool is.
//!
//! [`read_station`] reads where joints and points come from. [`ByHand`] is the procedure of somebody who jogs: nothing is written to
//! the controller, and nothing moves. [`PointCampaign`] drives a robot through the poses of a plan. [`Journal`] keeps every posture
//! from the moment it is measured.
//!
//! # Features
//!
//! * `schema`: the JSON Schema of a station file. Off by default.

mod by_hand;
mod campaign;
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
pub use campaign::{CampaignStop, CampaignWatcher, PointCampaign, dataset_of};
pub use error::ReadoutError;
pub use joints::{
    AbbSettings, Controller, FanucSettings, JointReader, JointUnit, LogIn, TextSettings, joints_of_answer, joints_of_page,
};
pub use journal::{Journal, Row};
pub use line_form::LineForm;
pub use line_link::{Arrived, End, LineLink};
pub use points::{Instrument, InstrumentSettings, MeasuredPoint};
#[cfg(feature = "schema")]
pub use station::station_schema;
pub use station::{STATION_FORMAT, Station, StillSettings, read_station};
pub use stillness::{Motion, Stillness};

/// The examples of the package's page compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
