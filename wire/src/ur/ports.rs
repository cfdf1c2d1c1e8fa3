//! Ports of the controller.

/// Primary interface: takes programs, sends the robot's state.
pub const PRIMARY: u16 = 30001;
/// Secondary interface: the same, without messages of the controller's own.
pub const SECONDARY: u16 = 30002;
/// Real-time interface: takes programs.
pub const REALTIME: u16 = 30003;
/// Real-time data exchange.
pub const RTDE: u16 = 30004;
/// Dashboard: commands in lines of text.
pub const DASHBOARD: u16 = 29999;

/// The port that lies as far from RTDE's as this one does on a controller.
pub fn beside(rtde: u16, usual: u16) -> u16 {
    rtde.saturating_sub(RTDE - usual)
}
