//! The campaign: every planned pose probed in order, with what failed kept beside what was measured.

use std::collections::VecDeque;

use thiserror::Error;

use super::last_motion::LastMotion;
use super::{CenteringController, CentringFailure, Iteration, Measured, PlannedPose, Probing, Sample};
use crate::cell::{Indicator, Manipulator};
use crate::units::{ARCSEC, UM};

/// How a campaign deals with failures, and what counts as a motion.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignSettings {
    /// Tries at a pose before it is skipped. 2: once for a chance event, once to be sure.
    pub attempts: usize,
    /// Skipped poses in a row after which the campaign stops. 5: one ball out of its place gives one in four, a bumped artifact all.
    pub skipped_in_a_row: usize,
    /// Joint motion that sets a joint's side of approach, rad. 50 arcsec: a gear changes sides over some multiples of what it loses, and
    /// the last tens of micrometres of a centring do not take it there.
    pub joint_motion: f64,
    /// Plunger motion that sets a plunger's side of approach, m. 15 um: a smaller correction takes back what the joints lost on arrival, so
    /// that its sign is the sign of the noise, and whatever follows that sign would seem to explain it.
    pub plunger_motion: f64,
}

impl Default for CampaignSettings {
    fn default() -> Self {
        CampaignSettings { attempts: 2, skipped_in_a_row: 5, joint_motion: 50.0 * ARCSEC, plunger_motion: 15.0 * UM }
    }
}

/// How far a campaign has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Poses done or skipped.
    pub done: usize,
    /// Poses planned, and reserves called in.
    pub planned: usize,
    /// Seconds since the campaign began.
    pub elapsed_s: f64,
    /// Seconds still to go at the mean pace so far; before the first pose, at 30 s a probing (paper, section 3).
    pub remaining_s: f64,
}

/// Someone who watches a campaign: a progress bar, a journal, a three-dimensional view. All methods do nothing unless written.
pub trait Witness {
    /// A probing begins: which pose, which try (counted from 1).
    fn probing_started(&mut self, _pose: &PlannedPose, _attempt: usize, _progress: &Progress) {}

    /// The arm stopped and was read.
    fn iteration(&mut self, _pose: &PlannedPose, _iteration: &Iteration) {}

    /// A probing ended, with a sample or without.
    fn probing_finished(&mut self, _pose: &PlannedPose, _probing: &Probing, _sample: Option<&Sample>) {}
}

/// Nobody watches.
impl Witness for () {}

/// One probing of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbingRecord {
    /// Place of the pose in the plan.
    pub pose: usize,
    /// Which try, counted from 1.
    pub attempt: usize,
    /// What came of it.
    pub probing: Probing,
}

/// Why a campaign ended before its plan did.
#[derive(Debug, Error, Clone, PartialEq)]
pub enum Abort {
    /// The robot is lost or stopped.
    #[error("{0}")]
    Robot(CentringFailure),
    /// The arm could not be brought clear of a ball, so no way from there is known to be free.
    #[error("the arm could not be backed off: {0}")]
    NotBackedOff(CentringFailure),
    /// Too many poses in a row failed.
    #[error("{skipped} poses in a row failed, the last because: {last}")]
    TooManyFailures {
        /// How many.
        skipped: usize,
        /// Why the last one did.
        last: CentringFailure,
    },
}

/// What a campaign brought home.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignRecord {
    /// One sample for every pose centred, in the order measured.
    pub samples: Vec<Sample>,
    /// Every probing, in order.
    pub probings: Vec<ProbingRecord>,
    /// Why it ended early, if it did.
    pub aborted: Option<Abort>,
}

/// Probes planned poses one after the other.
pub struct Campaign<M, I> {
    controller: CenteringController<M, I>,
    settings: CampaignSettings,
    joints: LastMotion,
    plungers: LastMotion,
}

impl<M: Manipulator, I: Indicator> Campaign<M, I> {
    /// A campaign with this controller.
    pub fn new(controller: CenteringController<M, I>, settings: CampaignSettings) -> Self {
        let joints = LastMotion::new(settings.joint_motion);
        let plungers = LastMotion::new(settings.plunger_motion);
        Campaign { controller, settings, joints, plungers }
    }

    /// The controller back, e.g. for another campaign.
    pub fn into_controller(self) -> CenteringController<M, I> {
        self.controller
    }

