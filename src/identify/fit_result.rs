//! Result of a fit: values and uncertainties, how it ended, or why there is none.

use nalgebra::DMatrix;
use thiserror::Error;

use super::problem::{Parameter, Prior};
use crate::math::Observability;
use crate::math::linalg::LinalgError;

/// Outcome of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outcome {
    /// At a minimum: the gradient is negligible in units of the uncertainty.
    Converged,
    /// No step lowers chi-square any more, although its gradient indicates that one should.
    Stalled,
    /// The step limit was reached.
    IterationLimit,
    /// Some correction exceeds the validity of the model's linear effects.
    LeftLinearRange,
}

impl Outcome {
    /// All outcomes, with their names in files.
    pub const ALL: [(Outcome, &'static str); 4] = [
        (Outcome::Converged, "converged"),
        (Outcome::Stalled, "stalled"),
        (Outcome::IterationLimit, "iteration_limit"),
        (Outcome::LeftLinearRange, "left_linear_range"),
    ];

    /// The name in files and JSON.
    pub fn name(self) -> &'static str {
        Outcome::ALL[self as usize].1
    }

    /// A verb phrase for messages.
    pub fn in_words(self) -> &'static str {
        match self {
            Outcome::Converged => "converged",
            Outcome::Stalled => "stalled: no step lowers chi-square, although its gradient says that one should",
            Outcome::IterationLimit => "used up its steps before it converged",
            Outcome::LeftLinearRange => "left the linear range of the model: a correction is larger than its effect can mean",
        }
    }
}

/// The reason why there is no fit.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum FitError {
    /// No redundant residual remains to judge the unknowns by.
    #[error("{rows} residuals are too few for {unknowns} unknowns; measure more poses or use a smaller model")]
    TooFewRows {
        /// Scalar residuals.
        rows: usize,
        /// Unknowns.
        unknowns: usize,
    },
    /// A residual or the Jacobian is not finite.
    #[error("the residuals are not finite at the start of the fit; check joint angles and positions for absurd values")]
    NotFinite,
    /// The normal matrix could not be factored.
    #[error("the normal equations are singular although the columns are independent; the data are too badly scaled")]
    Singular,
    /// A model with more effects fits worse than the one without them.
    #[error(
        "calibench found itself inconsistent: a larger model leaves chi-square {after:.6e} where a smaller one leaves {before:.6e}; report this with the data and the model"
    )]
    WorseThanSmaller {
        /// Of the smaller model.
        before: f64,
        /// Of the larger one.
        after: f64,
    },
    /// A decomposition failed.
    #[error(transparent)]
    Linalg(#[from] LinalgError),
}

/// Parameters that the data cannot separate: the one left at its nominal value, then those aliased with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Unresolved {
    /// The parameter that was left out.
    pub parameter: usize,
    /// Parameters that move the residuals in the same way, strongest first; empty if the parameter moves none at all.
    pub with: Vec<usize>,
}

/// Result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Deviation of every parameter from the start of the fit, SI; zero for those left out.
    pub values: Vec<f64>,
    /// Estimated parameters, ascending.
    pub kept: Vec<usize>,
    /// Covariance of the kept parameters, SI (kept x kept).
    pub covariance: DMatrix<f64>,
    /// Parameters that could not be separated.
    pub unresolved: Vec<Unresolved>,
    /// Root mean square of the 3-D residual over samples, m.
    pub rms: f64,
    /// Root mean square of the angles by which measured orientations deviate, rad; `None` if none were measured.
    pub rms_orientation: Option<f64>,
    /// Whitened sum of squares, stated parameters included.
    pub chi2: f64,
    /// Residuals minus flat unknowns.
    pub dof: usize,
    /// True if `covariance` rests on stated noise; otherwise it is scaled by chi2/dof.
    pub noise_stated: bool,
    /// Number of Gauss-Newton steps.
    pub iterations: usize,
    /// Outcome of the fit.
    pub outcome: Outcome,
    /// Observability indices of the flat parameters at the solution, in SI.
    pub observability: Observability,
    /// Condition number of their column-scaled Jacobian.
    pub condition: f64,
}

impl Fit {
    /// Standard uncertainty of a parameter, SI; `None` if it was left out.
    pub fn sigma(&self, parameter: usize) -> Option<f64> {
        let k = self.kept.binary_search(&parameter).ok()?;
        Some(self.covariance[(k, k)].max(0.0).sqrt())
    }

    /// Number of flat parameters estimated.
    pub fn rank(&self, parameters: &[Parameter]) -> usize {
        self.kept.iter().filter(|&&p| parameters[p].knowledge == Prior::Uninformative).count()
    }
}
