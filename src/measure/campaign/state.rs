//! A campaign in progress: pose after pose, from the journal as far as it has them, then from the cell.

use super::Before;
use super::journal::Journal;
use super::journal::ProbingEntry;
use super::{Abort, Campaign, CampaignObserver, CampaignRecord, ProbingRecord, Progress};
use crate::cell::{Indicator, Manipulator};
use crate::files::FileError;
use crate::measure::centring::CentringFailure;
use crate::measure::dataset::Sample;
use crate::measure::poses::PlannedPose;
use crate::measure::poses::queue::Queue;

impl<M: Manipulator, I: Indicator> Campaign<M, I> {
    /// Probes `poses` in the order given (see [`crate::measure::poses::interleave`]), then reserves in place of those that failed.
    ///
    /// A pose that fails is retried and then skipped, its reasons recorded. The campaign ends early only when the robot is lost
    /// or stopped, cannot be moved clear of a ball, or too many poses in a row fail. The measurements until then are always
    /// kept.
    pub fn run(&mut self, poses: &[PlannedPose], observer: &mut dyn CampaignObserver) -> CampaignRecord {
        CampaignState::new(poses, None, observer).run(self)
    }

    /// As [`Campaign::run`], but every probing is written to the `journal` as soon as it ends, and those already in the journal
    /// are not repeated.
    ///
    /// The cause of an earlier end is assumed to be resolved: if the robot was lost or stopped, or could not be moved clear of
    /// the ball, the pose is probed as if it never had been, and so are all skipped poses of a row that was too long. The first
    /// motion is to the approach pose of the interrupted probing, which is on the arm's path there, or on its path back from
    /// the ball. The direction of approach of a joint or plunger is unknown (0) until it has moved in this campaign.
    pub fn run_journalled(
        &mut self,
        poses: &[PlannedPose],
        journal: &mut Journal,
        observer: &mut dyn CampaignObserver,
    ) -> CampaignRecord {
        CampaignState::new(poses, Some(journal), observer).run(self)
    }
}

/// State of a campaign in progress.
struct CampaignState<'a> {
    poses: &'a [PlannedPose],
    queue: Queue<'a>,
    record: CampaignRecord,
    journal: Option<&'a mut Journal>,
    observer: &'a mut dyn CampaignObserver,
    /// The cell's clock and the poses done when probing began in this run.
    began: Option<(f64, usize)>,
}

impl<'a> CampaignState<'a> {
    fn new(poses: &'a [PlannedPose], journal: Option<&'a mut Journal>, observer: &'a mut dyn CampaignObserver) -> Self {
        let record = CampaignRecord { samples: Vec::new(), probings: Vec::new(), aborted: None };
        CampaignState { poses, queue: Queue::new(poses), record, journal, observer, began: None }
    }

    fn run<M: Manipulator, I: Indicator>(mut self, campaign: &mut Campaign<M, I>) -> CampaignRecord {
        while let Some(place) = self.next() {
            let tried = self.measure(place, campaign);
            let abort = match tried.result {
                Ok(sample) => {
                    if let Some(aim) = &mut campaign.aim {
                        aim.learn(&sample);
                    }
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

    /// Takes the next pose, by its index in the plan; `None` if there is none, or what was measured is enough.
    fn next(&mut self) -> Option<usize> {
        let waiting: Vec<&PlannedPose> = self.queue.waiting().map(|k| &self.poses[k]).collect();
        if waiting.is_empty() {
            return None;
        }
        let at = self.observer.choose(&waiting, &self.record.samples)?;
        self.queue.take(at)
    }

    /// Probes one pose until it is centred, fails for good, or ends the campaign.
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
                self.observer.recalled(pose, &entry.probing, sample.as_ref());
            } else {
                self.observer.probing_finished(pose, &entry.probing, sample.as_ref());
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

    /// The earlier probing, if the journal has it.
    fn recall(&mut self, pose: &PlannedPose, attempt: usize) -> Result<Option<ProbingEntry>, FileError> {
        self.journal.as_mut().map_or(Ok(None), |journal| journal.recall(pose, attempt))
    }

    /// Makes the probing at the cell.
    fn probe<M: Manipulator, I: Indicator>(
        &mut self,
        pose: &PlannedPose,
        attempt: usize,
        campaign: &mut Campaign<M, I>,
    ) -> ProbingEntry {
        let progress = self.progress(campaign.controller.robot.clock_s());
        self.observer.probing_started(pose, attempt, &progress);
        // A pose that failed has no direction of approach to reverse.
        let reversed = pose.reverses.as_ref().and_then(|id| self.record.samples.iter().find(|s| s.id == *id));
        let before = Before { pose: self.before(pose), against: reversed.and_then(|s| s.approach.as_deref()) };
        campaign.probe(pose, attempt, before, self.observer)
    }

    /// The pose from which the plan has the path to this one.
    fn before(&self, pose: &PlannedPose) -> Option<&'a PlannedPose> {
        let planned = || self.poses.iter().filter(|p| !p.reserve);
        let place = planned().position(|p| p.id == pose.id)?;
        planned().nth(place.checked_sub(1)?)
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

/// Result of a pose, and whether its last probing was read from the journal.
struct Tried {
    result: Result<Sample, Failed>,
    recalled: bool,
}

impl Tried {
    /// A campaign ended in this run.
    fn ended(abort: Abort) -> Self {
        Tried { result: Err(Failed::Campaign(abort)), recalled: false }
    }
}

/// Consequence of a pose without a sample.
enum Failed {
    Pose(CentringFailure),
    Campaign(Abort),
}
