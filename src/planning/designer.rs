//! Knowledge of a robot, for the choice of measurements that best distinguish rivals or most reduce the predicted
//! error.

pub use super::prospect::Criterion;

use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::forecast::{Forecast, WorkspaceErrors};
use super::rival::{Rival, State};
use crate::diagnosis::Examination;
use crate::diagnosis::Relevance;
use crate::diagnosis::library::Candidate;
use crate::identify::calibration::IdentifyError;
use crate::math::linalg;
use crate::measure::dataset::NamedDataset;
use crate::prediction::poses::{self, SEED};
use crate::prediction::workspace;

/// Chooses measurements for an examined robot.
pub struct Designer<'a> {
    pub(super) examination: &'a Examination,
    /// The same fit, with the rivals as candidates.
    pub(super) close: Examination,
    pub(super) weights: Vec<f64>,
    pub(super) states: Vec<State>,
    /// State of the fitted model alone.
    pub(super) fitted: State,
    /// One-sigma of the whitened residuals.
    pub(super) sigma: f64,
    pub(super) workspace: Option<Workspace>,
}

/// The error predicted over the workspace.
pub(super) struct Workspace {
    /// Root of the covariance of fitted parameters and candidates.
    pub root: DMatrix<f64>,
    /// Errors as functions of the unit parameters of `root`.
    pub errors: WorkspaceErrors,
    pub sigma: f64,
}

impl<'a> Designer<'a> {
    /// Prepares the choice of measurements for the rivals of an examination. Without rivals only
    /// [`Criterion::Accuracy`],
    /// [`Criterion::Determination`] and
    /// [`Criterion::Random`] choose any.
    ///
    /// # Errors
    /// When a rival is not in the catalogue, or the data do not determine its state.
    pub fn new(datasets: &[NamedDataset<'_>], examination: &'a Examination, rivals: &[Rival]) -> Result<Self, IdentifyError> {
        let candidates = rivals.iter().map(|r| Candidate::new(r.effect.clone())).collect();
        let close = examination.beside(datasets, candidates)?;
        let remainder = &close.remainder;
        // The residual that remains with the best rival is regarded as noise.
        let explained = (0..rivals.len()).map(|k| close.seen(k).explained().0).fold(0.0, f64::max);
        let left = (remainder.squares - explained).max(1e-12 * remainder.squares);
        let variance = left / remainder.dof;
        let states = (0..rivals.len()).map(|k| State::under(Some(k), &close, variance)).collect::<Result<_, _>>()?;
        let fitted = State::under(None, &close, variance)?;
        let weights = rivals.iter().map(|r| r.probability).collect();
        Ok(Designer { examination, close, weights, states, fitted, sigma: variance.sqrt(), workspace: None })
    }

    /// Adds the prediction of the error over the workspace, at joint angles `poses` (rad, N), with the whole library
    /// fitted and every effect regularised by the size estimated from the data.
    ///
    /// # Errors
    /// When the Jacobian at the poses cannot be computed.
    pub fn with_workspace(
        mut self,
        datasets: &[NamedDataset<'_>],
        relevance: &Relevance,
        poses: &[Vec<f64>],
    ) -> Result<Self, IdentifyError> {
        let Some(NamedDataset { dataset: first, .. }) = datasets.first().filter(|_| !poses.is_empty()) else { return Ok(self) };
        let Examination { projection, .. } = self.examination;
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let there = poses::at_poses(first, self.examination, poses, &mut random);
        let fields = workspace::fields(&there, self.examination)?;
        let (m, n) = (self.examination.fitted.len(), self.examination.columns.len());
        let mut root = DMatrix::zeros(m + n, m + n);
        let of_fit = projection.root_of_covariance() * relevance.noise.sqrt();
        let absorbed = projection.absorbed(projection.of_columns.clone());
        root.view_mut((0, 0), (m, m)).copy_from(&of_fit);
        root.view_mut((0, m), (m, n)).copy_from(&-(absorbed * &relevance.root));
        root.view_mut((m, m), (n, n)).copy_from(&relevance.root);
        self.workspace = Some(Workspace {
            errors: WorkspaceErrors::new(linalg::product(&fields, &root)),
            root,
            sigma: relevance.noise.sqrt(),
        });
        Ok(self)
    }

    /// True if there are at least two rivals to distinguish.
    pub fn has_rivals(&self) -> bool {
        self.states.len() > 1
    }

    /// Forecast without further measurements: how well the effect is named now; `None` with fewer than two rivals.
    pub fn now(&self) -> Option<Forecast> {
        self.has_rivals().then(|| Forecast::now(&self.weights))
    }

    /// Mean error expected over the workspace without further measurements, with the whole library fitted, m; `None`
    /// without a workspace.
    pub fn error_now(&self) -> Option<f64> {
        let workspace = self.workspace.as_ref()?;
        Some(workspace.errors.mean_after([].iter()))
    }
}
