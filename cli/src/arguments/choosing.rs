//! Campaigns that choose the next pose as they go.

use std::path::Path;

use calibench::measure::campaign::{CampaignObserver, Conditions, Progress};
use calibench::measure::centring::{Iteration, Probing};
use calibench::measure::dataset::Sample;
use calibench::measure::poses::PlannedPose;

use crate::terminal::progress::CampaignBar;
use calibench_rehearsal::Watch;

/// Says which of the waiting poses comes next, after these samples; `None` if they are enough.
pub type Choose<'a> = &'a mut dyn FnMut(&[&PlannedPose], &[Sample]) -> Option<usize>;

/// A campaign whose order and end are chosen as it goes, below its bar.
pub struct Chosen<'a> {
    /// The bar.
    pub bar: CampaignBar,
    /// The choice; in the order of the plan, to its end, without one.
    pub choose: Option<Choose<'a>>,
    /// The page on which it is watched, if it is.
    pub watch: Option<Watch>,
}

impl CampaignObserver for Chosen<'_> {
    fn probing_started(&mut self, pose: &PlannedPose, attempt: usize, progress: &Progress) {
        self.bar.probing_started(pose, attempt, progress);
        self.watch.iter_mut().for_each(|watch| watch.probing_started(pose, attempt, progress));
    }

    fn iteration(&mut self, pose: &PlannedPose, iteration: &Iteration) {
        self.watch.iter_mut().for_each(|watch| watch.iteration(pose, iteration));
    }

    fn probing_finished(&mut self, pose: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        self.bar.probing_finished(pose, probing, sample);
        self.watch.iter_mut().for_each(|watch| watch.probing_finished(pose, probing, sample));
    }

    fn recalled(&mut self, pose: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        self.bar.recalled(pose, probing, sample);
        self.watch.iter_mut().for_each(|watch| watch.recalled(pose, probing, sample));
    }

    fn choose(&mut self, waiting: &[&PlannedPose], samples: &[Sample]) -> Option<usize> {
        self.choose.as_mut().map_or(Some(0), |choose| choose(waiting, samples))
    }
}

/// A campaign that chooses as it goes, and the conditions under which it may go on after an interruption.
#[derive(Default)]
pub struct Choice<'a> {
    /// The choice; in the order of the plan, to its end, without one.
    pub choose: Option<Choose<'a>>,
    /// True if the caller says what was measured.
    pub silent: bool,
    /// Names and values of what it depends on.
    pub under: Vec<(&'static str, String)>,
}

impl Choice<'_> {
    /// Adds what the choice depends on.
    pub fn on(&self, conditions: Conditions) -> Conditions {
        self.under.iter().fold(conditions, |conditions, (name, value)| conditions.and(name, value))
    }
}

/// The sentence for a campaign that needs nothing more.
pub(crate) fn finished(probings: usize, output: &Path) -> String {
    format!("nothing to do: the campaign is finished, after {probings} probings; its dataset is in {}", output.display())
}
