//! Sequential choice of measurements: those that best distinguish rivals, or that best determine the fitted model.

use nalgebra::{DMatrix, Vector3};

use super::candidate_covariances::{CandidateCovariances, best_free};
use super::rival::State;
use crate::diagnosis::Examination;
use crate::identify::fit::FitError;
use crate::math::linalg::LinalgError;

/// One rival's predictions for a pool.
struct Side {
    sighting: CandidateCovariances,
    /// Its prediction for every candidate after the measurements taken so far, for each rival a assumed to be true.
    predictions: Vec<Vec<Vector3<f64>>>,
    weight: f64,
}

/// Rivals, and their separation by the measurements chosen so far.
pub(super) struct Rivalry {
    sides: Vec<Side>,
    /// Accumulated separation `T_ab` of b's prediction from the data expected under a, in squared units of its
    /// uncertainty.
    separation: DMatrix<f64>,
}

impl Rivalry {
    /// Sets up rivals with their probabilities for the `columns` of a pool.
    pub fn new(states: &[State], weights: &[f64], columns: &DMatrix<f64>) -> Self {
        let count = states.len();
        let side = |(state, &weight): (&State, &f64)| {
            let own = columns.select_rows(&state.rows);
            let shown = own.tr_mul(&state.mean);
            let prediction: Vec<Vector3<f64>> = shown.as_slice().chunks_exact(3).map(Vector3::from_column_slice).collect();
            let sighting = CandidateCovariances::new(own, &state.covariance);
            Side { sighting, predictions: vec![prediction; count], weight }
        };
        Rivalry { sides: states.iter().zip(weights).map(side).collect(), separation: DMatrix::zeros(count, count) }
    }

    /// Difference between the datum expected under a and b's prediction, if a is true. A rival's own prediction does
    /// not change if it is true.
    fn surprise(&self, a: usize, b: usize, candidate: usize) -> Vector3<f64> {
        self.sides[a].predictions[a][candidate] - self.sides[b].predictions[a][candidate]
    }

    /// Remaining weight of every pair: `pi_a pi_b exp(-T_ab/8)`.
    fn open(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.sides.len(), self.sides.len(), |a, b| {
            if a == b { 0.0 } else { self.sides[a].weight * self.sides[b].weight * (-self.separation[(a, b)] / 8.0).exp() }
        })
    }

    /// `sum over a != b of pi_a pi_b exp(-T_ab/8) (1 - exp(-t_ab/8))`: reduction by a candidate of the bound on the
    /// probability of confusing two rivals (Bhattacharyya). Pairs that are already separated hardly contribute.
    ///
    /// # Errors
    /// As [`CandidateCovariances::precision`].
    fn gain(&self, candidate: usize, open: &DMatrix<f64>) -> Result<f64, LinalgError> {
        let mut gain = 0.0;
        for (b, side) in self.sides.iter().enumerate() {
            let precision = side.sighting.precision(candidate)?;
            for a in (0..self.sides.len()).filter(|&a| a != b) {
                let d = self.surprise(a, b, candidate);
                gain += open[(a, b)] * -(-(precision * d).dot(&d) / 8.0).exp_m1();
            }
        }
        Ok(gain)
    }

    /// Takes the candidate that separates the rivals most among those not `taken`; `None` if all are.
    ///
    /// # Errors
    /// As [`CandidateCovariances::precision`].
    pub fn choose(&mut self, taken: &[usize]) -> Result<Option<usize>, LinalgError> {
        let open = self.open();
        let count = self.sides.first().map_or(0, |side| side.sighting.count());
        let best = best_free(count, taken, |i| self.gain(i, &open))?;
        best.map_or(Ok(()), |best| self.take(best))?;
        Ok(best)
    }

    /// Updates every rival with a candidate, once for each rival assumed to be true.
    ///
    /// # Errors
    /// As [`CandidateCovariances::precision`].
    pub fn take(&mut self, candidate: usize) -> Result<(), LinalgError> {
        let count = self.sides.len();
        let surprises = DMatrix::from_fn(count, count, |a, b| self.surprise(a, b, candidate));
        for (b, side) in self.sides.iter_mut().enumerate() {
            let (gain, whitener) = side.sighting.gain(candidate)?;
            let lesson = side.sighting.learn(gain, None);
            for a in (0..count).filter(|&a| a != b) {
                let whitened = whitener * surprises[(a, b)];
                self.separation[(a, b)] += whitened.norm_squared();
                for (i, prediction) in side.predictions[a].iter_mut().enumerate() {
                    *prediction += lesson.seen(i, 0) * whitened;
                }
            }
        }
        Ok(())
    }
}

/// Choice of the measurements that best determine the fitted model (largest `det(I + X P X^T)`, the sequential form of
/// D-optimality).
pub(super) struct Determination {
    sighting: CandidateCovariances,
}

