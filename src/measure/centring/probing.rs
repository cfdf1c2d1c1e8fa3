//! One probing: move to the approach pose, onto the ball, centre it, and always retreat.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{CenteringController, Centred, CentringFailure, Iteration, Phase};
use crate::cell::{Indicator, Manipulator};
use crate::measure::poses::PlannedPose;

/// Reason why a probing gave no measurement, and the resulting position of the arm.
#[derive(Debug, Error, Clone, PartialEq, Serialize, Deserialize)]
#[error("{reason}{}", if *backed_off { "" } else { "; the arm could not be backed off" })]
pub struct ProbingFailure {
    /// The first failure.
    pub reason: CentringFailure,
    /// True if the arm is clear of the ball: back at the approach pose, or never gone past it.
    pub backed_off: bool,
}

/// Result of a probing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Probing {
    /// The measurement, or the failure.
    pub outcome: Result<Centred, ProbingFailure>,
    /// Every stop of the arm, in order.
    pub iterations: Vec<Iteration>,
    /// Beginning on the cell's clock, s.
    pub started_s: f64,
    /// Duration, s.
    pub duration_s: f64,
}

impl Probing {
    /// The first reading on the ball, m: how far off it the arm arrived; `None` if there was none.
    pub fn first_reading(&self) -> Option<Vector3<f64>> {
        self.iterations.iter().filter(|i| i.phase == Phase::Centring).find_map(|i| i.reading)
    }
}

impl<M: Manipulator, I: Indicator> CenteringController<M, I> {
    /// Probes the ball at `pose` from any position of the arm; `watch` is called at every stop as it happens.
    ///
    /// The plungers must be free before contact and again after the retreat, else a stuck one could pass for a centred one. A
    /// robot that is lost or stopped receives no further command; in every other case the arm ends at the approach pose, if it
    /// obeys.
    pub fn probe(&mut self, pose: &PlannedPose, watch: &mut dyn FnMut(&Iteration)) -> Probing {
        self.probe_against(pose, &[], None, watch)
    }

    /// As [`Self::probe`], but through the joints `via` (rad), and finally with every joint arriving in the direction opposite
    /// to the `last_motion` (sign of each joint) of another sample, if given.
    pub fn probe_against(
        &mut self,
        pose: &PlannedPose,
        via: &[Vec<f64>],
        last_motion: Option<&[i8]>,
        watch: &mut dyn FnMut(&Iteration),
    ) -> Probing {
        let started_s = self.robot.clock_s();
        let mut iterations = Vec::new();
        let outcome = self.approach_and_probe(pose, via, last_motion, &mut |iteration| {
            watch(iteration);
            iterations.push(iteration.clone());
        });
        Probing { outcome, iterations, started_s, duration_s: self.robot.clock_s() - started_s }
    }

    fn approach_and_probe(
        &mut self,
        pose: &PlannedPose,
        via: &[Vec<f64>],
        last_motion: Option<&[i8]>,
        note: &mut dyn FnMut(&Iteration),
    ) -> Result<Centred, ProbingFailure> {
        let way = [via, std::slice::from_ref(&pose.approach)].concat();
        self.stop(Phase::Approach, &way, note, |cell, _, reading| cell.all_free(&reading?)).map_err(|reason| {
            // If a path of several motions was refused, the arm may be anywhere on it.
            let known = reason.robot_obeys() && (via.is_empty() || !reason.is_robot_s());
            ProbingFailure { backed_off: known, reason }
        })?;
        let centred = self.centre_at(std::slice::from_ref(&pose.contact), note).and_then(|centred| match last_motion {
            Some(signs) => self.arrive_against(signs, &centred, note),
            None => Ok(centred),
        });
        match centred {
            Err(reason) if !reason.robot_obeys() => Err(ProbingFailure { reason, backed_off: false }),
            centred => {
                let (arrived, free) = self.retreat(pose, note);
                let reason = match (centred, free) {
                    (Ok(centred), Ok(())) => return Ok(centred),
                    (Err(reason), _) | (Ok(_), Err(reason)) => reason,
                };
                Err(ProbingFailure { reason, backed_off: arrived })
            }
        }
    }

    /// Moves back to the approach pose. Returns whether the arm arrived, and whether the plungers came out again.
    ///
    /// This is one joint motion, not first a straight line along the tool. The segment between contact and approach was planned
    /// clear; the centring ends a few millimetres beside it, and a joint motion from there converges to the planned one. A
    /// straight line would require the controller's inverse kinematics again, which may be just what failed (a joint limit, an
    /// unreachable target), and along a tool axis that may be the wrong one.
    pub(crate) fn retreat(
        &mut self,
        pose: &PlannedPose,
        note: &mut dyn FnMut(&Iteration),
    ) -> (bool, Result<(), CentringFailure>) {
        let free =
            self.stop(Phase::Retreat, std::slice::from_ref(&pose.approach), note, |cell, _, reading| cell.all_free(&reading?));
        (!matches!(&free, Err(reason) if reason.is_robot_s()), free)
    }
}
