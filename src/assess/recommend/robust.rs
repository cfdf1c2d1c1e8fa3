//! Samples that do not belong to the others, found before anything is concluded from them: a Student-t fit of the plain model, posture by
//! posture, and what lies beyond its odds is set aside. The fit that follows is least squares, which costs nothing on clean data.

use nalgebra::{DMatrix, DVector};

use super::linear::Linear;
use crate::identify::{FitError, linalg};

/// Degrees of freedom of the Student-t, per posture of three numbers.
const NU: f64 = 4.0;

/// Median of chi-square with three degrees of freedom.
const MEDIAN_OF_THREE: f64 = 2.366;

/// Rounds of reweighting.
const ROUNDS: usize = 30;

/// A posture is set aside beyond so many robust standard deviations.
const BEYOND: f64 = 6.0;

/// For each sample how far its posture lies off the plain model, in robust standard deviations.
pub(super) fn distances(linear: &Linear) -> Result<Vec<f64>, FitError> {
    let m = linear.fitted;
    let last = linear.rows.nrows() - 1;
    let postures = linear.members.len();
    let choice = linear.base();
    let row = |k: usize| (linear.rows.column(k).rows(0, m).into_owned(), linear.rows[(last, k)]);
    let always = linear.always();
    let mut weight = vec![1.0; postures];
    let mut distance = vec![0.0; postures];
    for _ in 0..ROUNDS {
        let mut normal = always.view((0, 0), (m, m)).into_owned();
        let mut gradient = DVector::from_vec(choice.pull.clone()) + always.view((0, last), (m, 1)).column(0);
        for (s, &(first, height)) in linear.stretch.iter().enumerate() {
            let w = weight[linear.posture[s]];
            for k in first..first + height {
                let (x, y) = row(k);
                normal.syger(w, &x, &x, 1.0);
                gradient.axpy(w * y, &x, 1.0);
            }
        }
        normal.fill_upper_triangle_with_lower_triangle();
        (0..m).for_each(|k| normal[(k, k)] += choice.information[k]);
        let scale = normal.diagonal().map(|d: f64| 1.0 / d.max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(m, m, |r, c| normal[(r, c)] * scale[r] * scale[c] + if r == c { 1e-12 } else { 0.0 });
        let mut factor = linalg::Cholesky::new(m);
        factor.factor(&scaled)?;
        let mut inverse = DMatrix::zeros(m, m);
        factor.inverse(&mut inverse);
        let step = (&inverse * gradient.component_mul(&scale)).component_mul(&scale);
        for (p, samples) in linear.members.iter().enumerate() {
            let (mut squares, mut leverage, mut count) = (0.0, 0.0, 0.0);
            for &s in samples {
                let (first, height) = linear.stretch[s];
                for k in first..first + height {
                    let (x, y) = row(k);
                    let z = x.component_mul(&scale);
                    squares += (y - x.dot(&step)).powi(2);
                    leverage += (&inverse * &z).dot(&z);
                    count += 1.0;
                }
            }
            distance[p] = 3.0 * squares / count / (1.0 - weight[p] * leverage / count).max(0.05);
        }
        let mut sorted = distance.clone();
        sorted.sort_by(f64::total_cmp);
        let s2 = (sorted[postures / 2] / MEDIAN_OF_THREE).max(f64::MIN_POSITIVE);
        for (w, d) in weight.iter_mut().zip(&mut distance) {
            *d /= s2;
            *w = (NU + 3.0) / (NU + *d);
        }
    }
    Ok(linear.posture.iter().map(|&p| distance[p].sqrt()).collect())
}

/// Which samples to set aside.
pub(super) fn aside(distances: &[f64]) -> Vec<bool> {
    distances.iter().map(|d| *d > BEYOND).collect()
}
