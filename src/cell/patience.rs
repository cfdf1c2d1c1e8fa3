//! How long the driver of a robot waits.

use std::time::{Duration, Instant};

use serde::Deserialize;

use super::{CellReading, ManipulatorError, StopRequest};
use crate::files::FileError;

/// Timeouts and intervals.
#[derive(Debug, Clone, PartialEq)]
pub struct Patience {
    /// Timeout of connecting.
    pub connect: Duration,
    /// Timeout of one answer: a variable takes some 4 ms, a busy controller a hundred times that.
    pub answer: Duration,
    /// Timeout of one motion.
    pub motion: Duration,
    /// Interval between two checks of a motion.
    pub poll: Duration,
    /// Wait after a motion, for the arm to stop oscillating.
    pub settle: Duration,
    /// Number of attempts to re-establish a lost connection.
    pub reconnects: usize,
}

impl Patience {
    /// The error with which a motion that began at this instant is to be broken off, if it is: the operator stops it, or it takes
    /// too long.
    pub(super) fn break_off(&self, stop: &StopRequest, began: Instant) -> Option<ManipulatorError> {
        if stop.is_made() {
            return Some(ManipulatorError::Stopped { reason: "stopped by the operator".into() });
        }
        (began.elapsed() > self.motion).then(|| {
            let seconds = self.motion.as_secs_f64();
            let reason = format!("a motion did not end within {seconds:.0} s and was broken off");
            ManipulatorError::Stopped { reason }
        })
    }
}

impl Default for Patience {
    fn default() -> Self {
        Patience {
            connect: Duration::from_secs(3),
            answer: Duration::from_secs(2),
            motion: Duration::from_secs(120),
            poll: Duration::from_millis(10),
            settle: Duration::from_millis(300),
            reconnects: 3,
        }
    }
}

/// Timeouts and intervals.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(super) struct PatienceKeys {
    /// Timeout of connecting, s.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    connect_s: f64,
    /// Timeout of one answer, s.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    answer_s: f64,
    /// Timeout of one motion, s.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    motion_s: f64,
    /// Interval between two checks of a motion, ms.
    poll_ms: f64,
    /// Wait after a motion, for the arm to stop oscillating, s.
    settle_s: f64,
    /// Attempts to re-establish a lost connection.
    #[cfg_attr(feature = "schema", schemars(range(max = MOST_RECONNECTS)))]
    reconnects: usize,
}

/// Most attempts to re-establish a connection: a campaign that waits longer looks as if it measured.
const MOST_RECONNECTS: usize = 100;

impl Default for PatienceKeys {
    fn default() -> Self {
        let Patience { connect, answer, motion, poll, settle, reconnects } = Patience::default();
        PatienceKeys {
            connect_s: connect.as_secs_f64(),
            answer_s: answer.as_secs_f64(),
            motion_s: motion.as_secs_f64(),
            poll_ms: 1e3 * poll.as_secs_f64(),
            settle_s: settle.as_secs_f64(),
            reconnects,
        }
    }
}

impl PatienceKeys {
    /// Converts the keys of `robot.patience`.
    ///
    /// # Errors
    /// When a value is not a waiting time.
    pub(super) fn patience(&self, reading: &CellReading<'_>) -> Result<Patience, FileError> {
        if self.reconnects > MOST_RECONNECTS {
            let problem = format!("{} is more than anybody waits for", self.reconnects);
            return Err(reading.wrong("robot.patience.reconnects", problem, &format!("give 0 to {MOST_RECONNECTS}")));
        }
        // Zero seconds would never be enough for these three.
        let positive = |key: &str, value: f64| reading.time(key, reading.positive(key, value)?, 1.0);
        Ok(Patience {
            connect: positive("robot.patience.connect_s", self.connect_s)?,
            answer: positive("robot.patience.answer_s", self.answer_s)?,
            motion: positive("robot.patience.motion_s", self.motion_s)?,
            poll: reading.time("robot.patience.poll_ms", self.poll_ms, 1e-3)?,
            settle: reading.time("robot.patience.settle_s", self.settle_s, 1.0)?,
            reconnects: self.reconnects,
        })
    }
}
