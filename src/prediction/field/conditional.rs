//! The linear model once its sizes are known: what is expected of it, how surely, and draws.

use nalgebra::{DMatrix, DVector};
use rand::Rng;

use super::rows::{Coefficients, Groups, Rows};
use crate::identify::fit::FitError;
use crate::math::linalg::{self, Cholesky};
use crate::prediction::chance::normal;

/// Sizes of all groups, and the noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sizes {
    /// Variance of each group, in plausible sizes squared.
    pub groups: Vec<f64>,
    /// Variance of a row of weight 1, in units of the noise by which rows are whitened.
    pub noise: f64,
    /// Weight of each sample: below 1 if it fits nothing.
    pub weights: Vec<f64>,
}

/// Samples whose joint covariance is computed at once.
const STRETCH: usize = 100;

impl Sizes {
    /// Variance of the noise of each row.
    pub fn noise_of_rows(&self, rows: &Rows) -> DVector<f64> {
        let mut all = DVector::repeat(rows.count(), self.noise);
        for (own, weight) in rows.samples.iter().zip(&self.weights) {
            own.clone().for_each(|r| all[r] = self.noise / weight);
        }
        all
    }
}

/// What the variances elsewhere are computed from. Free frames are uncertain by a thousand times what they are known to, so that
/// the product with an inverse would leave rounding only.
enum Spread {
    /// Factor of the covariance of the rows.
    OfRows(Cholesky),
    /// Covariance of the model's coefficients.
    OfModel(DMatrix<f64>),
}

/// The model conditioned on a campaign.
pub(super) struct Conditional {
    pub sizes: Sizes,
    /// The inverse of the covariance of the rows, noise included.
    pub inverse: DMatrix<f64>,
    /// Its product with the residuals.
    pub pulled: DVector<f64>,
    /// Posterior mean of all coefficients.
    pub mean: Coefficients,
    spread: Spread,
}

impl Conditional {
    /// Conditions a model with few columns and no groups.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn of_few(rows: &Rows, y: &DVector<f64>, sizes: Sizes) -> Result<Self, FitError> {
        debug_assert!(sizes.groups.is_empty(), "a model with groups has many columns");
        let noise = sizes.noise_of_rows(rows);
        let mut whitened = rows.smooth.clone();
        for (mut row, noise) in whitened.row_iter_mut().zip(&noise) {
            row /= noise.sqrt();
        }
        let p = whitened.ncols();
        let mut information = linalg::product_of_transposed(&whitened, &whitened);
        (0..p).for_each(|k| information[(k, k)] += 1.0);
        let mut factor = Cholesky::new(p);
        factor.factor(&information)?;
        // (I + X X^T)^-1 = I - X (I + X^T X)^-1 X^T
        let mut half = whitened.transpose();
        factor.whiten(&mut half);
        let mut inverse = -linalg::product_of_transposed(&half, &half);
        (0..inverse.nrows()).for_each(|r| inverse[(r, r)] += 1.0);
        for (c, mut column) in inverse.column_iter_mut().enumerate() {
            column.iter_mut().zip(&noise).for_each(|(x, n)| *x /= (n * noise[c]).sqrt());
        }
        let mut covariance = DMatrix::zeros(p, p);
        factor.inverse(&mut covariance);
        let weighted = y.zip_map(&noise, |y, noise| y / noise.sqrt());
        let mut mean = Coefficients::zeros(rows);
        mean.smooth = whitened.tr_mul(&weighted);
        factor.solve_in_place(mean.smooth.as_mut_slice());
        let left = y - &rows.smooth * &mean.smooth;
        let pulled = left.component_div(&noise);
        Ok(Conditional { sizes, inverse, pulled, mean, spread: Spread::OfModel(covariance) })
    }

    /// Conditions a model by the factored covariance of its rows.
    pub fn of_factor(rows: &Rows, y: &DVector<f64>, groups: &Groups, sizes: Sizes, mut factor: Cholesky) -> Self {
        let mut inverse = DMatrix::zeros(rows.count(), rows.count());
        factor.inverse(&mut inverse);
        let mut pulled = y.clone();
        factor.solve_in_place(pulled.as_mut_slice());
        let mut mean = Coefficients::zeros(rows);
        rows.pull(&pulled, &mut DVector::zeros(rows.samples.len()), &mut mean);
        groups.scale(&sizes.groups, &mut mean);
        Conditional { sizes, inverse, pulled, mean, spread: Spread::OfRows(factor) }
    }

    /// Sum of the variances of the first rows of each sample elsewhere, without noise.
    pub fn variances(&self, rows: &Rows, groups: &Groups, there: &Rows) -> Vec<f64> {
        let mut all = Vec::with_capacity(there.samples.len());
        let places: Vec<usize> = (0..there.samples.len()).collect();
        for chosen in places.chunks(STRETCH) {
            let there = there.of_samples(chosen);
            let of_rows: Vec<f64> = match &self.spread {
                Spread::OfRows(factor) => {
                    let prior = there.variance(groups, &self.sizes.groups);
                    let mut across = rows.covariance(&there, groups, &self.sizes.groups);
                    factor.whiten(&mut across);
                    prior.iter().zip(across.column_iter()).map(|(prior, known)| prior - known.norm_squared()).collect()
                }
                Spread::OfModel(covariance) => {
                    let across = linalg::product_with_transposed(covariance, &there.smooth);
                    across.column_iter().enumerate().map(|(r, c)| there.smooth.row(r).transpose().dot(&c)).collect()
                }
            };
            all.extend(there.samples.iter().map(|own| of_rows[own.clone()].iter().sum::<f64>().max(0.0)));
        }
        all
    }

    /// Draws the coefficients (Matheron's rule): a draw of the prior, corrected by what it misses of the residuals.
    pub fn draw(&self, rows: &Rows, groups: &Groups, y: &DVector<f64>, random: &mut impl Rng) -> Coefficients {
        let noise = self.sizes.noise_of_rows(rows);
        let roots: Vec<f64> = self.sizes.groups.iter().map(|v| v.sqrt()).collect();
        let mut drawn = Coefficients::zeros(rows);
        drawn.for_each(|b| *b = normal(random));
        groups.scale(&roots, &mut drawn);
        let mut missed = y - rows.applied(&drawn);
        (0..missed.len()).for_each(|r| missed[r] -= noise[r].sqrt() * normal(random));
        let mut step = Coefficients::zeros(rows);
        rows.pull(&(&self.inverse * missed), &mut DVector::zeros(rows.samples.len()), &mut step);
        groups.scale(&self.sizes.groups, &mut step);
        drawn.axpy(1.0, &step);
        drawn
    }
}
