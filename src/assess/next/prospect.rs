//! A pool before a designer: its best measurements one after the other, and what is to be expected of them.

use std::cell::OnceCell;

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::criterion::Criterion;
use super::designer::Designer;
use super::forecast::{Forecast, WorkspaceOutlook};
use super::pool::Pool;
use super::rival::State;
use super::rivalry::{Determination, Rivalry};
use crate::assess::workspace::SEED;
use crate::identify::IdentifyError;
use crate::math::linalg;

/// Measurements after the artifact was moved that first determine where it stands now.
const SEED_POSES: usize = 4;

/// A pool as a designer sees it.
pub struct Prospect<'a> {
    designer: &'a Designer<'a>,
    pool: &'a Pool,
    /// Whitened columns of the fitted model and the rivals.
    close: OnceCell<DMatrix<f64>>,
    /// Columns of the whole library, of unit numbers; none without a workspace.
    wide: OnceCell<DMatrix<f64>>,
}

impl Designer<'_> {
    /// A pool to choose from.
    pub fn before<'b>(&'b self, pool: &'b Pool) -> Prospect<'b> {
        Prospect { designer: self, pool, close: OnceCell::new(), wide: OnceCell::new() }
    }
}

impl Prospect<'_> {
    /// `count` measurements of the pool by a criterion, in the order in which they are chosen, each with regard to those before; fewer
    /// where the pool has no more, or the criterion nothing to go by.
    ///
    /// After the artifact was moved the first four determine where it stands; else a designer that looks one step ahead would never pay
    /// for them.
    ///
    /// # Errors
    /// When the pool cannot be laid out.
    pub fn choose(&self, criterion: Criterion, count: usize) -> Result<Vec<usize>, IdentifyError> {
        let count = count.min(self.pool.len());
        if let Criterion::Random(seed) = criterion {
            let mut all: Vec<usize> = (0..self.pool.len()).collect();
            all.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
            all.truncate(count);
            return Ok(all);
        }
        let mut chosen = Vec::with_capacity(count);
        let by = |choose: &mut dyn FnMut(&[usize]) -> Option<usize>, chosen: &mut Vec<usize>, wanted: usize| {
            while chosen.len() < wanted {
                let Some(next) = choose(chosen) else { break };
                chosen.push(next);
            }
        };
        let determined = if criterion == Criterion::Determination { count } else { self.seeds().min(count) };
        if determined > 0 {
            let mut determination = Determination::new(&self.state(&self.designer.fitted), self.close()?);
            by(&mut |chosen| determination.choose(chosen), &mut chosen, determined);
        }
        if criterion == Criterion::Discrimination {
            let mut rivalry = Rivalry::new(&self.states(), &self.designer.weights, self.close()?);
            chosen.iter().for_each(|&seed| rivalry.take(seed));
            by(&mut |chosen| rivalry.choose(chosen), &mut chosen, count);
        }
        if criterion == Criterion::Accuracy
            && let Some(workspace) = &self.designer.workspace
        {
            let mut forecast = WorkspaceOutlook::to_choose(&workspace.errors, self.wide()?.clone());
            chosen.iter().for_each(|&seed| forecast.take(seed));
            by(&mut |chosen| forecast.choose(chosen), &mut chosen, count);
        }
        Ok(chosen)
    }

    /// How well the effect will be named after those measurements; `None` without two rivals.
    ///
    /// # Errors
    /// When the pool cannot be laid out.
    pub fn forecast(&self, chosen: &[usize]) -> Result<Option<Forecast>, IdentifyError> {
        if !self.designer.has_rivals() {
            return Ok(None);
        }
        let columns = of_candidates(self.close()?, chosen);
        Ok(Some(Forecast::after(&self.states(), &self.designer.weights, &columns, SEED)?))
    }

    /// Errors expected over the workspace after so many of those measurements, the whole library fitted, mean, m; none when no workspace
    /// was named.
    ///
    /// # Errors
    /// When the pool cannot be laid out.
    pub fn errors_after(&self, chosen: &[usize], steps: &[usize]) -> Result<Vec<f64>, IdentifyError> {
        let Some(workspace) = &self.designer.workspace else { return Ok(Vec::new()) };
        let mut forecast = WorkspaceOutlook::new(&workspace.errors, of_candidates(self.wide()?, chosen));
        let mut errors = Vec::with_capacity(steps.len());
        for k in 0..chosen.len() {
            forecast.take(k);
            if steps.contains(&(k + 1)) {
                errors.push(forecast.mean());
            }
        }
        Ok(errors)
    }

    fn seeds(&self) -> usize {
        if self.pool.artifact_moved { SEED_POSES } else { 0 }
    }

    /// A state with what the pool brings along.
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
            // Between the known numbers and the pool's own stands the residuals' row.
            let mut root = workspace.root.clone().resize(known + 1 + nuisance.len(), known + nuisance.len(), 0.0);
            nuisance.iter().enumerate().for_each(|(k, size)| root[(known + 1 + k, known + k)] = *size);
            Ok(linalg::product_of_transposed(&root, &columns))
        })
    }
}

/// Lays out on the first call.
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

/// Those candidates of three columns each.
fn of_candidates(columns: &DMatrix<f64>, chosen: &[usize]) -> DMatrix<f64> {
    let places: Vec<usize> = chosen.iter().flat_map(|&k| 3 * k..3 * k + 3).collect();
    columns.select_columns(&places)
}
