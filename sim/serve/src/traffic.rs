//! Traffic counters of a served cell.

use std::cell::Cell;
use std::fmt;

/// Counts of requests and bytes.
#[derive(Debug, Default)]
pub struct Traffic {
    indicators: Counts,
    robot: Counts,
    motions: Cell<u64>,
}

#[derive(Debug, Default)]
struct Counts {
    answers: Cell<u64>,
    bytes_in: Cell<u64>,
    bytes_out: Cell<u64>,
}

fn add(to: &Cell<u64>, number: usize) {
    to.set(to.get() + number as u64);
}

impl Traffic {
    /// Counts bytes received by an indicator.
    pub fn note_indicator_request(&self, bytes: usize) {
        add(&self.indicators.bytes_in, bytes);
    }

    /// Counts a piece of this many bytes sent by an indicator.
    pub fn note_indicator_answer(&self, bytes: usize) {
        add(&self.indicators.answers, 1);
        add(&self.indicators.bytes_out, bytes);
    }

    /// Counts bytes received by the robot.
    pub fn note_robot_request(&self, bytes: usize) {
        add(&self.robot.bytes_in, bytes);
    }

    /// Counts an answer of this many bytes from the robot.
    pub fn note_robot_answer(&self, bytes: usize) {
        add(&self.robot.answers, 1);
        add(&self.robot.bytes_out, bytes);
    }

    /// Counts a motion of the robot.
    pub fn note_motion(&self) {
        add(&self.motions, 1);
    }
}

impl fmt::Display for Traffic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = |counts: &Counts| (counts.answers.get(), counts.bytes_in.get(), counts.bytes_out.get());
        let ((asked, in_, out), (calls, robot_in, robot_out)) = (of(&self.indicators), of(&self.robot));
        write!(
            f,
            "indicators: {asked} answers, {in_} bytes in, {out} out; robot: {calls} answers, {robot_in} bytes in, {robot_out} out"
        )?;
        write!(f, "; {} motions", self.motions.get())
    }
}
