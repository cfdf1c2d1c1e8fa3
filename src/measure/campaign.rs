//! The campaign: every planned pose is probed in order, and failures are recorded beside the measurements.

pub mod cell;
mod conditions;
mod files;
pub mod journal;
mod last_motion;
pub mod mastering;
mod parts;
mod record;
pub mod repeatability;
mod state;

pub use conditions::Conditions;
pub use last_motion::LastMotion;
pub use parts::{Part, parts_by_payload};
pub use record::{Abort, CampaignRecord, ProbingRecord};

use serde::Serialize;

use self::journal::ProbingEntry;

use super::centring::{CenteringController, CentringFailure, Iteration, Probing};
use super::dataset::Sample;
use super::poses::PlannedPose;
use super::poses::ways::{ArmAt, HomeWays};
use crate::cell::{Indicator, Manipulator};
use crate::units::{ARCSEC, UM};

/// Treatment of failures in a campaign, and thresholds of motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CampaignSettings {
    /// Attempts at a pose before it is skipped. 2: the first may fail by chance, the second confirms the failure.
    pub attempts: usize,
    /// Skipped poses in a row after which the campaign stops. 5: one misplaced ball gives one in four, a displaced artifact
    /// all.
    pub skipped_in_a_row: usize,
    /// Joint motion that sets a joint's direction of approach, rad. 50 arcsec: a gear reverses over a multiple of its lost
    /// motion, which the last tens of micrometres of a centring do not reach.
    pub joint_motion: f64,
    /// Plunger motion that sets a plunger's direction of approach, m. 15 um: a smaller correction undoes the lost motion of the
    /// joints on arrival, so that its sign is the sign of the noise, and any effect that follows that sign would seem to
    /// explain the noise.
    pub plunger_motion: f64,
}

impl Default for CampaignSettings {
    fn default() -> Self {
        CampaignSettings { attempts: 2, skipped_in_a_row: 5, joint_motion: 50.0 * ARCSEC, plunger_motion: 15.0 * UM }
    }
}

/// Progress of a campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Poses done or skipped.
    pub done: usize,
    /// Poses planned, and reserves called in.
    pub planned: usize,
    /// Seconds since the campaign began or was resumed.
    pub elapsed_s: f64,
    /// Seconds remaining at the mean pace so far; before the first pose, at 30 s per probing (paper, section 3).
    pub remaining_s: f64,
}

/// An observer of a campaign: a progress bar, a journal, a three-dimensional view, or what decides how to go on. By default all
/// methods do nothing, and the poses are probed in their order.
pub trait CampaignObserver {
    /// A probing begins at this pose; attempts are counted from 1.
    fn probing_started(&mut self, _pose: &PlannedPose, _attempt: usize, _progress: &Progress) {}

    /// The arm stopped and was read.
    fn iteration(&mut self, _pose: &PlannedPose, _iteration: &Iteration) {}

    /// A probing ended, with a sample or without.
    fn probing_finished(&mut self, _pose: &PlannedPose, _probing: &Probing, _sample: Option<&Sample>) {}

    /// A probing made before an interruption is taken over and not repeated.
    fn recalled(&mut self, _pose: &PlannedPose, _probing: &Probing, _sample: Option<&Sample>) {}

    /// The pose to probe next, by its place among those waiting, after these samples; `None` ends the campaign because they are
    /// enough. A campaign that is resumed asks again, so the answer must depend on nothing else.
    fn choose(&mut self, _waiting: &[&PlannedPose], _samples: &[Sample]) -> Option<usize> {
        Some(0)
    }
}

/// No observer.
impl CampaignObserver for () {}

/// Knows better than the plan where a ball will be met.
pub trait Aim {
    /// A ball was centred, now or before an interruption.
    fn learn(&mut self, sample: &Sample);

    /// The joints (rad, N) at which to meet the ball of this pose, by nothing but what was learnt; `None` for those planned. The
    /// approach is always the planned one.
    fn contact(&self, pose: &PlannedPose) -> Option<Vec<f64>>;
}

