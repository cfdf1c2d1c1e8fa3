//! Variables against which the apparent angle error of a joint is plotted.

use super::SeenSample;

/// A variable of a sample on which the error of a joint may depend. Joints are counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum JointVariable {
    /// The joint's angle.
    Angle(usize),
    /// The moment of the load about the joint.
    Torque(usize),
    /// Direction from which the joint arrived.
    Approach(usize),
    /// Commanded minus reported angle of the joint.
    Lag(usize),
    /// Mass on the flange.
    Payload,
    /// Time since the session began.
    Time,
    /// Temperature of the robot.
    Temperature,
}

impl JointVariable {
    /// Variables against which a joint is plotted.
    pub fn of_joint(joint: usize) -> [JointVariable; 7] {
        use JointVariable::{Angle, Approach, Lag, Payload, Temperature, Time, Torque};
        [Angle(joint), Torque(joint), Approach(joint), Lag(joint), Payload, Time, Temperature]
    }

    /// As written in tables and files: `q1`, `tau1`, `approach1`, `qcmd1-q1`, `payload`, `time`, `temp`.
    pub fn name(self) -> String {
        match self {
            JointVariable::Angle(j) => format!("q{j}"),
            JointVariable::Torque(j) => format!("tau{j}"),
            JointVariable::Approach(j) => format!("approach{j}"),
            JointVariable::Lag(j) => format!("qcmd{j}-q{j}"),
            JointVariable::Payload => "payload".into(),
            JointVariable::Time => "time".into(),
            JointVariable::Temperature => "temp".into(),
        }
    }

    /// Its display unit, and the size of that unit in SI.
    pub fn unit(self) -> (&'static str, f64) {
        match self {
            JointVariable::Angle(_) | JointVariable::Lag(_) => ("deg", crate::units::DEG),
            JointVariable::Torque(_) => ("N·m", 1.0),
            JointVariable::Approach(_) => ("1", 1.0),
            JointVariable::Payload => ("kg", 1.0),
            JointVariable::Time => ("s", 1.0),
            JointVariable::Temperature => ("°C", 1.0),
        }
    }

    /// Its value in a sample, SI (temperature in °C); `None` if the sample does not contain it.
    pub fn of(self, sample: &SeenSample<'_>) -> Option<f64> {
        let row = sample.sample;
        match self {
            JointVariable::Angle(j) => row.q.get(j - 1).copied(),
            JointVariable::Torque(j) => sample.tau.get(j - 1).copied(),
            JointVariable::Approach(j) => row.approach.as_ref()?.get(j - 1).map(|&side| f64::from(side)),
            JointVariable::Lag(j) => Some(row.q_commanded.as_ref()?.get(j - 1)? - row.q.get(j - 1)?),
            JointVariable::Payload => Some(sample.payload),
            JointVariable::Time => row.time_s,
            JointVariable::Temperature => row.temp_c,
        }
    }
}
