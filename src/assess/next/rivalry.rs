//! Choosing measurements one after the other: by what tells rivals apart, or by what determines the fitted model.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Vector3};
use rayon::prelude::*;

use super::rival::State;

/// One rival as a pool sees it.
struct Side {
    /// Its numbers' columns at the candidates: numbers x 3 candidates.
    columns: DMatrix<f64>,
    covariance: DMatrix<f64>,
    /// What it would come to believe of its numbers if rival a were the truth, for every a.
    beliefs: Vec<DVector<f64>>,
    weight: f64,
}

/// Rivals, and how far the measurements chosen so far separate them.
pub(super) struct Rivalry {
    sides: Vec<Side>,
    /// Accumulated separation `T_ab` of b's prediction from what a would give, in squared units of its uncertainty.
    separation: DMatrix<f64>,
}

/// What a candidate would show of b, a being true.
struct Shown {
    /// `P X^T`.
    carried: DMatrix<f64>,
    /// `(I + X P X^T)^-1`.
    precision: Matrix3<f64>,
    /// How far a's datum is from b's prediction, for every a.
    surprise: Vec<Vector3<f64>>,
}

impl Rivalry {
    /// Rivals with their probabilities, before `columns` of a pool.
    pub fn new(states: &[State], weights: &[f64], columns: &DMatrix<f64>) -> Self {
        let count = states.len();
        let side = |(state, &weight): (&State, &f64)| Side {
            columns: columns.select_rows(&state.rows),
            covariance: state.covariance.clone(),
            beliefs: vec![state.mean.clone(); count],
            weight,
        };
        Rivalry { sides: states.iter().zip(weights).map(side).collect(), separation: DMatrix::zeros(count, count) }
    }

    fn shown(&self, candidate: usize) -> Vec<Shown> {
        let here = |side: &Side| side.columns.columns(3 * candidate, 3).into_owned();
        // A rival's belief does not change when it is right.
        let data: Vec<Vector3<f64>> =
            self.sides.iter().enumerate().map(|(a, s)| to3(here(s).tr_mul(&s.beliefs[a]).as_slice())).collect();
        self.sides
            .iter()
            .map(|side| {
                let x = here(side);
                let carried = &side.covariance * &x;
                let spread = Matrix3::identity() + Matrix3::from_column_slice(x.tr_mul(&carried).as_slice());
                let precision = spread.cholesky().map_or_else(Matrix3::zeros, |c| c.inverse());
                let surprise = side.beliefs.iter().zip(&data).map(|(b, datum)| datum - to3(x.tr_mul(b).as_slice())).collect();
                Shown { carried, precision, surprise }
            })
            .collect()
    }

    /// `sum over a != b of pi_a pi_b exp(-T_ab/8) (1 - exp(-t_ab/8))`: by how much a candidate lowers the bound on the chance to take one
    /// rival for another (Bhattacharyya), the pairs that are apart already left aside.
    fn gain(&self, candidate: usize) -> f64 {
        let shown = self.shown(candidate);
        let mut gain = 0.0;
        for (b, seen) in shown.iter().enumerate() {
            for (a, d) in seen.surprise.iter().enumerate().filter(|(a, _)| *a != b) {
                let t = (seen.precision * d).dot(d);
                let weight = self.sides[a].weight * self.sides[b].weight;
                gain += weight * (-self.separation[(a, b)] / 8.0).exp() * -(-t / 8.0).exp_m1();
            }
        }
        gain
    }

    /// Takes the candidate that separates most among those not taken; `None` when all are.
    pub fn choose(&mut self, taken: &[usize]) -> Option<usize> {
        let count = self.sides.first()?.columns.ncols() / 3;
        let free: Vec<usize> = (0..count).filter(|i| !taken.contains(i)).collect();
        let gains: Vec<f64> = free.par_iter().map(|&i| self.gain(i)).collect();
        let best = first_largest(&gains)?;
        self.take(free[best]);
        Some(free[best])
    }

    /// Learns from a candidate: every rival what it would under every truth.
    pub fn take(&mut self, candidate: usize) {
        let shown = self.shown(candidate);
        for (b, (side, seen)) in self.sides.iter_mut().zip(shown).enumerate() {
            let weighted = &seen.carried * seen.precision;
            for (a, d) in seen.surprise.iter().enumerate().filter(|(a, _)| *a != b) {
                side.beliefs[a] += &weighted * d;
                self.separation[(a, b)] += (seen.precision * d).dot(d);
            }
            side.covariance -= &weighted * seen.carried.transpose();
        }
    }
}

