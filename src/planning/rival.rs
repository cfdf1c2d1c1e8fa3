//! Rival effects, each with the state of knowledge that the data imply if it is the missing one.

use nalgebra::{DMatrix, DVector};

use crate::diagnosis::Diagnosis;
use crate::diagnosis::Examination;
use crate::effects::EffectId;
use crate::identify::BACKGROUND_WIDTH;
use crate::identify::fit::FitError;
use crate::math::linalg;
use crate::math::positive_definite::ScaledCholesky;

/// Largest number of rivals distinguished at once; those beyond the sixth hold a few per cent of the probability.
const MOST: usize = 6;

/// An effect that may be the missing one.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival {
    /// Id of the effect in a model.
    pub effect: EffectId,
    /// Probability that it is the missing effect, given that one of the rivals is.
    pub probability: f64,
}

impl Rival {
    /// Returns the credible set of a diagnosis, six effects at most; empty if the diagnosis names none. A set of fewer
    /// than `least` effects is extended by the next most probable ones.
    pub fn of(diagnosis: &Diagnosis, least: usize) -> Vec<Rival> {
        if !diagnosis.verdict.names_effects() {
            return Vec::new();
        }
        let count = diagnosis.set95.len().max(least).min(MOST);
        let members = &diagnosis.findings[..count.min(diagnosis.findings.len())];
        let whole: f64 = members.iter().map(|f| f.probability).sum();
        let rival = |f: &crate::diagnosis::Finding| Rival {
            effect: f.hypothesis.in_model.clone(),
            probability: f.probability / whole.max(f64::MIN_POSITIVE),
        };
        members.iter().map(rival).collect()
    }
}

/// Knowledge of the parameters of the fitted model and of one additional effect with its ordinary prior width: normal
/// distribution of the deviations from the fit.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// Rows of the examination's whitened columns that belong to the parameters.
    pub rows: Vec<usize>,
    pub mean: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

impl State {
    /// Computes the state with candidate `effect` of an examination, or with none; `variance` is that of the whitened
    /// residuals.
    pub fn under(effect: Option<usize>, examination: &Examination, variance: f64) -> Result<Self, FitError> {
        let Examination { rows, fitted, fit, problem, spans, .. } = examination;
        let m = fitted.len();
        let columns = effect.map(|k| spans[k].range()).into_iter().flatten();
        let own: Vec<usize> = (0..m).chain(columns.map(|c| m + c)).collect();
        let size = own.len();
        let mut information = DMatrix::zeros(size, size);
        let with_residual: Vec<usize> = own.iter().copied().chain([rows.nrows() - 1]).collect();
        let chosen = rows.select_rows(&with_residual);
        let mut products = DMatrix::zeros(size + 1, size + 1);
        linalg::normal_matrix(&chosen, &mut products);
        information.copy_from(&products.view((0, 0), (size, size)));
        information /= variance;
        let mut gradient = products.view((0, size), (size, 1)).column(0) / variance;
        for (k, &p) in fit.kept.iter().enumerate() {
            let known = problem.information(p);
            information[(k, k)] += known;
            gradient[k] -= known * fit.values[p];
        }
        (m..size).for_each(|k| information[(k, k)] += BACKGROUND_WIDTH.powi(-2));
        let covariance = ScaledCholesky::of(&information)?.inverse();
        Ok(State { rows: own, mean: &covariance * gradient, covariance })
    }

    /// Returns the state extended by further parameters, of which only their one-sigma `sizes` are known.
    pub fn with_nuisance(&self, first_row: usize, sizes: &[f64]) -> Self {
        let (old, new) = (self.mean.len(), self.mean.len() + sizes.len());
        let mut state = State {
            rows: self.rows.iter().copied().chain(first_row..first_row + sizes.len()).collect(),
            mean: self.mean.clone().resize_vertically(new, 0.0),
            covariance: self.covariance.clone().resize(new, new, 0.0),
        };
        sizes.iter().enumerate().for_each(|(k, size)| state.covariance[(old + k, old + k)] = size * size);
        state
    }
}
