//! Predictive covariances of candidate measurements, updated as candidates are taken.

use nalgebra::{DMatrix, Dyn, Matrix3};

use crate::math::linalg::{self, LinalgError};
use crate::math::positive_definite::{cholesky, whitener};

/// Predictive covariance of every candidate, for parameters of covariance P.
///
/// A Kalman update with a candidate of columns `X_c` reduces P to `P - u u^T`, with `u = P X_c^T L^-T` and
/// `L L^T = I + X_c P X_c^T`. The covariance of every other candidate then follows from `X u` alone, three products per
/// column, and P itself is never recomputed.
pub(super) struct CandidateCovariances {
    /// `X^T`, whitened: one row per parameter, three columns per candidate.
    columns: DMatrix<f64>,
    /// `P X^T` before any update; `None` if P is the identity.
    carried: Option<DMatrix<f64>>,
    /// `I + X P X^T` of each candidate.
    spreads: Vec<Matrix3<f64>>,
    lessons: Vec<KalmanUpdate>,
}

/// Kalman update with one measurement.
pub(super) struct KalmanUpdate {
    /// `u`: parameters x 3.
    gain: DMatrix<f64>,
    /// `X u`: three rows per candidate; three columns for `u`, then those of further directions.
    seen: DMatrix<f64>,
}

impl KalmanUpdate {
    /// Displacement of a candidate by the three directions of index `place`; those of the gain have index 0.
    pub fn seen(&self, candidate: usize, place: usize) -> Matrix3<f64> {
        self.seen.fixed_view::<3, 3>(3 * candidate, 3 * place).into_owned()
    }
}

impl CandidateCovariances {
    /// From the candidates' columns (parameters x 3 per candidate) and the covariance of the parameters.
    pub fn new(columns: DMatrix<f64>, covariance: &DMatrix<f64>) -> Self {
        let carried = linalg::product_of_transposed(covariance, &columns);
        CandidateCovariances { spreads: spreads(&columns, &carried), columns, carried: Some(carried), lessons: Vec::new() }
    }

    /// From the columns of independent parameters of variance one.
    pub fn of_unit(columns: DMatrix<f64>) -> Self {
        CandidateCovariances { spreads: spreads(&columns, &columns), columns, carried: None, lessons: Vec::new() }
    }

    /// Number of candidates.
    pub fn count(&self) -> usize {
        self.spreads.len()
    }

    /// `I + X P X^T` of a candidate.
    pub fn spread(&self, candidate: usize) -> &Matrix3<f64> {
        &self.spreads[candidate]
    }

    /// `(I + X P X^T)^-1` of a candidate.
    ///
    /// # Errors
    /// When rounding has consumed the identity: P is then larger than the noise by more than the digits of a number.
    pub fn precision(&self, candidate: usize) -> Result<Matrix3<f64>, LinalgError> {
        Ok(cholesky(self.spreads[candidate])?.inverse())
    }

    /// The gains `u` of all updates, in order.
    pub fn gains(&self) -> impl ExactSizeIterator<Item = &DMatrix<f64>> {
        self.lessons.iter().map(|lesson| &lesson.gain)
    }

    /// Computes `u` and `L^-1` of a candidate.
    ///
    /// # Errors
    /// As [`precision`](Self::precision).
    pub fn gain(&self, candidate: usize) -> Result<(DMatrix<f64>, Matrix3<f64>), LinalgError> {
        let whitener = whitener(self.spreads[candidate])?;
        let carried = self.carried.as_ref().unwrap_or(&self.columns);
        let mut left = carried.columns(3 * candidate, 3).into_owned();
        for lesson in &self.lessons {
            left.gemm(-1.0, &lesson.gain, &lesson.seen(candidate, 0).transpose(), 1.0);
        }
        let gain = left * whitener.transpose();
        Ok((gain.reshape_generic(Dyn(self.columns.nrows()), Dyn(3)), whitener))
    }

    /// Updates all candidates with a gain. Also computes their displacements along `others`, directions in further
    /// columns (parameters x a multiple of 3).
    pub fn learn(&mut self, gain: DMatrix<f64>, others: Option<DMatrix<f64>>) -> &KalmanUpdate {
        let directions = match others {
            Some(others) => {
                DMatrix::from_iterator(gain.nrows(), gain.ncols() + others.ncols(), gain.iter().chain(others.iter()).copied())
            }
            None => gain.clone(),
        };
        let lesson = KalmanUpdate { gain, seen: linalg::product_of_transposed(&self.columns, &directions) };
        for (i, spread) in self.spreads.iter_mut().enumerate() {
            let seen = lesson.seen(i, 0);
            *spread -= seen * seen.transpose();
        }
        self.lessons.push(lesson);
        &self.lessons[self.lessons.len() - 1]
    }
}

fn spreads(columns: &DMatrix<f64>, carried: &DMatrix<f64>) -> Vec<Matrix3<f64>> {
    blocks(columns, carried).map(|block| Matrix3::identity() + block).collect()
}

/// `x_i^T y_i` of every candidate i, from its three columns in `x` and in `y`.
pub(super) fn blocks<'a>(x: &'a DMatrix<f64>, y: &'a DMatrix<f64>) -> impl Iterator<Item = Matrix3<f64>> + 'a {
    (0..x.ncols() / 3).map(|i| x.fixed_columns::<3>(3 * i).tr_mul(&y.fixed_columns::<3>(3 * i)))
}

/// The candidate with the largest `gain` among those not `taken`, the first if several are equal; `None` if all are
/// taken.
///
/// # Errors
/// The first of `gain`.
pub(super) fn best_free(
    count: usize,
    taken: &[usize],
    gain: impl Fn(usize) -> Result<f64, LinalgError>,
) -> Result<Option<usize>, LinalgError> {
    let mut best: Option<(usize, f64)> = None;
    for i in (0..count).filter(|i| !taken.contains(i)) {
        let next = gain(i)?;
        if best.is_none_or(|(_, most)| next > most) {
            best = Some((i, next));
        }
    }
    Ok(best.map(|(i, _)| i))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sequential updates give the same covariance as all measurements together: `(P^-1 + sum X^T X)^-1`.
    #[test]
    fn lessons_add_up_to_the_information() {
        let columns = DMatrix::from_fn(4, 12, |r, c| ((3 * r + 5 * c) as f64).sin());
        let covariance = DMatrix::from_diagonal(&[1.0, 4.0, 0.25, 9.0].to_vec().into());
        let root = covariance.map(f64::sqrt);
        let mut sighting = CandidateCovariances::new(columns.clone(), &covariance);
        let mut unit = CandidateCovariances::of_unit(&root * &columns);
        let mut information = covariance.try_inverse().unwrap();
        for candidate in [2, 0, 3] {
            for sighting in [&mut sighting, &mut unit] {
                let (gain, _) = sighting.gain(candidate).unwrap();
                sighting.learn(gain, None);
            }
            let x = columns.columns(3 * candidate, 3);
            information += x * x.transpose();
        }
        let afresh = CandidateCovariances::new(columns, &information.try_inverse().unwrap());
        for i in 0..4 {
            assert!((sighting.spread(i) - afresh.spread(i)).amax() < 1e-12);
            assert!((unit.spread(i) - afresh.spread(i)).amax() < 1e-12);
        }
    }
}
