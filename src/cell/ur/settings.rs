//! The settings of a Universal Robot.

use calibench_wire::ur::ports;

use crate::cell::patience::Patience;
use crate::units::DEG;

/// A Universal Robot and its communication settings.
#[derive(Debug, Clone, PartialEq)]
pub struct UrSettings {
    /// `HOST:PORT` of RTDE. The other ports of the controller have the usual distances from it.
    pub address: String,
    /// Payload that the controller is told; `None` leaves it as it is.
    pub payload: Option<UrPayload>,
    /// Where the moments of the joints come from; `None` if they are not asked for.
    pub torques: Option<UrTorques>,
    /// Speeds at a speed override of 100 %.
    pub motion: UrMotion,
    /// Timeouts.
    pub patience: Patience,
}

/// A payload as the controller needs it to tell gravity from a collision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UrPayload {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the flange, m.
    pub com: [f64; 3],
}

/// What tells the moments of the joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UrTorques {
    /// The controller, which converts the currents itself (software 5.23 or 10.11 on).
    Converted,
    /// The currents, and the torque that a joint's drive exerts per ampere, N·m/A.
    PerAmpere([f64; 6]),
}

impl UrTorques {
    /// The variable of RTDE that is read.
    pub(super) fn variable(self) -> &'static str {
        match self {
            UrTorques::Converted => "actual_current_as_torque",
            UrTorques::PerAmpere(_) => "actual_current",
        }
    }

    /// The moments of the load, N·m, with these values of the variable: the drives hold against them.
    pub(super) fn load(self, values: [f64; 6]) -> Vec<f64> {
        match self {
            UrTorques::Converted => values.iter().map(|torque| -torque).collect(),
            UrTorques::PerAmpere(factors) => values.iter().zip(factors).map(|(current, factor)| -factor * current).collect(),
        }
    }
}

/// Speeds and accelerations at a speed override of 100 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UrMotion {
    /// Speed of the fastest joint, rad/s.
    pub joint_speed: f64,
    /// Its acceleration, rad/s².
    pub joint_acceleration: f64,
    /// Speed of the tool in a straight line, m/s.
    pub line_speed: f64,
    /// Its acceleration, m/s².
    pub line_acceleration: f64,
}

impl Default for UrMotion {
    /// The speeds of the controller's own templates.
    fn default() -> Self {
        UrMotion { joint_speed: 60.0 * DEG, joint_acceleration: 80.0 * DEG, line_speed: 0.25, line_acceleration: 1.2 }
    }
}

impl UrSettings {
    /// The address of another of the controller's ports: as far from RTDE's as on a controller with the usual ports.
    pub(super) fn beside(&self, usual: u16) -> String {
        let (host, port) = self.address.rsplit_once(':').unwrap_or((&self.address, ""));
        let port = port.parse().unwrap_or(ports::RTDE);
        format!("{host}:{}", ports::beside(port, usual))
    }
}
