//! Which measurements of a pool tell rivals apart, or lower the predicted error, most.

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::outlook::{Outlook, WorkspaceOutlook};
use super::pool::Pool;
use super::rival::{Rival, State};
use super::rivalry::{Determination, Rivalry};
use crate::assess::examination::Examination;
use crate::assess::library::Candidate;
use crate::assess::relevance::Relevance;
use crate::assess::workspace::{self, SEED};
use crate::identify::IdentifyError;
use crate::measure::Dataset;

/// Measurements after the artifact was moved that first determine where it stands now.
const SEED_POSES: usize = 4;

/// By what measurements are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// What tells the rivals apart.
    Discrimination,
    /// What lowers the error predicted over the workspace.
    Accuracy,
    /// What determines the fitted model (D-optimality).
    Determination,
    /// Chance, by that seed.
    Random(u64),
}

/// Chooses measurements for an examined robot.
pub struct Designer<'a> {
    examination: &'a Examination,
    /// The same fit with the rivals beside it.
    close: Examination,
    weights: Vec<f64>,
    states: Vec<State>,
    /// Of the fitted model alone.
    fitted: State,
    /// One-sigma of the whitened residuals.
    sigma: f64,
    workspace: Option<Workspace>,
}

/// Errors over the workspace, as far as the data leave them open.
struct Workspace {
    /// Root of the covariance of fitted parameters and candidates.
    root: DMatrix<f64>,
    /// Fields over the workspace times the root.
    errors: DMatrix<f64>,
    sigma: f64,
}

impl<'a> Designer<'a> {
    /// For rivals of an examination; without rivals only [`Criterion::Accuracy`], [`Criterion::Determination`] and
    /// [`Criterion::Random`] choose anything.
    ///
    /// # Errors
    /// When a rival is not in the catalogue, or the data do not determine its state.
    pub fn new(datasets: &[(&str, &Dataset)], examination: &'a Examination, rivals: &[Rival]) -> Result<Self, IdentifyError> {
        let family = |id: &str| id.split(':').next().unwrap_or_default().to_owned();
        let candidates = rivals.iter().map(|r| Candidate { id: r.effect.clone(), family: family(&r.effect) }).collect();
        let close = examination.beside(datasets, candidates)?;
        let remainder = &close.remainder;
        // What the best of the rivals leaves is taken for noise.
        let explained = (0..rivals.len()).map(|k| close.seen(k).explained().0).fold(0.0, f64::max);
        let left = (remainder.squares - explained).max(1e-12 * remainder.squares);
        let variance = left / remainder.dof;
        let states = (0..rivals.len()).map(|k| State::under(Some(k), &close, variance)).collect::<Result<_, _>>()?;
        let fitted = State::under(None, &close, variance)?;
        let weights = rivals.iter().map(|r| r.probability).collect();
        Ok(Designer { examination, close, weights, states, fitted, sigma: variance.sqrt(), workspace: None })
    }

    /// With the error predicted over the workspace, at joint angles `poses` (rad, N), when the whole library is held to the sizes that
    /// the data give it.
    ///
    /// # Errors
    /// When the poses cannot be laid out.
    pub fn with_workspace(
        mut self,
        datasets: &[(&str, &Dataset)],
        relevance: &Relevance,
        poses: &[Vec<f64>],
    ) -> Result<Self, IdentifyError> {
        let Some((_, first)) = datasets.first().filter(|_| !poses.is_empty()) else { return Ok(self) };
        let Examination { projection, .. } = self.examination;
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let there = workspace::at_poses(first, self.examination, poses, &mut random);
        let fields = workspace::fields(&there, self.examination)?;
        let (m, n) = (self.examination.fitted.len(), self.examination.columns.len());
        let mut root = DMatrix::zeros(m + n, m + n);
        let of_fit = projection.root_of_covariance() * relevance.noise.sqrt();
        let absorbed = projection.absorbed(projection.of_columns.clone());
        root.view_mut((0, 0), (m, m)).copy_from(&of_fit);
        root.view_mut((0, m), (m, n)).copy_from(&-(absorbed * &relevance.root));
        root.view_mut((m, m), (n, n)).copy_from(&relevance.root);
        self.workspace = Some(Workspace { errors: fields * &root, root, sigma: relevance.noise.sqrt() });
        Ok(self)
    }

    /// Whether there are rivals to be told apart.
    pub fn has_rivals(&self) -> bool {
        self.states.len() > 1
    }

    /// How well the effect is named as things stand; `None` without two rivals.
    pub fn now(&self) -> Option<Outlook> {
        self.has_rivals().then(|| Outlook::now(&self.weights))
    }

    /// Error expected over the workspace as things stand, the whole library fitted, mean, m; `None` when no workspace was named.
    pub fn error_now(&self) -> Option<f64> {
        let workspace = self.workspace.as_ref()?;
        Some(WorkspaceOutlook::new(&DMatrix::zeros(0, workspace.root.ncols()), &workspace.errors).mean())
    }

