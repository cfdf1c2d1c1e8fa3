//! Settings that differ between KUKA robots: names, numbers and timeouts. All are configuration, none is built into the driver.

use serde::Deserialize;

use crate::cell::patience::Patience;

/// Names of the variables that the driver reads and writes.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Variables {
    /// Joint angles at rest as read by the resolvers: `$AXIS_ACT_MEAS`. A controller without this variable reports the
    /// commanded ones, `$AXIS_ACT`, and the residual servo error is then attributed to the robot.
    pub joints: String,
    /// Commanded joint angles, if `joints` are those read back; empty if the two are not distinguished.
    pub commanded: String,
    /// Position of the tool in the base.
    pub position: String,
    /// The tool's frame in the flange.
    pub tool: String,
    /// The base's frame.
    pub base: String,
    /// Speed override, %.
    pub speed: String,
    /// Operating mode.
    pub mode: String,
    /// State of the robot program.
    pub program: String,
    /// True while the emergency stop is pressed; empty if no variable reports it.
    pub emergency_stop: String,
    /// The action requested of the robot-side program; 0 when it is done.
    pub action: String,
    /// Target of a motion by joints.
    pub joint_target: String,
    /// Target of a linear motion.
    pub line_target: String,
    /// A frame to be set.
    pub frame: String,
    /// Number of the order given; only used by the program of this library, as `done`, `result` and `cancel`.
    pub order: String,
    /// Number of the last order carried out.
    pub done: String,
    /// Outcome of that order; 0 if it was carried out.
    pub result: String,
    /// TRUE interrupts the motion under way.
    pub cancel: String,
}

impl Default for Variables {
    fn default() -> Self {
        let name = String::from;
        Variables {
            joints: name("$AXIS_ACT_MEAS"),
            commanded: name("$AXIS_ACT"),
            position: name("$POS_ACT"),
            tool: name("$TOOL"),
            base: name("$BASE"),
            speed: name("$OV_PRO"),
            mode: name("$MODE_OP"),
            program: name("$PRO_STATE1"),
            emergency_stop: name("$ALARM_STOP"),
            action: name("COM_ACTION"),
            joint_target: name("COM_E6AXIS"),
            line_target: name("COM_E6POS"),
            frame: name("COM_FRAME"),
            order: name("COM_ORDER"),
            done: name("COM_DONE"),
            result: name("COM_RESULT"),
            cancel: name("COM_CANCEL"),
        }
    }
}

impl Variables {
    /// The variables that must be named for this program, with their keys.
    pub fn needed(&self, program: RobotProgram) -> impl Iterator<Item = (&'static str, &str)> {
        let always = [
            ("joints", &self.joints),
            ("position", &self.position),
            ("tool", &self.tool),
            ("base", &self.base),
            ("speed", &self.speed),
            ("mode", &self.mode),
            ("program", &self.program),
            ("action", &self.action),
            ("joint_target", &self.joint_target),
            ("line_target", &self.line_target),
            ("frame", &self.frame),
        ];
        let ours = [("order", &self.order), ("done", &self.done), ("result", &self.result), ("cancel", &self.cancel)];
        let ours = ours.into_iter().filter(move |_| program == RobotProgram::Calibench);
        always.into_iter().chain(ours).map(|(key, name)| (key, name.as_str()))
    }
}

/// Numbers of the actions of the robot-side program.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Actions {
    /// PTP to the joint target.
    pub joints: i64,
    /// LIN to the line target.
    pub line: i64,
    /// Tool frame from the frame variable.
    pub tool: i64,
    /// Base frame from the frame variable.
    pub base: i64,
}

impl Default for Actions {
    /// Numbers of the programs in use; the last is that of this library.
    fn default() -> Self {
        Actions { joints: 2, line: 3, tool: 5, base: 14 }
    }
}

/// Values that allow the robot to move.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub struct Fitness {
    /// Operating modes, without `#`.
    pub modes: Vec<String>,
    /// States of the program, without `#`.
    pub running: Vec<String>,
    /// Value of the emergency-stop variable when pressed; `$ALARM_STOP` is an output that falls.
    pub pressed: bool,
}

impl Default for Fitness {
    fn default() -> Self {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        Fitness { modes: names(&["T1", "AUT", "EX"]), running: names(&["P_ACTIVE"]), pressed: false }
    }
}

/// Program that runs on the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema, serde::Serialize))]
#[serde(rename_all = "kebab-case")]
pub enum RobotProgram {
    /// The program of this library: it numbers orders, acknowledges them, reports why it refuses, and can be interrupted.
    #[default]
    Calibench,
    /// Any loop that carries out an action and then sets it to zero.
    Plain,
}

/// A KUKA robot and its communication settings.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KukaSettings {
    /// `HOST:PORT` of the variable server, usually port 7000.
    pub address: String,
    /// Number of joints of the arm, at most six.
    pub joints: usize,
    /// Program that runs on the controller.
    pub program: RobotProgram,
    /// Names of the variables.
    pub variables: Variables,
    /// Numbers of the actions.
    pub actions: Actions,
    /// Conditions for a motion.
    pub fitness: Fitness,
    /// Timeouts.
    pub patience: Patience,
}
