//! Under which conditions a target is reached, as far as the identified effects ask.

/// What is known of a target beside its pose; what is not known is at its middle, or as it was at the end of the session.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Conditions {
    /// Seconds since the session began; without it the robot is as it was at the end: warm, and after every step.
    pub time_s: Option<f64>,
    /// Temperature of the robot, °C; without it, the reference temperature of lengths, 20 °C.
    pub temp_c: Option<f64>,
    /// Sign of each joint's last motion (N); without it, midway between both sides.
    pub approach: Option<Vec<i8>>,
}
