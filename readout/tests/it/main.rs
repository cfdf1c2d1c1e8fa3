//! What measuring points promises, one promise a file.
#![allow(clippy::unwrap_used)] // a test may panic: that is how it fails

mod controllers_are_read_as_they_answer;
mod instruments_are_read_as_they_send;
mod nothing_measured_by_hand_is_lost;
mod stations_are_read_or_refused;
