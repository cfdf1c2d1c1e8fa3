//! Monitoring of a calibrated robot: whether a calibration still holds ([`check`]), its
//! [`history`], and what many runs of one robot have in common ([`runs`]).

pub mod check;
pub mod history;
pub mod runs;
