//! The campaign: every planned pose probed in order, with what failed kept beside what was measured.

use serde::Serialize;
use thiserror::Error;

use super::journal_entry::ProbingEntry;
use super::last_motion::LastMotion;
use super::queue::Queue;
use super::{CenteringController, CentringFailure, Iteration, Journal, PlannedPose, Probing, Sample};
use crate::cell::{Indicator, Manipulator};
use crate::files::FileError;
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
    fn probe(&mut self, pose: &PlannedPose, attempt: usize, against: Option<&[i8]>, witness: &mut dyn Witness) -> ProbingEntry {
        let Campaign { controller, joints, plungers, .. } = self;
        // The signs that count are those of the last stop on the ball, before the retreat turns them round.
        let mut on_ball = (Vec::new(), Vec::new());
        let probing = controller.probe_against(pose, against, &mut |iteration| {
            if let Some(reading) = &iteration.reading {
                joints.rest_at(&iteration.joints);
                plungers.rest_at(reading.as_slice());
            }
            if iteration.phase == super::Phase::Centring {
                on_ball = (joints.signs().to_vec(), plungers.signs().to_vec());
            }
            witness.iteration(pose, iteration);
        });
        ProbingEntry { pose: pose.id.clone(), attempt, probing, approach: on_ball.0, plungers: on_ball.1 }
    }
}

/// A campaign under way.
struct Course<'a> {
    poses: &'a [PlannedPose],
    queue: Queue<'a>,
    record: CampaignRecord,
    journal: Option<&'a mut Journal>,
    witness: &'a mut dyn Witness,
    /// The cell's clock and the poses done when probing began here and now.
    began: Option<(f64, usize)>,
}

impl<'a> Course<'a> {
    fn new(poses: &'a [PlannedPose], journal: Option<&'a mut Journal>, witness: &'a mut dyn Witness) -> Self {
        let record = CampaignRecord { samples: Vec::new(), probings: Vec::new(), aborted: None };
        Course { poses, queue: Queue::new(poses), record, journal, witness, began: None }
    }

    fn run<M: Manipulator, I: Indicator>(mut self, campaign: &mut Campaign<M, I>) -> CampaignRecord {
        while let Some(place) = self.queue.next() {
            let tried = self.measure(place, campaign);
            let abort = match tried.result {
                Ok(sample) => {
                    self.record.samples.push(sample);
                    self.queue.centred();
                    continue;
                }
                Err(Failed::Pose(last)) => {
                    self.queue.skip(place);
                    let skipped = self.queue.skipped;
                    if skipped < campaign.settings.skipped_in_a_row || self.queue.left() == 0 {
                        continue;
                    }
                    if tried.recalled {
                        self.queue.give_back_skipped();
                    }
                    Abort::TooManyFailures { skipped, last }
                }
                Err(Failed::Campaign(abort)) => {
                    if tried.recalled {
                        self.queue.give_back(place);
                    }
                    abort
                }
            };
            if !tried.recalled {
                self.record.aborted = Some(abort);
                break;
            }
        }
        self.record
    }

    /// Tries one pose until it is centred, fails for good, or ends the campaign.
    fn measure<M: Manipulator, I: Indicator>(&mut self, place: usize, campaign: &mut Campaign<M, I>) -> Tried {
        let pose = &self.poses[place];
        let mut attempt = 1;
        loop {
            let (entry, recalled) = match self.recall(pose, attempt) {
                Ok(Some(entry)) => (entry, true),
                Ok(None) => (self.probe(pose, attempt, campaign), false),
                Err(e) => return Tried::ended(Abort::NotJournalled { why: e.to_string() }),
            };
            if !recalled
                && let Some(journal) = &mut self.journal
                && let Err(e) = journal.note(&entry)
            {
                return Tried::ended(Abort::NotJournalled { why: e.to_string() });
            }
            let sample = entry.sample(pose, self.journal.as_ref().and_then(|journal| journal.session_name()));
            if recalled {
                self.witness.recalled(pose, &entry.probing, sample.as_ref());
            } else {
                self.witness.probing_finished(pose, &entry.probing, sample.as_ref());
            }
            let failure = entry.probing.outcome.as_ref().err().cloned();
            self.record.probings.push(ProbingRecord { pose: place, attempt, probing: entry.probing });
            let result = match (sample, failure) {
                (Some(sample), _) => Ok(sample),
                (None, Some(failure)) if !failure.reason.robot_obeys() => Err(Failed::Campaign(Abort::Robot(failure.reason))),
                (None, Some(failure)) if !failure.backed_off => Err(Failed::Campaign(Abort::NotBackedOff(failure.reason))),
                (None, Some(failure)) if attempt >= campaign.settings.attempts => Err(Failed::Pose(failure.reason)),
                (None, _) => {
                    attempt += 1;
                    continue;
                }
            };
            return Tried { result, recalled };
        }
    }

    /// The probing, where the journal has it from before.
    fn recall(&mut self, pose: &PlannedPose, attempt: usize) -> Result<Option<ProbingEntry>, FileError> {
        self.journal.as_mut().map_or(Ok(None), |journal| journal.recall(pose, attempt))
    }

    /// Probes here and now.
    fn probe<M: Manipulator, I: Indicator>(
        &mut self,
        pose: &PlannedPose,
        attempt: usize,
        campaign: &mut Campaign<M, I>,
    ) -> ProbingEntry {
        let progress = self.progress(campaign.controller.robot.clock_s());
        self.witness.probing_started(pose, attempt, &progress);
        // Of a pose that failed there is no side to come against.
        let reversed = pose.reverses.as_ref().and_then(|id| self.record.samples.iter().find(|s| s.id == *id));
        campaign.probe(pose, attempt, reversed.and_then(|s| s.approach.as_deref()), self.witness)
    }

    fn progress(&mut self, now_s: f64) -> Progress {
        let done = self.queue.done - 1;
        let (began_s, done_before) = *self.began.get_or_insert((now_s, done));
        let elapsed_s = now_s - began_s;
        let pace = if done == done_before { 30.0 } else { elapsed_s / (done - done_before) as f64 };
        let planned = self.queue.done + self.queue.left();
        Progress { done, planned, elapsed_s, remaining_s: pace * planned.saturating_sub(done) as f64 }
    }
}

/// What came of a pose, and whether the last that came of it was read in the journal.
struct Tried {
    result: Result<Sample, Failed>,
    recalled: bool,
}

impl Tried {
    /// Here and now, the campaign with it.
    fn ended(abort: Abort) -> Self {
        Tried { result: Err(Failed::Campaign(abort)), recalled: false }
    }
}

/// What a pose without a sample means for the rest.
enum Failed {
    Pose(CentringFailure),
    Campaign(Abort),
}