    fn states_for(&self, pool: &Pool) -> (Vec<State>, State) {
        let first = self.close.rows.nrows();
        let with = |state: &State| state.with_nuisance(first, pool.nuisance());
        (self.states.iter().map(with).collect(), with(&self.fitted))
    }

    /// `count` measurements of a pool by a criterion, in the order in which they are chosen, each with regard to those before; fewer
    /// where the pool has no more, or the criterion nothing to go by.
    ///
    /// After the artifact was moved the first four determine where it stands; else a designer that looks one step ahead would never pay
    /// for them.
    ///
    /// # Errors
    /// When the pool cannot be laid out.
    pub fn choose(&self, pool: &Pool, criterion: Criterion, count: usize) -> Result<Vec<usize>, IdentifyError> {
        let count = count.min(pool.len());
        if let Criterion::Random(seed) = criterion {
            let mut all: Vec<usize> = (0..pool.len()).collect();
            all.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
            all.truncate(count);
            return Ok(all);
        }
        let columns = pool.columns(&self.close, self.sigma)?;
        let (states, fitted) = self.states_for(pool);
        let mut determination = Determination::new(&fitted, &columns);
        let seeds = if pool.artifact_moved { SEED_POSES.min(count) } else { 0 };
        let mut chosen = Vec::with_capacity(count);
        let by = |choose: &mut dyn FnMut(&[usize]) -> Option<usize>, chosen: &mut Vec<usize>, wanted: usize| {
            while chosen.len() < wanted {
                let Some(next) = choose(chosen) else { break };
                chosen.push(next);
            }
        };
        by(&mut |chosen| determination.choose(chosen), &mut chosen, seeds);
        match criterion {
            Criterion::Discrimination => {
                let mut rivalry = Rivalry::new(&states, &self.weights, &columns);
                chosen.iter().for_each(|&seed| rivalry.take(seed));
                by(&mut |chosen| rivalry.choose(chosen), &mut chosen, count);
            }
            Criterion::Accuracy => {
                if let Some(mut outlook) = self.workspace_outlook(pool)? {
                    chosen.iter().for_each(|&seed| outlook.take(seed));
                    by(&mut |chosen| outlook.choose(chosen), &mut chosen, count);
                }
            }
            _ => by(&mut |chosen| determination.choose(chosen), &mut chosen, count),
        }
        Ok(chosen)
    }

    /// How well the effect will be named after those measurements of a pool; `None` without two rivals.
    ///
    /// # Errors
    /// When the pool cannot be laid out.
    pub fn outlook(&self, pool: &Pool, chosen: &[usize]) -> Result<Option<Outlook>, IdentifyError> {
        if !self.has_rivals() {
            return Ok(None);
        }
        let columns = pool.columns(&self.close, self.sigma)?;
        let places: Vec<usize> = chosen.iter().flat_map(|&k| 3 * k..3 * k + 3).collect();
        let (states, _) = self.states_for(pool);
        Ok(Some(Outlook::after(&states, &self.weights, &columns.select_columns(&places), SEED)?))
    }

    /// Errors expected over the workspace after so many of those measurements, the whole library fitted, mean, m; none when no workspace
    /// was named.
    ///
    /// # Errors
    /// When the pool cannot be laid out.
    pub fn errors_after(&self, pool: &Pool, chosen: &[usize], steps: &[usize]) -> Result<Vec<f64>, IdentifyError> {
        let Some(mut outlook) = self.workspace_outlook(pool)? else { return Ok(Vec::new()) };
        let mut errors = Vec::with_capacity(steps.len());
        for (k, &candidate) in chosen.iter().enumerate() {
            outlook.take(candidate);
            if steps.contains(&(k + 1)) {
                errors.push(outlook.mean());
            }
        }
        Ok(errors)
    }

    fn workspace_outlook(&self, pool: &Pool) -> Result<Option<WorkspaceOutlook>, IdentifyError> {
        let Some(Workspace { root, errors, sigma }) = &self.workspace else { return Ok(None) };
        let columns = pool.columns(self.examination, *sigma)?;
        let known = root.nrows();
        let mut seen = columns.rows(0, known).tr_mul(root);
        let mut errors = errors.clone();
        let nuisance = pool.nuisance();
        seen = seen.resize_horizontally(known + nuisance.len(), 0.0);
        errors = errors.resize_horizontally(known + nuisance.len(), 0.0);
        for (k, size) in nuisance.iter().enumerate() {
            for i in 0..seen.nrows() {
                seen[(i, known + k)] = columns[(known + 1 + k, i)] * size;
            }
        }
        Ok(Some(WorkspaceOutlook::new(&seen, &errors)))
    }
}
