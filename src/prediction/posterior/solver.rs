//! Draw of all coefficients of the linear model at once, given their sizes and the noise.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use super::linear_model::{Group, LinearModel, Outer, Size, State};
use crate::identify::fit::FitError;
use crate::math::linalg::{self, Cholesky};
use crate::prediction::chance::normal;

/// Sweeps between updates of the sample weights if there are more rows than columns: the products of the rows are
/// expensive.
const REWEIGH: usize = 10;

/// Draws all coefficients at once, using the smaller of the two normal matrices.
pub enum Solver {
    /// Matrix of rows x rows.
    ByRows {
        factor: Cholesky,
        known: DMatrix<f64>,
        drawn: Vec<usize>,
        scaled: DMatrix<f64>,
        outers: Vec<OuterProduct>,
        kernel: DMatrix<f64>,
    },
    /// Matrix of columns x columns: the rows weighted and transposed, their products, and the weighted residuals.
    ByColumns { factor: Cholesky, weighted: DMatrix<f64>, products: DMatrix<f64>, y: DVector<f64>, scaled: DMatrix<f64> },
}

/// Memory for the products of columns that are factored.
pub struct OuterProduct {
    scaled: DMatrix<f64>,
    product: DMatrix<f64>,
    column: DVector<f64>,
}

impl OuterProduct {
    fn new(outer: &Outer) -> Self {
        let (samples, columns) = outer.shapes.shape();
        OuterProduct {
            scaled: DMatrix::zeros(samples, columns),
            product: DMatrix::zeros(samples, samples),
            column: DVector::zeros(outer.lever.len()),
        }
    }

    /// Forms the products of the samples, with these variances of all columns.
    fn compute(&mut self, outer: &Outer, variance: &[f64]) {
        for ((mut to, from), &k) in self.scaled.column_iter_mut().zip(outer.shapes.column_iter()).zip(&outer.columns) {
            to.axpy(variance[k].sqrt(), &from, 0.0);
        }
        linalg::normal_matrix(&self.scaled, &mut self.product);
    }

    /// Adds the products of all rows to the lower triangle of `kernel`.
    fn add_all(all: &mut [OuterProduct], model: &LinearModel, kernel: &mut DMatrix<f64>) {
        let samples = &model.samples[..model.outers.first().map_or(0, |outer| outer.shapes.nrows())];
        let end = samples.last().map_or(0, |last| last.end);
        let sample_of: Vec<usize> = samples.iter().enumerate().flat_map(|(s, own)| own.clone().map(move |_| s)).collect();
        for (s, own) in samples.iter().enumerate() {
            let first = own.start;
            for (OuterProduct { product, column, .. }, Outer { lever, .. }) in all.iter_mut().zip(&model.outers) {
                let of_samples = &product.as_slice()[s * samples.len()..][..samples.len()];
                let rows = column.as_mut_slice()[first..end].iter_mut().zip(&lever.as_slice()[first..end]);
                rows.zip(&sample_of[first..]).for_each(|((to, lever), &of)| *to = lever * of_samples[of]);
            }
            for c in own.clone() {
                let mut to = kernel.column_mut(c);
                for (OuterProduct { column, .. }, Outer { lever, .. }) in all.iter().zip(&model.outers) {
                    to.rows_mut(c, end - c).axpy(lever[c], &column.rows(c, end - c), 1.0);
                }
            }
        }
    }
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
        let mut is_outer = vec![false; columns];
        model.outers.iter().flat_map(|outer| &outer.columns).for_each(|&k| is_outer[k] = true);
        let drawn = model.groups.iter().filter(is_drawn).flat_map(|g| g.columns.clone());
        let drawn: Vec<usize> = drawn.filter(|&k| !is_outer[k]).collect();
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
        let outers = model.outers.iter().map(OuterProduct::new).collect();
        Solver::ByRows { factor: Cholesky::new(rows), known, drawn, scaled, outers, kernel: DMatrix::zeros(rows, rows) }
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
            Solver::ByRows { factor, known, drawn, scaled, outers, kernel } => {
                for (mut to, &k) in scaled.column_iter_mut().zip(drawn.iter()) {
                    to.axpy(variance[k].sqrt(), &model.x.column(k), 0.0);
                }
                linalg::normal_matrix(scaled, kernel);
                *kernel += &*known;
                outers.iter_mut().zip(&model.outers).for_each(|(product, outer)| product.compute(outer, &variance));
                OuterProduct::add_all(outers, model, kernel);
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
                    let below = c + 1..columns;
                    let by = scale[c] / state.noise;
                    let from = products.column(c);
                    let mut to = scaled.column_mut(c);
                    to[c] = 1.0;
                    to.rows_range_mut(below.clone()).copy_from(&from.rows_range(below.clone()));
                    to.rows_range_mut(below.clone()).component_mul_assign(&scale.rows_range(below.clone()));
                    to.rows_range_mut(below).scale_mut(by);
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

#[cfg(test)]
mod tests {
    use super::super::linear_model::Kind;
    use super::*;

    #[test]
    fn factored_columns_are_multiplied_as_they_stand() {
        let mut random = <ChaCha8Rng as rand::SeedableRng>::seed_from_u64(1);
        // The last row is of no sample that moves a joint.
        let (samples, rows, columns) = (vec![0..3, 3..4, 4..10, 10..11], 11, vec![2, 0, 3]);
        let mut of = |rows: usize, columns: usize| DMatrix::from_fn(rows, columns, |_, _| normal(&mut random));
        let (shapes, lever) = (of(3, 3), of(rows, 1).column(0).into_owned());
        let outer = Outer { lever, shapes, columns };
        let mut x = DMatrix::zeros(rows, 12);
        outer.write(&samples, &mut x);
        x.columns_mut(4, 8).copy_from(&of(rows, 8));
        let y = of(rows, 1).column(0).into_owned();
        let groups = vec![
            Group { columns: 0..4, size: Size::Drawn(Kind::Curves) },
            Group { columns: 4..9, size: Size::Drawn(Kind::Catalogue) },
            Group { columns: 9..12, size: Size::Known(2.0) },
        ];
        let outers = vec![outer];
        let factored =
            LinearModel { x: x.clone(), y: y.clone(), samples: samples.clone(), outers, groups: groups.clone(), noise: None };
        let plain = LinearModel { x, y, samples, outers: Vec::new(), groups, noise: None };
        let state = State { common: [1.0; 3], variance: vec![0.5, 3.0, 1.0], weight: vec![0.7; 4], noise: 0.3, tail: 4.0 };
        let drawn = [factored, plain].map(|model| {
            let mut random = <ChaCha8Rng as rand::SeedableRng>::seed_from_u64(2);
            Solver::new(&model).draw(&model, &state, 0, &mut random).unwrap()
        });
        assert!((&drawn[0] - &drawn[1]).amax() < 1e-12 * drawn[1].amax(), "{drawn:?}");
    }
}
