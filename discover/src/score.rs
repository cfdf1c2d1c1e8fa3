//! The evidence for columns: how much better they explain a series than nothing does.

use nalgebra::{DMatrix, DVector};

/// A column of which the ground leaves less than this share is not seen.
const SEEN: f64 = 1e-3;

/// Largest number of columns whose products need no memory of their own.
const FEW: usize = 16;

/// Inner products of a candidate's columns in one metric.
pub(crate) struct Products {
    /// Rows of the lower triangle of their root, scaled to unit columns, one after the other.
    root: Vec<f64>,
    /// The scales.
    scales: Vec<f64>,
}

impl Products {
    /// `gram` of the columns, whose squared lengths before projection are `whole`; `None` if one is not seen, or if they are dependent.
    pub fn of(gram: &DMatrix<f64>, whole: &[f64]) -> Option<Self> {
        let k = gram.nrows();
        let is_seen = |i: usize| gram[(i, i)] > SEEN * whole[i];
        if !(0..k).all(is_seen) {
            return None;
        }
        let scales: Vec<f64> = (0..k).map(|i| gram[(i, i)].sqrt().recip()).collect();
        let mut root: Vec<f64> = Vec::with_capacity(k * (k + 1) / 2);
        for i in 0..k {
            for j in 0..=i {
                let above: f64 = (0..j).map(|l| root[at(i, l)] * root[at(j, l)]).sum();
                let rest = gram[(i, j)] * scales[i] * scales[j] - above;
                // A column must not be nearly the sum of the others.
                match i == j {
                    true if rest > SEEN => root.push(rest.sqrt()),
                    true => return None,
                    false => root.push(rest / root[at(j, j)]),
                }
            }
        }
        Some(Products { root, scales })
    }

    /// Square of what the columns explain of a series, given their products with it.
    pub fn explained(&self, with: &[f64]) -> f64 {
        let mut few = [0.0; FEW];
        let mut many = Vec::new();
        let half = if with.len() <= FEW {
            &mut few[..with.len()]
        } else {
            many.resize(with.len(), 0.0);
            &mut many[..]
        };
        self.solve_half(with, half);
        half.iter().map(|h| h * h).sum()
    }

    /// Coefficients of the columns that explain a series best.
    pub fn coefficients(&self, with: &[f64]) -> DVector<f64> {
        let k = with.len();
        let mut x = vec![0.0; k];
        self.solve_half(with, &mut x);
        for i in (0..k).rev() {
            let below: f64 = (i + 1..k).map(|l| self.root[at(l, i)] * x[l]).sum();
            x[i] = (x[i] - below) / self.root[at(i, i)];
        }
        DVector::from_fn(k, |i, _| x[i] * self.scales[i])
    }

    fn solve_half(&self, with: &[f64], half: &mut [f64]) {
        for i in 0..with.len() {
            let before: f64 = (0..i).map(|l| self.root[at(i, l)] * half[l]).sum();
            half[i] = (with[i] * self.scales[i] - before) / self.root[at(i, i)];
        }
    }
}

/// Place of an entry of a lower triangle.
fn at(row: usize, column: usize) -> usize {
    row * (row + 1) / 2 + column
}

/// Log evidence of `columns` columns that explain the share `r2` of a series of `dof` degrees of freedom over no columns, by Zellner's
/// prior with the information of one residual.
pub(crate) fn ln_evidence(r2: f64, columns: usize, dof: f64) -> f64 {
    let g = dof;
    let rest = (1.0 - r2).max(1e-12);
    0.5 * (dof - columns as f64) * g.ln_1p() - 0.5 * dof * (g * rest).ln_1p()
}

/// The share of a series that `columns` columns have to explain for a log evidence of `wanted`.
pub(crate) fn share_for(wanted: f64, columns: usize, dof: f64) -> f64 {
    let g = dof;
    let ln = (0.5 * (dof - columns as f64) * g.ln_1p() - wanted) / (0.5 * dof);
    1.0 - ln.exp_m1() / g
}

/// `ln(sum(exp))`.
pub(crate) fn ln_sum_exp(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if largest.is_finite() { largest + values.iter().map(|v| (v - largest).exp()).sum::<f64>().ln() } else { largest }
}