    /// Probes `poses` in the order given (see [`super::interleave`]), then reserves in place of those that failed.
    ///
    /// A pose that fails is tried again and then skipped, its reasons kept. The campaign ends early only when the robot is lost or
    /// stopped, cannot be backed off a ball, or too many poses in a row fail. What was measured until then is always kept.
    pub fn run(&mut self, poses: &[PlannedPose], witness: &mut dyn Witness) -> CampaignRecord {
        let began_s = self.controller.robot.clock_s();
        let mut record = CampaignRecord { samples: Vec::new(), probings: Vec::new(), aborted: None };
        let mut queue: VecDeque<usize> = (0..poses.len()).filter(|&k| !poses[k].reserve).collect();
        let mut reserves: Vec<usize> = (0..poses.len()).filter(|&k| poses[k].reserve).collect();
        let (mut done, mut skipped) = (0, 0);
        while let Some(place) = queue.pop_front() {
            let progress = (done, done + 1 + queue.len(), began_s);
            done += 1;
            match self.measure(place, poses, progress, &mut record, witness) {
                Ok(sample) => {
                    record.samples.push(sample);
                    skipped = 0;
                }
                Err(Failed::Pose(last)) => {
                    skipped += 1;
                    if let Some(k) = reserves.iter().position(|&r| poses[r].ball == poses[place].ball) {
                        queue.push_back(reserves.remove(k));
                    }
                    if skipped >= self.settings.skipped_in_a_row && !queue.is_empty() {
                        record.aborted = Some(Abort::TooManyFailures { skipped, last });
                        break;
                    }
                }
                Err(Failed::Campaign(abort)) => {
                    record.aborted = Some(abort);
                    break;
                }
            }
        }
        record
    }

    /// Tries one pose until it is centred, fails for good, or ends the campaign.
    fn measure(
        &mut self,
        place: usize,
        poses: &[PlannedPose],
        (done, planned, began_s): (usize, usize, f64),
        record: &mut CampaignRecord,
        witness: &mut dyn Witness,
    ) -> Result<Sample, Failed> {
        let pose = &poses[place];
        let mut attempt = 1;
        loop {
            let progress = self.progress(done, planned, began_s);
            witness.probing_started(pose, attempt, &progress);
            // Of a pose that failed there is no side to come against.
            let reversed = pose.reverses.as_ref().and_then(|id| record.samples.iter().find(|s| s.id == *id));
            let last_motion = reversed.and_then(|s| s.approach.as_deref());
            let (probing, sample) = self.probe(pose, last_motion, witness);
            witness.probing_finished(pose, &probing, sample.as_ref());
            let failure = probing.outcome.as_ref().err().cloned();
            record.probings.push(ProbingRecord { pose: place, attempt, probing });
            match (sample, failure) {
                (Some(sample), _) => return Ok(sample),
                (None, Some(failure)) if !failure.reason.robot_obeys() => {
                    return Err(Failed::Campaign(Abort::Robot(failure.reason)));
                }
                (None, Some(failure)) if !failure.backed_off => {
                    return Err(Failed::Campaign(Abort::NotBackedOff(failure.reason)));
                }
                (None, Some(failure)) if attempt >= self.settings.attempts => return Err(Failed::Pose(failure.reason)),
                (None, _) => attempt += 1,
            }
        }
    }

    /// One probing, and the sample it gives.
    fn probe(
        &mut self,
        pose: &PlannedPose,
        last_motion: Option<&[i8]>,
        witness: &mut dyn Witness,
    ) -> (Probing, Option<Sample>) {
        let Campaign { controller, joints, plungers, .. } = self;
        // The signs that count are those of the last stop on the ball, before the retreat turns them round.
        let mut on_ball = (Vec::new(), Vec::new());
        let probing = controller.probe_against(pose, last_motion, &mut |iteration| {
            if let Some(reading) = &iteration.reading {
                joints.rest_at(&iteration.joints);
                plungers.rest_at(reading.as_slice());
            }
            if iteration.phase == super::Phase::Centring {
                on_ball = (joints.signs().to_vec(), plungers.signs().to_vec());
            }
            witness.iteration(pose, iteration);
        });
        let sample = probing.outcome.as_ref().ok().map(|centred| {
            let measured = Measured::Ball { ball: pose.ball, reading: Some(centred.reading) };
            Sample {
                payload: pose.payload,
                time_s: Some(centred.time_s),
                temp_c: centred.temp_c,
                q_commanded: centred.commanded.clone(),
                approach: Some(on_ball.0),
                plungers: <[i8; 3]>::try_from(on_ball.1).ok(),
                ..Sample::new(&pose.id, centred.joints.clone(), measured)
            }
        });
        (probing, sample)
    }

    fn progress(&mut self, done: usize, planned: usize, began_s: f64) -> Progress {
        let elapsed_s = self.controller.robot.clock_s() - began_s;
        let pace = if done == 0 { 30.0 } else { elapsed_s / done as f64 };
        Progress { done, planned, elapsed_s, remaining_s: pace * planned.saturating_sub(done) as f64 }
    }
}

/// What a pose without a sample means for the rest.
enum Failed {
    Pose(CentringFailure),
    Campaign(Abort),
}