/// Choosing what determines the fitted model best (largest `det(I + X P X^T)`, as D-optimality extends a design).
pub(super) struct Determination {
    columns: DMatrix<f64>,
    covariance: DMatrix<f64>,
}

impl Determination {
    pub fn new(state: &State, columns: &DMatrix<f64>) -> Self {
        Determination { columns: columns.select_rows(&state.rows), covariance: state.covariance.clone() }
    }

    fn spread(&self, candidate: usize) -> (Matrix3<f64>, Matrix3xX<f64>) {
        let x = self.columns.columns(3 * candidate, 3);
        let carried = &self.covariance * x;
        let spread = Matrix3::identity() + Matrix3::from_column_slice(x.tr_mul(&carried).as_slice());
        (spread, Matrix3xX::from_row_slice(carried.as_slice()))
    }

    /// Takes the candidate that adds most among those not taken; `None` when all are.
    pub fn choose(&mut self, taken: &[usize]) -> Option<usize> {
        let free: Vec<usize> = (0..self.columns.ncols() / 3).filter(|i| !taken.contains(i)).collect();
        let gains: Vec<f64> = free.par_iter().map(|&i| self.spread(i).0.determinant()).collect();
        let best = free[first_largest(&gains)?];
        let (spread, carried) = self.spread(best);
        let precision = spread.cholesky().map_or_else(Matrix3::zeros, |c| c.inverse());
        self.covariance -= carried.transpose() * precision * &carried;
        Some(best)
    }
}

fn to3(x: &[f64]) -> Vector3<f64> {
    Vector3::from_column_slice(x)
}

/// Place of the largest, of equals the first.
pub(super) fn first_largest(values: &[f64]) -> Option<usize> {
    (0..values.len()).reduce(|best, k| if values[k] > values[best] { k } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rivals of one known number each: a says that the datum is 3, b that it is 0, both to within nothing.
    fn state(row: usize, mean: f64, variance: f64) -> State {
        State { rows: vec![row], mean: DVector::from_element(1, mean), covariance: DMatrix::from_element(1, 1, variance) }
    }

    /// Candidate 0 shows neither number, candidate 1 the first, candidate 2 the second, on x alone.
    fn columns() -> DMatrix<f64> {
        let mut x = DMatrix::zeros(2, 9);
        (x[(0, 3)], x[(1, 6)]) = (1.0, 1.0);
        x
    }

    #[test]
    fn the_separation_of_two_rivals_by_hand() {
        let mut rivalry = Rivalry::new(&[state(0, 3.0, 0.0), state(1, 1.0, 3.0)], &[0.25, 0.75], &columns());
        assert_eq!(rivalry.gain(0), 0.0);
        // Where a shows 3 and b certainly 0: 9 from b, and 9 from a, who is as certain.
        let by_hand = 2.0 * 0.25 * 0.75 * (1.0 - (-9.0_f64 / 8.0).exp());
        assert!((rivalry.gain(1) - by_hand).abs() < 1e-15);
        // Where b shows 1 +- sqrt(3): a certainly 0, b would take it at variance 4.
        let (of_a, of_b) = (1.0 - (-1.0_f64 / 8.0).exp(), 1.0 - (-(1.0 / 4.0) / 8.0_f64).exp());
        assert!((rivalry.gain(2) - 0.1875 * (of_a + of_b)).abs() < 1e-15);
        assert_eq!(rivalry.choose(&[]), Some(1));
        assert!((rivalry.separation[(0, 1)] - 9.0).abs() < 1e-12);
        // Then b believes, were a true (datum 0 where it has 1 +- sqrt(3)), what Kalman's step gives.
        rivalry.take(2);
        assert!((rivalry.sides[1].beliefs[0][0] - (1.0 - 3.0 / 4.0)).abs() < 1e-15);
        assert!((rivalry.sides[1].beliefs[1][0] - 1.0).abs() < 1e-15);
        assert!((rivalry.sides[1].covariance[(0, 0)] - 0.75).abs() < 1e-15);
    }

    #[test]
    fn determination_prefers_what_is_least_known() {
        let state = State {
            rows: vec![0, 1],
            mean: DVector::zeros(2),
            covariance: DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 8.0])),
        };
        let mut determination = Determination::new(&state, &columns());
        assert_eq!(determination.choose(&[]), Some(2));
        assert!((determination.covariance[(1, 1)] - 8.0 / 9.0).abs() < 1e-15);
        assert_eq!(determination.choose(&[2]), Some(1));
    }
}
