//! Samples predicted without themselves, without fitting again.
//!
//! With C the inverse of the rows' covariance, the errors of the rows of a part B, predicted from all others, are
//! `(C_BB)^-1 (C r)_B`, and their covariance is `(C_BB)^-1` (Dubrule 1983).

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::campaign::Campaign;
use super::conditional::Conditional;
use crate::math::linalg::Cholesky;

/// Fewest samples from which others are predicted.
const LEAST_LEFT: usize = 10;

/// Fewest samples of a ball that no other part probes: its own place is then their mean.
const LEAST_OF_BALL: usize = 3;

/// Mean square along three axes from that along `count`.
fn of_three(count: usize) -> f64 {
    3.0 / count as f64
}

/// A sample predicted without its part of the campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Missed {
    /// Squared length of the error of its position, m².
    pub squared: f64,
    /// Variance of the prediction without noise, summed over three axes, m².
    pub variance: f64,
}

/// Predicts every sample from the parts (`folds`) that it does not belong to; `None` for what cannot be predicted.
pub(super) fn left_out(model: &Conditional, campaign: &Campaign, folds: &[usize]) -> Vec<Option<Missed>> {
    let count = folds.iter().max().map_or(0, |f| f + 1);
    let parts: Vec<Vec<usize>> = (0..count).map(|f| (0..folds.len()).filter(|&s| folds[s] == f).collect()).collect();
    let found: Vec<Vec<Option<Missed>>> = parts.par_iter().map(|part| of_part(model, campaign, part)).collect();
    let mut all = vec![None; folds.len()];
    for (part, found) in parts.iter().zip(found) {
        part.iter().zip(found).for_each(|(&s, missed)| all[s] = missed);
    }
    all
}

/// The errors of the rows of some samples, and their covariance, noise included.
pub(super) fn errors(model: &Conditional, rows: &[usize]) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let own = DMatrix::from_fn(rows.len(), rows.len(), |r, c| model.inverse[(rows[r], rows[c])]);
    let mut factor = Cholesky::new(rows.len());
    factor.factor(&own).ok()?;
    let mut covariance = DMatrix::zeros(rows.len(), rows.len());
    factor.inverse(&mut covariance);
    let mut errors = DVector::from_fn(rows.len(), |r, _| model.pulled[rows[r]]);
    factor.solve_in_place(errors.as_mut_slice());
    Some((errors, covariance))
}

fn of_part(model: &Conditional, campaign: &Campaign, part: &[usize]) -> Vec<Option<Missed>> {
    let Campaign { rows, contexts, back, .. } = campaign;
    if part.is_empty() || contexts.len() - part.len() < LEAST_LEFT {
        return vec![None; part.len()];
    }
    let own: Vec<usize> = part.iter().flat_map(|&s| rows.samples[s].clone()).collect();
    let Some((errors, covariance)) = errors(model, &own) else { return vec![None; part.len()] };
    let mut first = Vec::with_capacity(part.len());
    part.iter().fold(0, |at, &s| {
        first.push(at);
        at + rows.samples[s].len()
    });
    let heights: Vec<usize> = part.iter().map(|&s| contexts[s].positions).collect();
    let error = |k: usize| -> Vector3<f64> {
        back[part[k]] * Vector3::from_fn(|axis, _| if axis < heights[k] { errors[first[k] + axis] } else { 0.0 })
    };
    // Covariance of the errors of two samples, m².
    let between = |a: usize, b: usize| -> Matrix3<f64> {
        let of = |r: usize, c: usize| {
            if r < heights[a] && c < heights[b] { covariance[(first[a] + r, first[b] + c)] } else { 0.0 }
        };
        back[part[a]] * Matrix3::from_fn(of) * back[part[b]].transpose()
    };
    let noise =
        |k: usize| model.sizes.noise / model.sizes.weights[part[k]] * back[part[k]].columns(0, heights[k]).norm_squared();
    let probed_elsewhere =
        |ball: usize| (0..contexts.len()).any(|s| contexts[s].free_ball == Some(ball) && part.binary_search(&s).is_err());
    let mut of_ball: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (k, &s) in part.iter().enumerate() {
        if let Some(ball) = contexts[s].free_ball {
            of_ball.entry(ball).or_default().push(k);
        }
    }
    of_ball.retain(|&ball, _| !probed_elsewhere(ball));
    let plain = |k: usize| {
        let variance = between(k, k).trace() - noise(k);
        let three = of_three(heights[k]);
        Some(Missed { squared: three * error(k).norm_squared(), variance: three * variance.max(0.0) })
    };
    let mut all: Vec<Option<Missed>> = (0..part.len()).map(plain).collect();
    for own in of_ball.values() {
        let count = own.len() as f64;
        let mean: Vector3<f64> = own.iter().map(|&k| error(k)).sum::<Vector3<f64>>() / count;
        let of_mean = own.iter().flat_map(|&a| own.iter().map(move |&b| (a, b)));
        let of_mean = of_mean.map(|(a, b)| between(a, b).trace()).sum::<f64>() / (count * count);
        for &k in own {
            all[k] = (own.len() >= LEAST_OF_BALL && heights[k] == 3).then(|| {
                let with_mean = own.iter().map(|&b| between(k, b).trace()).sum::<f64>() / count;
                let variance = between(k, k).trace() - 2.0 * with_mean + of_mean - noise(k);
                let squared = (error(k) - mean).norm_squared() * count / (count - 1.0);
                Missed { squared, variance: variance.max(0.0) }
            });
        }
    }
    all
}
