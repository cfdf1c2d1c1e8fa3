//! Modes and states of the controller by number and by name.

/// `robot_mode` of an arm without power.
pub const POWER_OFF: i64 = 3;
/// `robot_mode` of an arm that can move.
pub const RUNNING: i64 = 7;

/// `safety_status` of an arm that can move.
pub const NORMAL: i64 = 1;
/// `safety_status` of an arm that can move with reduced limits.
pub const REDUCED: i64 = 2;
/// `safety_status` after the controller stopped the arm.
pub const PROTECTIVE_STOP: i64 = 3;
/// `safety_status` while an emergency stop of the system is pressed.
pub const SYSTEM_EMERGENCY_STOP: i64 = 6;
/// `safety_status` while that on the pendant is pressed.
pub const ROBOT_EMERGENCY_STOP: i64 = 7;

/// `runtime_state` of a controller whose program has ended.
pub const STOPPED: i64 = 1;
/// `runtime_state` of a program that runs.
pub const PLAYING: i64 = 2;
/// `runtime_state` of a program that was interrupted and can go on.
pub const PAUSED: i64 = 4;

/// Names from the number in their first place on.
fn named(first: i64, names: &[&'static str], number: i64) -> String {
    let name = number.checked_sub(first).and_then(|k| usize::try_from(k).ok()).and_then(|k| names.get(k));
    name.map_or_else(|| format!("mode {number}"), |name| (*name).to_owned())
}

/// The name of `robot_mode`.
pub fn robot_mode(number: i64) -> String {
    let names = [
        "no controller",
        "disconnected",
        "confirm safety",
        "booting",
        "power off",
        "power on",
        "idle",
        "freedrive",
        "running",
        "updating firmware",
    ];
    named(-1, &names, number)
}

/// The name of `safety_status`.
pub fn safety_status(number: i64) -> String {
    let names = [
        "normal",
        "reduced",
        "protective stop",
        "recovery",
        "safeguard stop",
        "system emergency stop",
        "robot emergency stop",
        "safety violation",
        "safety fault",
        "joint identification",
        "undefined",
        "automatic-mode safeguard stop",
        "three-position stop",
    ];
    named(1, &names, number)
}

/// The name of `runtime_state`.
pub fn runtime_state(number: i64) -> String {
    named(0, &["stopping", "stopped", "playing", "pausing", "paused", "resuming"], number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_have_the_names_of_the_manual() {
        assert_eq!(robot_mode(7), "running");
        assert_eq!(robot_mode(-1), "no controller");
        assert_eq!(robot_mode(i64::MIN), format!("mode {}", i64::MIN));
        assert_eq!(safety_status(3), "protective stop");
        assert_eq!(safety_status(7), "robot emergency stop");
        assert_eq!(runtime_state(2), "playing");
        assert_eq!(runtime_state(9), "mode 9");
    }
}
