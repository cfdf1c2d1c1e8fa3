//! What differs from one KUKA to the next: names, numbers and patience. All of it is configuration, none of it a fact of the driver.

use std::time::Duration;

use serde::Deserialize;

/// Names of the variables that the driver reads and writes.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Variables {
    /// Joint angles at rest as the resolvers read them: `$AXIS_ACT_MEAS`. A controller that has no such variable tells those that it commands,
    /// `$AXIS_ACT`, and what the servos leave is then taken for the robot's error.
    pub joints: String,
    /// Joint angles commanded, where `joints` are those read back; empty where they are not told apart.
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
    /// Whether the emergency stop is pressed; empty where no variable says so.
    pub emergency_stop: String,
    /// The action asked of the robot-side program; 0 when it is done.
    pub action: String,
    /// Target of a motion by joints.
    pub joint_target: String,
    /// Target of a straight motion.
    pub line_target: String,
    /// A frame to be set.
    pub frame: String,
    /// Number of the order given; our own program only, as all below.
    pub order: String,
    /// Number of the last order done.
    pub done: String,
    /// How it went: see [`super::Verdict`].
    pub result: String,
    /// TRUE breaks off the motion under way.
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
    /// Those that must be named where this program runs, with their keys.
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
    /// Those of the programs in use; the last is ours.
    fn default() -> Self {
        Actions { joints: 2, line: 3, tool: 5, base: 14 }
    }
}

/// Which values mean that the robot may move.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Fitness {
    /// Operating modes, without `#`.
    pub modes: Vec<String>,
    /// States of the program, without `#`.
    pub running: Vec<String>,
    /// What the variable of the emergency stop is when it is pressed; `$ALARM_STOP` is an output that falls.
    pub pressed: bool,
}

impl Default for Fitness {
    fn default() -> Self {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        Fitness { modes: names(&["T1", "AUT", "EX"]), running: names(&["P_ACTIVE"]), pressed: false }
    }
}

/// What runs on the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RobotProgram {
    /// Ours: it numbers orders, acknowledges them, says why it refuses, and can be broken off.
    #[default]
    Calibench,
    /// Any loop that does an action and then sets it to zero.
    Plain,
}

/// How long to wait for what.
#[derive(Debug, Clone, PartialEq)]
pub struct Patience {
    /// To be connected.
    pub connect: Duration,
    /// For one answer: a variable takes some 4 ms, a busy controller a hundred times that.
    pub answer: Duration,
    /// For one motion.
    pub motion: Duration,
    /// Between two looks at a motion.
    pub poll: Duration,
    /// After a motion, for the arm to stop swinging.
    pub settle: Duration,
    /// How often a lost connection is sought again.
    pub reconnects: usize,
}

impl Default for Patience {
    fn default() -> Self {
        Patience {
            connect: Duration::from_secs(3),
            answer: Duration::from_secs(2),
            motion: Duration::from_secs(120),
            poll: Duration::from_millis(10),
            settle: Duration::from_millis(300),
            reconnects: 3,
        }
    }
}

/// A KUKA, and how to speak to it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct KukaSettings {
    /// `HOST:PORT` of the variable server, port 7000 as a rule.
    pub address: String,
    /// Joints of the arm, at most six.
    pub joints: usize,
    /// What runs on the controller.
    pub program: RobotProgram,
    /// Names.
    pub variables: Variables,
    /// Numbers.
    pub actions: Actions,
    /// When it may move.
    pub fitness: Fitness,
    /// How long to wait.
    pub patience: Patience,
}
