//! The conditions at a target, as far as the identified effects depend on them.

/// Conditions of a target beside its pose; unknown ones are at their midpoint, or as at the end of the session.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conditions {
    /// Seconds since the session began; by default the state at its end: warm, and after every step.
    pub time_s: Option<f64>,
    /// Temperature of the robot, °C; by default the reference temperature of lengths, 20 °C.
    pub temp_c: Option<f64>,
    /// Sign of each joint's last motion (N); by default midway between both directions.
    pub approach: Option<Vec<i8>>,
}
