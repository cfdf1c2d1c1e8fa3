//! Monitoring of a calibrated robot: whether a calibration still holds ([`check`]), and what many runs of one robot have in common ([`runs`]).

pub mod check;
pub mod runs;
