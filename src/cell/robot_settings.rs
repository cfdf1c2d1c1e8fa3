//! `[robot]` of a cell file: the kind of controller and its settings.

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::kuka::{KukaRobot, KukaSettings};
use super::ur::{UrRobot, UrSettings};
use super::{CellReading, Driver, DriverError, StopRequest};
use crate::files::FileError;
use crate::robot::FramePose;
use crate::units::{DEG, MM};

/// The settings of a robot's controller, by `kind`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum RobotSettings {
    /// `kind = "kuka"`: a KUKA robot behind a variable server.
    Kuka(Box<KukaSettings>),
    /// `kind = "ur"`: a Universal Robot behind RTDE.
    Ur(Box<UrSettings>),
}

impl RobotSettings {
    /// Connects to the controller. Nothing is written and nothing moves.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn connect(&self, stop: StopRequest) -> Result<Box<dyn Driver>, DriverError> {
        match self {
            RobotSettings::Kuka(settings) => {
                Ok(Box::new(KukaRobot::connect((**settings).clone(), stop).map_err(DriverError::new)?))
            }
            RobotSettings::Ur(settings) => {
                Ok(Box::new(UrRobot::connect((**settings).clone(), stop).map_err(DriverError::new)?))
            }
        }
    }

    /// Address of the controller.
    pub fn address(&self) -> &str {
        match self {
            RobotSettings::Kuka(settings) => &settings.address,
            RobotSettings::Ur(settings) => &settings.address,
        }
    }
}

/// The kinds of robots that a cell file can name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "kebab-case")]
pub enum RobotKind {
    /// A KUKA robot behind a variable server.
    #[default]
    Kuka,
    /// A Universal Robot behind RTDE.
    Ur,
}

/// The keys of `[robot]` for one kind: those common to all kinds, and their conversion to settings.
pub(crate) trait RobotKeys: DeserializeOwned {
    /// Value of `speed_percent`.
    fn speed_percent(&self) -> u8;
    /// Value of `flange`.
    fn flange(&self) -> &FlangeKeys;
    /// Converts the keys to settings of the controller for an arm with this number of joints.
    ///
    /// # Errors
    /// When a value is invalid.
    fn settings(&self, reading: &CellReading<'_>, joints: usize) -> Result<RobotSettings, FileError>;
}

/// Default speed override, %: slow enough for a person to follow with a hand on the stop.
pub(crate) fn slow() -> u8 {
    10
}

/// `flange`: the controller's flange in the last frame of the robot's model.
#[derive(Deserialize, Default)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct FlangeKeys {
    /// Position along x, mm.
    x_mm: f64,
    /// Position along y, mm.
    y_mm: f64,
    /// Position along z, mm.
    z_mm: f64,
    /// Rotation about z, deg.
    a_deg: f64,
    /// Then about the rotated y, deg.
    b_deg: f64,
    /// Then about the rotated x, deg.
    c_deg: f64,
}

impl FlangeKeys {
    /// Converts to SI.
    pub(crate) fn frame(&self) -> FramePose {
        FramePose {
            xyz: [self.x_mm * MM, self.y_mm * MM, self.z_mm * MM],
            rz_ry_rx: [self.a_deg * DEG, self.b_deg * DEG, self.c_deg * DEG],
        }
    }
}
