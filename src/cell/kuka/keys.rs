//! The keys of `[robot]` with `kind = "kuka"`.

use serde::Deserialize;

use super::{Actions, Fitness, KukaSettings, RobotProgram, Variables};
use crate::cell::patience::PatienceKeys;
use crate::cell::robot_settings::{FlangeKeys, RobotKeys, slow};
use crate::cell::{CellReading, RobotKind, RobotSettings};
use crate::files::FileError;

/// A KUKA robot behind a variable server.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct KukaKeys {
    /// The kind of controller; the other keys are those of this kind.
    #[serde(default, rename = "kind")]
    #[cfg_attr(feature = "schema", schemars(extend("const" = "kuka")))]
    _kind: RobotKind,
    /// `HOST:PORT` of the variable server, usually port 7000.
    address: String,
    /// The program that runs on the controller.
    #[serde(default)]
    program: RobotProgram,
    /// Speed override during the measurement, %.
    #[serde(default = "slow")]
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 100)))]
    speed_percent: u8,
    /// The controller's flange in the last frame of the robot's model. For `kr6_r700` set `b_deg = 180`: the z axis of its
    /// last frame points back into the wrist.
    #[serde(default)]
    flange: FlangeKeys,
    /// Names of the variables of the controller.
    #[serde(default)]
    variables: Variables,
    /// Numbers of the actions of the program.
    #[serde(default)]
    actions: Actions,
    /// Conditions for a motion.
    #[serde(default)]
    fitness: Fitness,
    /// Timeouts and intervals.
    #[serde(default)]
    patience: PatienceKeys,
}

/// Number of joints that a KUKA controller moves in one group.
const MOST_JOINTS: usize = 6;

impl RobotKeys for KukaKeys {
    fn speed_percent(&self) -> u8 {
        self.speed_percent
    }

    fn flange(&self) -> &FlangeKeys {
        &self.flange
    }

    fn settings(&self, reading: &CellReading<'_>, joints: usize) -> Result<RobotSettings, FileError> {
        if joints > MOST_JOINTS {
            let problem = format!("its robot has {joints} joints");
            let remedy = "a KUKA controller moves six; give the model of such an arm";
            return Err(reading.wrong("dataset", problem, remedy));
        }
        reading.address("robot.address", &self.address)?;
        for (key, name) in self.variables.needed(self.program) {
            if name.is_empty() || name.chars().any(|c| c.is_whitespace() || c.is_control()) {
                let problem = format!("{name:?} is not the name of a variable");
                return Err(reading.wrong(&format!("robot.variables.{key}"), problem, "name one of the controller's"));
            }
        }
        Ok(RobotSettings::Kuka(Box::new(KukaSettings {
            address: self.address.clone(),
            joints,
            program: self.program,
            variables: self.variables.clone(),
            actions: self.actions.clone(),
            fitness: self.fitness.clone(),
            patience: self.patience.patience(reading)?,
        })))
    }
}
