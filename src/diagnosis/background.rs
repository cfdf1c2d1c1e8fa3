//! The model discrepancy (background) that every robot has: all candidates at once, at a common fraction of their
//! plausible sizes.
//!
//! Tested against noise alone, the best of seventy candidates stands out even for an ordinary robot: any of them
//! explains the residual a little better than noise does. Against a background of all others with a common size tau,
//! only unusual effects stand out. Model discrepancy as a random field: Kennedy & O'Hagan 2001; Brynjarsdottir &
//! O'Hagan 2014.

use nalgebra::{DMatrix, DVector};

use super::evidence::{Remainder, Seen, ln_sum_exp};
use super::examination::Examination;
use crate::identify::fit::FitError;
use crate::math::linalg;

/// Sizes of the background, in plausible sizes; zero means no background.
pub(crate) const SIZES: [f64; 7] = [0.0, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6];

/// The columns of the background in their principal directions.
pub(crate) struct Background {
    /// Indices of the background's columns in the examination: all except those of effects that belong to every model,
    /// which are not small.
    columns: Vec<usize>,
    vectors: DMatrix<f64>,
    /// Variance of each principal direction under each size of the background.
    weights: [DVector<f64>; SIZES.len()],
    /// Inner products with the remainder, in the principal directions.
    b: DVector<f64>,
    /// Remainder at each size, and the log evidence of that size.
    pub remainders: Vec<Remainder>,
    pub ln_evidence: Vec<f64>,
}

impl Background {
    /// Builds the background for a fitted model.
    ///
    /// # Errors
    /// When the inner products are not finite.
    pub fn new(examination: &Examination) -> Result<Self, FitError> {
        let Examination { gram, z, remainder, library, spans, .. } = examination;
        let small = library.candidates.iter().zip(spans).filter(|(c, _)| examination.model.is_background_width(&c.id));
        let columns: Vec<usize> = small.flat_map(|(_, span)| span.range()).collect();
        let (values, vectors) = linalg::symmetric_eigen(&gram.select_columns(&columns).select_rows(&columns))?;
        let lambda = values.map(|l| l.max(0.0));
        let b = vectors.tr_mul(&z.select_rows(&columns));
        let mut remainders = Vec::new();
        let mut ln_evidence = Vec::new();
        let weights = SIZES.map(|tau| lambda.map(|l| tau * tau / (1.0 + tau * tau * l)));
        for (tau, weight) in SIZES.into_iter().zip(&weights) {
            let t2 = tau * tau;
            let taken: f64 = weight.iter().zip(&b).map(|(w, b)| w * b * b).sum();
            let volume: f64 = lambda.iter().map(|l| -0.5 * (t2 * l).ln_1p()).sum();
            ln_evidence.push(volume + remainder.gain(taken));
            remainders.push(Remainder { squares: (remainder.squares - taken).max(1e-12 * remainder.squares), ..*remainder });
        }
        Ok(Background { columns, vectors, weights, b, remainders, ln_evidence })
    }

    /// Transforms columns, given by their inner products with all columns of the examination, to the background's
    /// principal directions.
    pub fn along(&self, cross: &DMatrix<f64>) -> DMatrix<f64> {
        linalg::product_of_transposed(&self.vectors, &cross.select_rows(&self.columns))
    }

    /// The candidate with the background of size `SIZES[t]` taken into account; `along` holds its columns in the
    /// principal directions.
    fn seen(&self, t: usize, k: &DMatrix<f64>, z: &DVector<f64>, along: &DMatrix<f64>) -> Seen {
        let mut weighted = along.clone();
        weighted.column_iter_mut().for_each(|mut column| column.component_mul_assign(&self.weights[t]));
        Seen::new(k - along.tr_mul(&weighted), &(z - weighted.tr_mul(&self.b)))
    }

    /// Logarithm of the evidence for a candidate over that for the background alone, averaged over the sizes of the
    /// background with their evidence as weights.
    pub fn ln_evidence_of(&self, k: &DMatrix<f64>, z: &DVector<f64>, along: &DMatrix<f64>, sizes: &[f64]) -> f64 {
        let whole = ln_sum_exp(self.ln_evidence.iter().copied());
        let with: Vec<f64> = (0..SIZES.len())
            .map(|t| {
                let ln_b = if SIZES[t] == 0.0 {
                    Seen::new(k.clone(), z).ln_evidence(&self.remainders[0], sizes)
                } else {
                    self.seen(t, k, z, along).ln_evidence(&self.remainders[t], sizes)
                };
                self.ln_evidence[t] + ln_b
            })
            .collect();
        ln_sum_exp(with.iter().copied()) - whole
    }

    /// Posterior mean square of the background's size, in plausible sizes squared.
    pub fn mean_square(&self) -> f64 {
        let whole = ln_sum_exp(self.ln_evidence.iter().copied());
        SIZES.iter().zip(&self.ln_evidence).map(|(tau, ln)| (ln - whole).exp() * tau * tau).sum()
    }

    /// The most credible size of the background, in plausible sizes.
    pub fn size(&self) -> f64 {
        let best = (0..SIZES.len()).max_by(|&a, &b| self.ln_evidence[a].total_cmp(&self.ln_evidence[b]));
        best.map_or(0.0, |t| SIZES[t])
    }
}
