//! A campaign that measures no more than it needs: after every few samples the model is identified, the error that the robot
//! will have over its workspace is predicted, and the campaign ends when that is small enough, or goes on with the poses that
//! reduce it most.
//!
//! The prediction is that of every other verb ([`WorkspaceError`]): noise, and what the model may lack, drawn from what the
//! samples say of both. Its 90 % quantile is compared with the requested one.
//!
//! From few samples, effects that the model lacks are hardly distinguished from those that it has, and the prediction may
//! double or halve from one look to the next. A campaign that ended at the first good one would end at a lucky one: the last
//! [`LOOKS`] must all be good.

use super::designer::{Criterion, Designer};
use super::pool::Pool;
use super::rivalry::first_choice;
use crate::diagnosis::Examination;
use crate::diagnosis::Relevance;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::Outcome;
use crate::measure::dataset::{Dataset, NamedDataset, Sample};
use crate::measure::poses::PlannedPose;
use crate::prediction::{Banded, WorkspaceError, WorkspacePoses};

/// Samples between two predictions (decision 0036).
const BATCH: usize = 4;

/// Samples before the first prediction, beyond those that the unknowns need at least.
const SPARE: usize = 5;

/// Number of successive predictions that must be as good as requested (docs/adaptive.md).
pub const LOOKS: usize = 4;

/// Precision that a campaign has reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// Number of samples.
    pub samples: usize,
    /// Mean position error expected over the workspace, m, with its 10 and 90 % quantiles.
    pub mean: Banded,
}

/// The choice of the next pose of a campaign, and of its end.
#[derive(Debug, Clone)]
pub struct Adaptive {
    cell: Dataset,
    model: Model,
    /// Mean error over the workspace that is requested, m.
    wanted: f64,
    /// Joints over the workspace, rad (N).
    poses: WorkspacePoses,
    /// Samples before the first prediction.
    first: usize,
    /// Ids of the poses to come, the next one first.
    ahead: Vec<String>,
    reached: Vec<Reached>,
}

impl Adaptive {
    /// For the cell described by a dataset, whose samples are ignored: `model` is to be identified so well that the mean
    /// position error over the workspace is below `wanted` (m) with a probability of 90 %.
    pub fn new(cell: &Dataset, model: &Model, wanted: f64) -> Self {
        let cell = Dataset { samples: Vec::new(), ..cell.clone() };
        let poses = WorkspacePoses::over_limits(&[NamedDataset::new("", &cell)]);
        Adaptive { cell, model: model.clone(), wanted, poses, first: 0, ahead: Vec::new(), reached: Vec::new() }
    }

    /// The predictions so far.
    pub fn reached(&self) -> &[Reached] {
        &self.reached
    }

    /// True if the error is as small as requested, by all of the last [`LOOKS`] predictions.
    pub fn is_enough(&self) -> bool {
        let last = self.reached.len().checked_sub(LOOKS).map(|first| &self.reached[first..]);
        last.is_some_and(|last| last.iter().all(|reached| reached.mean.high <= self.wanted))
    }

    /// The pose to measure next, by its place among the waiting ones; `None` if the samples are enough.
    ///
    /// Depends on the waiting poses and the samples alone, if asked after every sample from the first on.
    ///
    /// # Errors
    /// When the waiting poses do not fit the model.
    pub fn next(&mut self, waiting: &[&PlannedPose], measured: &[Sample]) -> Result<Option<usize>, IdentifyError> {
        let waiting: Vec<Sample> = waiting.iter().filter_map(|pose| pose.nominal_sample()).collect();
        let waiting = waiting.as_slice();
        let place = |ahead: &[String]| ahead.first().and_then(|id| waiting.iter().position(|s| s.id == *id));
        if measured.is_empty() {
            self.begin(waiting)?;
        }
        let beyond = measured.len().checked_sub(self.first);
        if beyond.is_some_and(|beyond| beyond % BATCH == 0) {
            self.think(waiting, measured)?;
            if self.is_enough() {
                return Ok(None);
            }
        }
        let next = place(&self.ahead);
        if next.is_some() {
            self.ahead.remove(0);
        }
        // A pose may have failed, and be waited for no more.
        Ok(next.or(Some(0)))
    }

    /// Predicts the error from all that was measured, and from a little less: a campaign asks for no pose after its last one,
    /// and one that was finished before asks for none at all.
    ///
    /// # Errors
    /// When the samples do not fit the model.
    pub fn judge(&mut self, measured: &[Sample]) -> Result<(), IdentifyError> {
        if self.is_enough() && self.reached.last().is_some_and(|reached| reached.samples == measured.len()) {
            return Ok(());
        }
        self.reached.clear();
        for look in (0..LOOKS).rev() {
            self.think(&[], &measured[..measured.len().saturating_sub(look * BATCH)])?;
        }
        Ok(())
    }

    /// Chooses the poses that determine the model best, before anything is measured.
    fn begin(&mut self, waiting: &[Sample]) -> Result<(), IdentifyError> {
        let planned = Dataset { samples: waiting.to_vec(), ..self.cell.clone() };
        let plan = Examination::of_plan(&planned, &self.model)?;
        self.first = (plan.fitted.len() / 3 + SPARE).min(waiting.len());
        let chosen = first_choice(&plan, self.first)?;
        self.ahead = names(&chosen, waiting);
        self.reached.clear();
        Ok(())
    }

    /// Predicts the error over the workspace, and chooses the poses that reduce it most.
    fn think(&mut self, waiting: &[Sample], measured: &[Sample]) -> Result<(), IdentifyError> {
        let of = |samples: &[Sample]| Dataset { samples: samples.to_vec(), ..self.cell.clone() };
        let so_far = of(measured);
        let datasets = [NamedDataset::new("campaign", &so_far)];
        // Too few samples, or such that do not determine the model, are not a reason to stop.
        let Ok(examination) = Examination::new(&datasets, &self.model) else { return Ok(()) };
        if examination.fit.outcome != Outcome::Converged {
            return Ok(());
        }
        let Some(error) = WorkspaceError::predict(&datasets, &examination, &self.poses)? else { return Ok(()) };
        self.reached.push(Reached { samples: measured.len(), mean: error.mean });
        if self.is_enough() || waiting.is_empty() {
            return Ok(());
        }
        let relevance = Relevance::new(&examination)?;
        let designer = Designer::new(&datasets, &examination, &[])?.with_workspace(&datasets, &relevance, &self.poses.q)?;
        let pool = Pool { dataset: of(waiting), artifact_moved: false };
        let chosen = designer.before(&pool).choose(Criterion::Accuracy, BATCH)?;
        self.ahead = names(&chosen, waiting);
        Ok(())
    }
}

/// Ids of the chosen samples, in the order of the choice.
fn names(chosen: &[usize], waiting: &[Sample]) -> Vec<String> {
    chosen.iter().filter_map(|&k| waiting.get(k)).map(|s| s.id.clone()).collect()
}