/// Probes planned poses one after the other.
pub struct Campaign<M, I> {
    pub(super) controller: CenteringController<M, I>,
    pub(super) settings: CampaignSettings,
    joints: LastMotion,
    plungers: LastMotion,
    ways: Option<HomeWays>,
    stands: ArmAt,
    aim: Option<Box<dyn Aim>>,
}

impl<M: Manipulator, I: Indicator> Campaign<M, I> {
    /// Creates a campaign with this controller.
    pub fn new(controller: CenteringController<M, I>, settings: CampaignSettings) -> Self {
        let joints = LastMotion::new(settings.joint_motion);
        let plungers = LastMotion::new(settings.plunger_motion);
        Campaign { controller, settings, joints, plungers, ways: None, stands: ArmAt::Unknown, aim: None }
    }

    /// Uses these ways; `stands` is the present posture of the arm. Without ways it moves directly to every pose, whatever is between.
    #[must_use]
    pub fn by(self, ways: HomeWays, stands: ArmAt) -> Self {
        Campaign { ways: Some(ways), stands, ..self }
    }

    /// Meets the balls where `aim` says, rather than where they were planned; a second attempt is always as planned.
    #[must_use]
    pub fn aiming(self, aim: Option<Box<dyn Aim>>) -> Self {
        Campaign { aim, ..self }
    }

    /// Returns what the campaign aims by, for the next part of the same plan.
    pub fn take_aim(&mut self) -> Option<Box<dyn Aim>> {
        self.aim.take()
    }

    /// Position of the arm, as far as its ways know it.
    pub fn stands(&self) -> &ArmAt {
        &self.stands
    }

    /// Returns the controller, e.g. for another campaign.
    pub fn into_controller(self) -> CenteringController<M, I> {
        self.controller
    }

    /// Makes one probing, and records the directions of the last motion of joints and plungers on the ball.
    pub(super) fn probe(
        &mut self,
        pose: &PlannedPose,
        attempt: usize,
        before: Before<'_>,
        observer: &mut dyn CampaignObserver,
    ) -> ProbingEntry {
        let via = self.via(pose, before.pose);
        let aimed = self.aim.as_ref().filter(|_| attempt == 1).and_then(|aim| aim.contact(pose));
        let aimed = aimed.map(|contact| PlannedPose { contact, ..pose.clone() });
        let Campaign { controller, joints, plungers, .. } = self;
        // The signs that count are those of the last stop on the ball, before the retreat reverses them.
        let mut on_ball = (Vec::new(), Vec::new());
        let probing = controller.probe_against(aimed.as_ref().unwrap_or(pose), &via, before.against, &mut |iteration| {
            if let Some(reading) = &iteration.reading {
                joints.rest_at(&iteration.joints);
                plungers.rest_at(reading.as_slice());
            }
            if iteration.phase == super::centring::Phase::Centring {
                on_ball = (joints.signs().to_vec(), plungers.signs().to_vec());
            }
            observer.iteration(pose, iteration);
        });
        // If the first motion was refused, the arm did not move.
        let refused = |iteration: &Iteration| iteration.fault.as_ref().is_some_and(CentringFailure::is_robot_s);
        if !probing.iterations.first().is_none_or(refused) {
            self.stands = ArmAt::Approach(pose.id.clone());
        }
        ProbingEntry { pose: pose.id.clone(), attempt, probing, approach: on_ball.0, plungers: on_ball.1 }
    }

    /// The joints through which the arm moves from its position to the approach of `pose`; `before` is the preceding pose of
    /// the plan.
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

/// Context of a probing.
#[derive(Clone, Copy, Default)]
pub(super) struct Before<'a> {
    /// The preceding pose of the plan, if the path from there is that of the plan.
    pub pose: Option<&'a PlannedPose>,
    /// Signs of approach of the sample, opposite to which every joint is to arrive.
    pub against: Option<&'a [i8]>,
}
