//! All candidates fitted at once, each with a size of its own that the data tell: automatic relevance determination by group.
//!
//! One variance a candidate, with a weak inverse-gamma prior; the updates are those of expectation maximisation (MacKay 1992,
//! Tipping 2001). A whole library fitted so predicts where the model errs; one candidate after the other by least squares does not.

use nalgebra::{DMatrix, DVector};

use super::background::Background;
use super::examination::{Examination, Span};
use crate::identify::FitError;
use crate::math::linalg;

/// Weight of the inverse-gamma prior of a variance, in coefficients. Its centre is the size of the ordinary small stuff of this robot:
/// what the data do not see is taken to be about as large as what they see.
const PRIOR_WEIGHT: f64 = 1.5;

/// No robot is better than this, in plausible sizes, where nothing was seen of it.
const LEAST: f64 = 0.1;

/// Rounds; the largest share of a variance that still changes after 25 is a few per cent.
const ROUNDS: usize = 25;

/// The fit of the whole library.
#[derive(Debug, Clone)]
pub struct Relevance {
    /// One-sigma of each candidate, in plausible sizes.
    pub width: Vec<f64>,
    /// Coefficients of all candidates, in plausible sizes.
    pub mean: DVector<f64>,
    /// Their covariance is `root root^T`.
    pub root: DMatrix<f64>,
    /// Variance of the whitened residuals; one where the noise is as stated.
    pub noise: f64,
    /// Squares that each candidate takes: its contribution to what the model leaves.
    pub energy: Vec<f64>,
}

impl Relevance {
    /// Fits all candidates of an examination to what its model leaves.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn new(examination: &Examination) -> Result<Self, FitError> {
        Relevance::beside(examination, &Background::new(examination)?)
    }

    /// The same, where the background is known.
    pub(super) fn beside(examination: &Examination, background: &Background) -> Result<Self, FitError> {
        let Examination { gram, z, spans, remainder, .. } = examination;
        let n = z.len();
        let ordinary = background.mean_square().max(LEAST * LEAST);
        let mut width2 = vec![ordinary; spans.len()];
        let mut noise = remainder.unit();
        let mut factor = linalg::Cholesky::new(n);
        let mut inverse = DMatrix::zeros(n, n);
        let mut mean = DVector::zeros(n);
        let mut spread = DMatrix::zeros(n, n);
        for _ in 0..ROUNDS {
            let mut root = DVector::zeros(n);
            for (span, w) in spans.iter().zip(&width2) {
                span.range().for_each(|k| root[k] = w.sqrt());
            }
            // M = sigma² I + G^1/2 K G^1/2
            let mut m = DMatrix::from_fn(n, n, |r, c| gram[(r, c)] * root[r] * root[c]);
            for k in 0..n {
                m[(k, k)] += noise;
            }
            factor.factor(&m)?;
            factor.inverse(&mut inverse);
            let covariance = DMatrix::from_fn(n, n, |r, c| noise * inverse[(r, c)] * root[r] * root[c]);
            factor.inverse_root(&mut spread);
            spread.row_iter_mut().zip(&root).for_each(|(mut row, r)| row *= noise.sqrt() * r);
            mean = &covariance * z / noise;
            let explained = 2.0 * mean.dot(z) - (gram * &mean).dot(&mean);
            let effective: f64 = (0..n).map(|k| 1.0 - noise * inverse[(k, k)]).sum();
            noise = (remainder.squares - explained).max(1e-9 * remainder.squares) / (remainder.dof - effective).max(1.0);
            for (span, w) in spans.iter().zip(&mut width2) {
                let spread: f64 = span.range().map(|k| mean[k].powi(2) + covariance[(k, k)]).sum();
                *w = (spread + PRIOR_WEIGHT * ordinary) / (span.count as f64 + PRIOR_WEIGHT);
            }
        }
        let energy = spans.iter().map(|span| energy(gram, &mean, *span)).collect();
        Ok(Relevance { width: width2.iter().map(|w| w.sqrt()).collect(), mean, root: spread, noise, energy })
    }
}

/// `|G_k mu_k|²`.
fn energy(gram: &DMatrix<f64>, mean: &DVector<f64>, span: Span) -> f64 {
    let own = mean.rows(span.first, span.count);
    (gram.view((span.first, span.first), (span.count, span.count)) * own).dot(&own)
}
