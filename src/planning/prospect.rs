//! A pool as evaluated by a designer: its best measurements in order, and their expected outcome.

use std::cell::OnceCell;

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::designer::Designer;
use super::forecast::{Forecast, WorkspaceOutlook};
use super::pool::Pool;
use super::rival::State;
use super::rivalry::{Determination, Rivalry};
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::FitError;
use crate::math::linalg::{self, LinalgError};
use crate::prediction::poses::SEED;

/// Number of measurements that first determine the pose of a moved artifact.
const SEED_POSES: usize = 4;

/// Criterion by which measurements are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// Best discrimination between the rivals.
    Discrimination,
    /// Smallest error predicted over the workspace.
    Accuracy,
    /// Best determination of the fitted model (D-optimality).
    Determination,
    /// Random choice with this seed.
    Random(u64),
}

/// A pool as evaluated by a designer.
pub struct Prospect<'a> {
    designer: &'a Designer<'a>,
    pool: &'a Pool,
    /// Whitened columns of the fitted model and the rivals.
    close: OnceCell<DMatrix<f64>>,
    /// Columns of the whole library, for parameters of unit variance; empty without a workspace.
    wide: OnceCell<DMatrix<f64>>,
}

impl Designer<'_> {
    /// Prepares the choice from a pool.
    pub fn before<'b>(&'b self, pool: &'b Pool) -> Prospect<'b> {
        Prospect { designer: self, pool, close: OnceCell::new(), wide: OnceCell::new() }
    }
}

impl Prospect<'_> {
    /// Chooses `count` measurements of the pool by a criterion, one after the other, each given those before it. Fewer
    /// are returned if the pool contains fewer, or if the criterion is not applicable.
    ///
    /// If the artifact was moved, the first four (unless the choice is random) determine its pose: a search one step
    /// ahead would never spend measurements on that.
    ///
    /// # Errors
    /// When the columns of the pool cannot be computed.
    pub fn choose(&self, criterion: Criterion, count: usize) -> Result<Vec<usize>, IdentifyError> {
        let count = count.min(self.pool.len());
        if let Criterion::Random(seed) = criterion {
            let mut all: Vec<usize> = (0..self.pool.len()).collect();
            all.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
            all.truncate(count);
            return Ok(all);
        }
        let mut chosen = Vec::with_capacity(count);
        type Choose<'c> = &'c mut dyn FnMut(&[usize]) -> Result<Option<usize>, LinalgError>;
        let by = |choose: Choose<'_>, chosen: &mut Vec<usize>, wanted: usize| -> Result<(), FitError> {
            while chosen.len() < wanted {
                let Some(next) = choose(chosen)? else { break };
                chosen.push(next);
            }
            Ok(())
        };
        let determined = if criterion == Criterion::Determination { count } else { self.seeds().min(count) };
        if determined > 0 {
            let mut determination = Determination::new(&self.state(&self.designer.fitted), self.close()?);
            by(&mut |chosen| determination.choose(chosen), &mut chosen, determined)?;
        }
        if criterion == Criterion::Discrimination {
            let mut rivalry = Rivalry::new(&self.states(), &self.designer.weights, self.close()?);
            chosen.iter().try_for_each(|&seed| rivalry.take(seed)).map_err(FitError::from)?;
            by(&mut |chosen| rivalry.choose(chosen), &mut chosen, count)?;
        }
        if criterion == Criterion::Accuracy
            && let Some(workspace) = &self.designer.workspace
        {
            let mut forecast = WorkspaceOutlook::to_choose(&workspace.errors, self.wide()?.clone());
            chosen.iter().try_for_each(|&seed| forecast.take(seed)).map_err(FitError::from)?;
            by(&mut |chosen| forecast.choose(chosen), &mut chosen, count)?;
        }
        Ok(chosen)
    }

    /// Forecasts how well the effect will be named after the chosen measurements; `None` with fewer than two rivals.
    ///
    /// # Errors
    /// When the columns of the pool cannot be computed.
    pub fn forecast(&self, chosen: &[usize]) -> Result<Option<Forecast>, IdentifyError> {
        if !self.designer.has_rivals() {
            return Ok(None);
        }
        let columns = of_candidates(self.close()?, chosen);
        Ok(Some(Forecast::after(&self.states(), &self.designer.weights, &columns, SEED)?))
    }

    /// Mean error expected over the workspace after the first `steps` of the chosen measurements, with the whole
    /// library fitted, m; one entry per number in `steps`, none without a workspace.
    ///
    /// # Errors
    /// When the columns of the pool cannot be computed.
    pub fn errors_after(&self, chosen: &[usize], steps: &[usize]) -> Result<Vec<f64>, IdentifyError> {
        let Some(workspace) = &self.designer.workspace else { return Ok(Vec::new()) };
        let mut forecast = WorkspaceOutlook::new(&workspace.errors, of_candidates(self.wide()?, chosen));
        let mut errors = Vec::with_capacity(steps.len());
        for k in 0..chosen.len() {
            forecast.take(k).map_err(FitError::from)?;
            if steps.contains(&(k + 1)) {
                errors.push(forecast.mean());
            }
        }
        Ok(errors)
    }

    fn seeds(&self) -> usize {
        if self.pool.artifact_moved { SEED_POSES } else { 0 }
    }

    /// Extends a state by the nuisance parameters of the pool.
    fn state(&self, state: &State) -> State {
        state.with_nuisance(self.designer.close.rows.nrows(), self.pool.nuisance())
    }

    fn states(&self) -> Vec<State> {
        self.designer.states.iter().map(|state| self.state(state)).collect()
    }

    fn close(&self) -> Result<&DMatrix<f64>, IdentifyError> {
        laid_out(&self.close, || self.pool.columns(&self.designer.close, self.designer.sigma))
    }

    fn wide(&self) -> Result<&DMatrix<f64>, IdentifyError> {
        laid_out(&self.wide, || {
            let Some(workspace) = &self.designer.workspace else { return Ok(DMatrix::zeros(0, 0)) };
            let columns = self.pool.columns(self.designer.examination, workspace.sigma)?;
            let (known, nuisance) = (workspace.root.nrows(), self.pool.nuisance());
            // The row of the residuals lies between the examination's parameters and those of the pool.
            let mut root = workspace.root.clone().resize(known + 1 + nuisance.len(), known + nuisance.len(), 0.0);
            nuisance.iter().enumerate().for_each(|(k, size)| root[(known + 1 + k, known + k)] = *size);
            Ok(linalg::product_of_transposed(&root, &columns))
        })
    }
}

/// Computes the columns on the first call.
fn laid_out(
    cell: &OnceCell<DMatrix<f64>>,
    lay_out: impl FnOnce() -> Result<DMatrix<f64>, IdentifyError>,
) -> Result<&DMatrix<f64>, IdentifyError> {
    match cell.get() {
        Some(columns) => Ok(columns),
        None => {
            let columns = lay_out()?;
            Ok(cell.get_or_init(|| columns))
        }
    }
}

/// Selects the chosen candidates, three columns each.
fn of_candidates(columns: &DMatrix<f64>, chosen: &[usize]) -> DMatrix<f64> {
    let places: Vec<usize> = chosen.iter().flat_map(|&k| 3 * k..3 * k + 3).collect();
    columns.select_columns(&places)
}
