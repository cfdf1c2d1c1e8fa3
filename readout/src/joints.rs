//! Joint readings of a robot's controller, read only.

mod abb;
mod fanuc;
mod kuka;
mod text;
mod ur;
mod web;

pub use abb::{AbbSettings, joints_of_answer};
pub use fanuc::{FanucSettings, joints_of_page};
pub use text::TextSettings;
pub use web::LogIn;

use calibench::units::{DEG, MM};
use serde::{Deserialize, Serialize};

use crate::ReadoutError;
use abb::AbbService;
use fanuc::FanucPage;
use kuka::KukaVariables;
use text::TextJoints;
use ur::UrExchange;

/// Unit of a joint's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum JointUnit {
    /// Degrees.
    Deg,
    /// Radians.
    Rad,
    /// Millimetres, of a sliding joint.
    Mm,
    /// Metres, of a sliding joint.
    M,
}

impl JointUnit {
    /// One of it in SI: rad or m.
    pub fn si(self) -> f64 {
        match self {
            JointUnit::Deg => DEG,
            JointUnit::Mm => MM,
            JointUnit::Rad | JointUnit::M => 1.0,
        }
    }

    /// A value in SI as people read it: deg, or mm of a sliding joint.
    pub fn outside(self, si: f64) -> f64 {
        if self.is_length() { si / MM } else { si.to_degrees() }
    }

    /// The name of the unit that people read.
    pub fn outside_name(self) -> &'static str {
        if self.is_length() { "mm" } else { "deg" }
    }

    /// True for the units of a sliding joint.
    pub fn is_length(self) -> bool {
        matches!(self, JointUnit::Mm | JointUnit::M)
    }
}

/// Where joint readings come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Controller {
    /// The page of current positions that a FANUC controller serves.
    Fanuc(FanucSettings),
    /// Robot Web Services of an ABB controller.
    Abb(AbbSettings),
    /// A variable server on a KUKA controller, at `HOST:PORT`.
    Kuka(String),
    /// Real-time data exchange of a Universal Robot, at `HOST:PORT`.
    Ur(String),
    /// Lines of text.
    Text(TextSettings),
    /// Nobody but the operator, who types this many numbers a posture.
    Typed(usize),
}

impl Controller {
    /// Unit of its readings where nothing else is said.
    pub fn unit(&self) -> JointUnit {
        match self {
            Controller::Ur(_) => JointUnit::Rad,
            _ => JointUnit::Deg,
        }
    }

    /// What whoever measures has to know about its readings, if anything.
    pub fn remark(&self) -> Option<&'static str> {
        matches!(self, Controller::Fanuc(_)).then_some(
            "A FANUC's page has two decimals: 0.003 deg rms of rounding in each joint, 0.05 mm at a metre. Joint 3 is written as joint 3 plus joint 2 of the pendant.",
        )
    }

    /// Connects, read only; `None` if the operator types.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn open(&self) -> Result<Option<Box<dyn JointReader>>, ReadoutError> {
        Ok(Some(match self {
            Controller::Fanuc(settings) => Box::new(FanucPage::new(settings)),
            Controller::Abb(settings) => Box::new(AbbService::new(settings)),
            Controller::Kuka(address) => Box::new(KukaVariables::open(address)?),
            Controller::Ur(address) => Box::new(UrExchange::open(address)?),
            Controller::Text(settings) => Box::new(TextJoints::open(settings)?),
            Controller::Typed(_) => return Ok(None),
        }))
    }
}

/// A source of joint readings. Reading changes nothing.
pub trait JointReader {
    /// The joints now, in the unit of the source.
    ///
    /// # Errors
    /// If there is no answer, or none that holds them.
    fn joints(&mut self) -> Result<Vec<f64>, ReadoutError>;
}