impl Determination {
    pub fn new(state: &State, columns: &DMatrix<f64>) -> Self {
        Determination { sighting: CandidateCovariances::new(columns.select_rows(&state.rows), &state.covariance) }
    }

    /// Takes the candidate that adds most information among those not `taken`; `None` if all are.
    ///
    /// # Errors
    /// As [`CandidateCovariances::precision`].
    pub fn choose(&mut self, taken: &[usize]) -> Result<Option<usize>, LinalgError> {
        let best = best_free(self.sighting.count(), taken, |i| Ok(self.sighting.spread(i).determinant()))?;
        if let Some(best) = best {
            let (gain, _) = self.sighting.gain(best)?;
            self.sighting.learn(gain, None);
        }
        Ok(best)
    }
}

/// A one-sigma of the parameters before any measurement, in those that a single average measurement leaves: as good as unknown.
const UNKNOWN: f64 = 100.0;

/// Chooses the `count` samples of an examined plan that together determine its model best, each given those before it.
///
/// # Errors
/// As [`CandidateCovariances::precision`].
pub(crate) fn first_choice(plan: &Examination, count: usize) -> Result<Vec<usize>, FitError> {
    let unknowns = plan.fitted.len();
    let columns = plan.rows.rows(0, unknowns).into_owned();
    let samples = (columns.ncols() / 3).max(1) as f64;
    let variance = |row: usize| UNKNOWN * UNKNOWN * samples / columns.row(row).norm_squared().max(f64::MIN_POSITIVE);
    let before = DMatrix::from_fn(unknowns, unknowns, |r, c| if r == c { variance(r) } else { 0.0 });
    let mut determination = Determination { sighting: CandidateCovariances::new(columns, &before) };
    let mut chosen = Vec::with_capacity(count);
    while chosen.len() < count {
        let Some(next) = determination.choose(&chosen)? else { break };
        chosen.push(next);
    }
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    /// A rival with a single parameter, in row `row`, of the given mean and variance; a variance of zero means that it
    /// is known exactly.
    fn state(row: usize, mean: f64, variance: f64) -> State {
        State { rows: vec![row], mean: DVector::from_element(1, mean), covariance: DMatrix::from_element(1, 1, variance) }
    }

    /// Candidate 0 depends on neither parameter, candidate 1 on the first, candidate 2 on the second, in x only.
    fn columns() -> DMatrix<f64> {
        let mut x = DMatrix::zeros(2, 9);
        (x[(0, 3)], x[(1, 6)]) = (1.0, 1.0);
        x
    }

    #[test]
    fn the_separation_of_two_rivals_by_hand() {
        let mut rivalry = Rivalry::new(&[state(0, 3.0, 0.0), state(1, 1.0, 3.0)], &[0.25, 0.75], &columns());
        let open = rivalry.open();
        assert_eq!(rivalry.gain(0, &open), Ok(0.0));
        // Candidate 1: a predicts 3 and b predicts 0, both exactly, so the separation is 9 either way.
        let by_hand = 2.0 * 0.25 * 0.75 * (1.0 - (-9.0_f64 / 8.0).exp());
        assert!((rivalry.gain(1, &open).unwrap() - by_hand).abs() < 1e-15);
        // Candidate 2: a predicts 0 exactly, b predicts 1 +- sqrt(3), hence a variance of 4 with the noise.
        let (of_a, of_b) = (1.0 - (-1.0_f64 / 8.0).exp(), 1.0 - (-(1.0 / 4.0) / 8.0_f64).exp());
        assert!((rivalry.gain(2, &open).unwrap() - 0.1875 * (of_a + of_b)).abs() < 1e-15);
        assert_eq!(rivalry.choose(&[]), Ok(Some(1)));
        assert!((rivalry.separation[(0, 1)] - 9.0).abs() < 1e-12);
        // If a is true (datum 0, b predicts 1 +- sqrt(3)), b's new prediction follows from a Kalman update, as
        // candidate 2 measures it directly.
        rivalry.take(2).unwrap();
        assert!((rivalry.sides[1].predictions[0][2].x - (1.0 - 3.0 / 4.0)).abs() < 1e-15);
        assert!((rivalry.sides[1].predictions[1][2].x - 1.0).abs() < 1e-15);
        assert!((rivalry.sides[1].sighting.spread(2)[(0, 0)] - 1.75).abs() < 1e-15);
    }

    #[test]
    fn determination_prefers_what_is_least_known() {
        let state = State {
            rows: vec![0, 1],
            mean: DVector::zeros(2),
            covariance: DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 8.0])),
        };
        let mut determination = Determination::new(&state, &columns());
        assert_eq!(determination.choose(&[]), Ok(Some(2)));
        assert!((determination.sighting.spread(2)[(0, 0)] - (1.0 + 8.0 / 9.0)).abs() < 1e-15);
        assert_eq!(determination.choose(&[2]), Ok(Some(1)));
    }
}
