//! Joint fit of all candidates, each with a size estimated from the data: automatic relevance determination by group.
//!
//! Each candidate has one variance, with a weak inverse-gamma prior; the updates are those of expectation maximisation
//! (MacKay 1992, Tipping 2001). A whole library fitted in this way predicts the robot's errors; least-squares fits of
//! one candidate after the other do not.

use nalgebra::{DMatrix, DVector};

use super::background::Background;
use super::examination::{Examination, Span};
use crate::identify::fit::FitError;
use crate::math::linalg;

/// Weight of the inverse-gamma prior of a variance, in coefficients. Its centre is the size of this robot's background:
/// effects that the data do not show are assumed to be about as large as those that they show.
const PRIOR_WEIGHT: f64 = 1.5;

/// Smallest size of the background in this prior, in plausible sizes: no robot is assumed to be better than this (decision
/// 0013).
const LEAST: f64 = 0.1;

/// Number of iterations; after 25 no variance changes by more than a few per cent.
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
    /// Variance of the whitened residuals; 1 if the noise is as stated.
    pub noise: f64,
    /// Sum of squares that each candidate explains: its contribution to the residual of the model.
    pub energy: Vec<f64>,
}

impl Relevance {
    /// Fits all candidates of an examination to the residual of its model.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn new(examination: &Examination) -> Result<Self, FitError> {
        Relevance::beside(examination, &Background::new(examination)?)
    }

    /// As [`Relevance::new`], with a background that is already computed.
    pub(crate) fn beside(examination: &Examination, background: &Background) -> Result<Self, FitError> {
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
