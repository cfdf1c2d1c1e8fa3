//! The campaign: every planned pose probed in order, with what failed kept beside what was measured.

use serde::Serialize;
use thiserror::Error;

use super::course::Course;
use super::journal_entry::ProbingEntry;
use super::last_motion::LastMotion;
use super::{ArmAt, CenteringController, CentringFailure, HomeWays, Iteration, Journal, PlannedPose, Probing, Sample};
use crate::cell::{Indicator, Manipulator};
use crate::units::{ARCSEC, UM};

/// How a campaign deals with failures, and what counts as a motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    /// Seconds since the campaign began, or went on.
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

    /// A probing was done before an interruption, and is not done again.
    fn recalled(&mut self, _pose: &PlannedPose, _probing: &Probing, _sample: Option<&Sample>) {}
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
    /// A probing could not be written to the journal, which holds all before it; or the journal is not of this campaign.
    #[error("{why}")]
    NotJournalled {
        /// What is wrong with it.
        why: String,
    },
}

/// What a campaign brought home.
#[derive(Debug, Clone, Default, PartialEq)]
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
    pub(super) controller: CenteringController<M, I>,
    pub(super) settings: CampaignSettings,
    joints: LastMotion,
    plungers: LastMotion,
    ways: Option<HomeWays>,
    stands: ArmAt,
}

impl<M: Manipulator, I: Indicator> Campaign<M, I> {
    /// A campaign with this controller.
    pub fn new(controller: CenteringController<M, I>, settings: CampaignSettings) -> Self {
        let joints = LastMotion::new(settings.joint_motion);
        let plungers = LastMotion::new(settings.plunger_motion);
        Campaign { controller, settings, joints, plungers, ways: None, stands: ArmAt::Unknown }
    }

    /// The same, by these ways: the arm stands at `stands` now. Without ways it moves at once to every pose, whatever is between.
    #[must_use]
    pub fn by(self, ways: HomeWays, stands: ArmAt) -> Self {
        Campaign { ways: Some(ways), stands, ..self }
    }

    /// Where the arm stands, as far as its ways know.
    pub fn stands(&self) -> &ArmAt {
        &self.stands
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
        Course::new(poses, None, witness).run(self)
    }

    /// The same, every probing written to the `journal` as soon as it ends; what the journal already holds is not done again.
    ///
    /// What ended the campaign then has been seen to since: where the robot was lost or stopped, or could not be backed off, the
    /// pose is probed as if it never had been, and so are all poses skipped in a row that was too long. The first motion is to the
    /// approach pose of the probing that was in hand, which is the way that the arm was on, or the way back from its ball. Of a joint
    /// or plunger the side of approach is unknown (0) until it has moved in this campaign.
    pub fn run_journalled(
        &mut self,
        poses: &[PlannedPose],
        journal: &mut Journal,
        witness: &mut dyn Witness,
    ) -> CampaignRecord {
        Course::new(poses, Some(journal), witness).run(self)
    }

    /// One probing, with the sides from which joints and plungers came last on the ball.
    pub(super) fn probe(
        &mut self,
        pose: &PlannedPose,
        attempt: usize,
        before: Before<'_>,
        witness: &mut dyn Witness,
    ) -> ProbingEntry {
        let via = self.via(pose, before.pose);
        let Campaign { controller, joints, plungers, .. } = self;
        // The signs that count are those of the last stop on the ball, before the retreat turns them round.
        let mut on_ball = (Vec::new(), Vec::new());
        let probing = controller.probe_against(pose, &via, before.against, &mut |iteration| {
            if let Some(reading) = &iteration.reading {
                joints.rest_at(&iteration.joints);
                plungers.rest_at(reading.as_slice());
            }
            if iteration.phase == super::Phase::Centring {
                on_ball = (joints.signs().to_vec(), plungers.signs().to_vec());
            }
            witness.iteration(pose, iteration);
        });
        // Where it was refused at once the arm stands where it stood.
        let refused = |iteration: &Iteration| iteration.fault.as_ref().is_some_and(CentringFailure::is_robot_s);
        if !probing.iterations.first().is_none_or(refused) {
            self.stands = ArmAt::Approach(pose.id.clone());
        }
        ProbingEntry { pose: pose.id.clone(), attempt, probing, approach: on_ball.0, plungers: on_ball.1 }
    }

    /// The joints by which the arm gets to the approach of `pose` from where it stands; `before` is the one before it in the plan.
    fn via(&self, pose: &PlannedPose, before: Option<&PlannedPose>) -> Vec<Vec<f64>> {
        match (&self.ways, &self.stands) {
            (Some(ways), ArmAt::Home) => ways.from_home(&pose.id).to_vec(),
            (Some(_), ArmAt::Approach(at)) if *at == pose.id => Vec::new(),
            (Some(_), ArmAt::Approach(at)) if before.is_some_and(|before| before.id == *at) => pose.via.clone(),
            (Some(ways), ArmAt::Approach(at)) => ways.between(at, &pose.id),
            (None, _) | (_, ArmAt::Unknown) => Vec::new(),
        }
    }
}

/// What came before a probing.
#[derive(Clone, Copy, Default)]
pub(super) struct Before<'a> {
    /// The pose before it in the plan, where the way from there is that of the plan.
    pub pose: Option<&'a PlannedPose>,
    /// Sides of the sample against which every joint is to arrive.
    pub against: Option<&'a [i8]>,
}
