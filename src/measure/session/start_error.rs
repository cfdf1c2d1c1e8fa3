//! Reasons why a session at a real cell does not start.

use std::path::PathBuf;

use thiserror::Error;

use crate::cell::ManipulatorError;
use crate::measure::campaign::mastering::MasteringError;
use crate::measure::poses::ways::Blocked;

/// Number of forbidden motions that the message names.
const NAMED: usize = 3;

/// Reason why a session at a real cell does not start. Axes are counted from 0 (messages count from 1).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StartError {
    /// The guards forbid motions of the plan; nothing has moved.
    #[error("{}{}; nothing has moved; plan again with `calibench plan CELL`, which keeps to the guards, or correct [guards]", motions.iter().take(NAMED).cloned().collect::<Vec<_>>().join("; "), rest(motions.len()))]
    Forbidden {
        /// Each motion, and why it is forbidden.
        motions: Vec<String>,
    },
    /// Motions of the plan touch bodies of the cell; nothing has moved.
    #[error("{}{}; nothing has moved; plan again with `calibench plan CELL`, or correct the scene", motions.iter().take(NAMED).cloned().collect::<Vec<_>>().join("; "), rest(motions.len()))]
    Touching {
        /// Each motion, and what hits what.
        motions: Vec<String>,
    },
    /// The arm is on no motion of the plan, and the cell file does not name the bodies around it.
    #[error(
        "{}: surroundings.scene: is missing, and the arm is on no motion of the plan; name a scene.toml with the bodies around it, or {}",
        file.display(),
        jog(home)
    )]
    BodiesUnknown {
        /// The cell file.
        file: PathBuf,
        /// Home posture of the plan, deg.
        home: String,
    },
    /// The arm is on no motion of the plan, and no clear path leads home.
    #[error("the arm is on no motion of the plan, and from there {blocked}: {}", jog(home))]
    Blocked {
        /// The obstacle.
        blocked: Blocked,
        /// Home posture of the plan, deg.
        home: String,
    },
    /// An indicator forgets its preset when its connection closes, so that a mastering cannot be taken over.
    #[error("indicator {} keeps no preset, so that each run must master it; leave --mastered out", axis + 1)]
    KeepsNoPreset {
        /// Its axis.
        axis: usize,
    },
    /// The gauge must be mastered and may touch a ball.
    #[error("the gauge must be mastered, and may touch ball '{ball}'; nothing was set: jog it clear and start again")]
    NearBall {
        /// Name of the ball.
        ball: String,
    },
    /// The robot does not move as commanded.
    #[error(transparent)]
    Robot(#[from] ManipulatorError),
    /// The gauge cannot be mastered.
    #[error(transparent)]
    Mastering(#[from] MasteringError),
}

impl StartError {
    /// True if the request is at fault, not a device: nothing has moved, and nothing was set.
    pub fn is_of_the_request(&self) -> bool {
        matches!(self, StartError::Forbidden { .. } | StartError::BodiesUnknown { .. } | StartError::KeepsNoPreset { .. })
    }
}

fn rest(count: usize) -> String {
    if count > NAMED { format!("; and {} more", count - NAMED) } else { String::new() }
}

fn jog(home: &str) -> String {
    format!("jog it to the home posture of the plan ({home} deg) and start again")
}
