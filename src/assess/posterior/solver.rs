//! Draw of all coefficients of the linear model at once, given their sizes and the noise.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use super::chance::normal;
use super::linear_model::{Group, LinearModel, Size, State};
use crate::identify::FitError;
use crate::math::linalg::{self, Cholesky};

/// Sweeps between updates of the sample weights if there are more rows than columns: the products of the rows are
/// expensive.
const REWEIGH: usize = 10;

/// Draws all coefficients at once, using the smaller of the two normal matrices.
pub enum Solver {
    /// Matrix of rows x rows.
    ByRows { factor: Cholesky, known: DMatrix<f64>, drawn: Vec<usize>, scaled: DMatrix<f64>, kernel: DMatrix<f64> },
    /// Matrix of columns x columns: the rows weighted and transposed, their products, and the weighted residuals.
    ByColumns { factor: Cholesky, weighted: DMatrix<f64>, products: DMatrix<f64>, y: DVector<f64>, scaled: DMatrix<f64> },
}

impl Solver {
    pub fn new(model: &LinearModel) -> Self {
        let (rows, columns) = model.x.shape();
        if rows > columns {
            return Solver::ByColumns {
                factor: Cholesky::new(columns),
                weighted: DMatrix::zeros(columns, rows),
                products: DMatrix::zeros(columns, columns),
                y: DVector::zeros(rows),
                scaled: DMatrix::zeros(columns, columns),
            };
        }
        let is_drawn = |g: &&Group| matches!(g.size, Size::Drawn(_));
        let drawn: Vec<usize> = model.groups.iter().filter(is_drawn).flat_map(|g| g.columns.clone()).collect();
        let sizes = model.groups.iter().filter_map(|g| match g.size {
            Size::Known(variance) => Some(g.columns.clone().map(move |k| (k, variance))),
            Size::Drawn(_) => None,
        });
        let of_known: Vec<(usize, f64)> = sizes.flatten().collect();
        let mut x = DMatrix::zeros(rows, of_known.len());
        for (mut to, (k, variance)) in x.column_iter_mut().zip(&of_known) {
            to.axpy(variance.sqrt(), &model.x.column(*k), 0.0);
        }
        let mut known = DMatrix::zeros(rows, rows);
        linalg::normal_matrix(&x, &mut known);
        let scaled = DMatrix::zeros(rows, drawn.len());
        Solver::ByRows { factor: Cholesky::new(rows), known, drawn, scaled, kernel: DMatrix::zeros(rows, rows) }
    }

    pub fn draw(
        &mut self,
        model: &LinearModel,
        state: &State,
        sweep: usize,
        random: &mut ChaCha8Rng,
    ) -> Result<DVector<f64>, FitError> {
        let (rows, columns) = model.x.shape();
        let mut variance = vec![0.0; columns];
        for (group, drawn) in model.groups.iter().zip(&state.variance) {
            let own = if let Size::Known(v) = group.size { v } else { *drawn };
            group.columns.clone().for_each(|k| variance[k] = own);
        }
        match self {
            Solver::ByRows { factor, known, drawn, scaled, kernel } => {
                for (mut to, &k) in scaled.column_iter_mut().zip(drawn.iter()) {
                    to.axpy(variance[k].sqrt(), &model.x.column(k), 0.0);
                }
                linalg::normal_matrix(scaled, kernel);
                *kernel += &*known;
                let mut noise = DVector::zeros(rows);
                for (own, weight) in model.samples.iter().zip(&state.weight) {
                    own.clone().for_each(|r| noise[r] = state.noise / weight);
                }
                (0..rows).for_each(|r| kernel[(r, r)] += noise[r]);
                factor.factor(kernel)?;
                let mut b = DVector::from_fn(columns, |k, _| variance[k].sqrt() * normal(random));
                let mut short = &model.y - &model.x * &b;
                (0..rows).for_each(|r| short[r] -= noise[r].sqrt() * normal(random));
                factor.solve_in_place(short.as_mut_slice());
                let pulled = model.x.tr_mul(&short);
                (0..columns).for_each(|k| b[k] += variance[k] * pulled[k]);
                Ok(b)
            }
            Solver::ByColumns { factor, weighted, products, y, scaled } => {
                if sweep.is_multiple_of(REWEIGH) {
                    model.x.transpose_to(weighted);
                    y.copy_from(&model.y);
                    for (own, weight) in model.samples.iter().zip(&state.weight) {
                        for r in own.clone() {
                            weighted.column_mut(r).scale_mut(weight.sqrt());
                            y[r] *= weight.sqrt();
                        }
                    }
                    linalg::normal_matrix(weighted, products);
                }
                let precision = |k: usize| products[(k, k)] / state.noise + 1.0 / variance[k];
                let scale = DVector::from_fn(columns, |k, _| 1.0 / precision(k).sqrt());
                for c in 0..columns {
                    for r in c + 1..columns {
                        scaled[(r, c)] = products[(r, c)] / state.noise * scale[r] * scale[c];
                    }
                    scaled[(c, c)] = 1.0;
                }
                factor.factor(scaled)?;
                // Data and prior are each perturbed by their own noise: the solution is then a draw.
                let sigma = state.noise.sqrt();
                let noisy = DVector::from_fn(rows, |r, _| y[r] / state.noise + normal(random) / sigma);
                let mut b = &*weighted * noisy;
                (0..columns).for_each(|k| b[k] = (b[k] + normal(random) / variance[k].sqrt()) * scale[k]);
                factor.solve_in_place(b.as_mut_slice());
                Ok(b.component_mul(&scale))
            }
        }
    }
}
