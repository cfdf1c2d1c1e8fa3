//! The keys of `[robot]` with `kind = "kuka"`.

use serde::Deserialize;

use super::{Actions, Fitness, KukaSettings, Patience, RobotProgram, Variables};
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

/// Timeouts and intervals.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
struct PatienceKeys {
    /// Timeout of connecting, s.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    connect_s: f64,
    /// Timeout of one answer, s.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    answer_s: f64,
    /// Timeout of one motion, s.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    motion_s: f64,
    /// Interval between two checks of a motion, ms.
    poll_ms: f64,
    /// Wait after a motion, for the arm to stop oscillating, s.
    settle_s: f64,
    /// Attempts to re-establish a lost connection.
    reconnects: usize,
}

impl Default for PatienceKeys {
    fn default() -> Self {
        let Patience { connect, answer, motion, poll, settle, reconnects } = Patience::default();
        PatienceKeys {
            connect_s: connect.as_secs_f64(),
            answer_s: answer.as_secs_f64(),
            motion_s: motion.as_secs_f64(),
            poll_ms: 1e3 * poll.as_secs_f64(),
            settle_s: settle.as_secs_f64(),
            reconnects,
        }
    }
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
        Ok(RobotSettings::Kuka(KukaSettings {
            address: self.address.clone(),
            joints,
            program: self.program,
            variables: self.variables.clone(),
            actions: self.actions.clone(),
            fitness: self.fitness.clone(),
            patience: self.patience(reading)?,
        }))
    }
}

impl KukaKeys {
    fn patience(&self, reading: &CellReading<'_>) -> Result<Patience, FileError> {
        let p = &self.patience;
        // Zero seconds would never be enough for these three.
        let positive = |key: &str, value: f64| reading.time(key, reading.positive(key, value)?, 1.0);
        Ok(Patience {
            connect: positive("robot.patience.connect_s", p.connect_s)?,
            answer: positive("robot.patience.answer_s", p.answer_s)?,
            motion: positive("robot.patience.motion_s", p.motion_s)?,
            poll: reading.time("robot.patience.poll_ms", p.poll_ms, 1e-3)?,
            settle: reading.time("robot.patience.settle_s", p.settle_s, 1.0)?,
            reconnects: p.reconnects,
        })
    }
}
