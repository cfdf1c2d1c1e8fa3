//! Evidence for one candidate: the likelihood of the residual with it over that without, averaged over its plausible
//! sizes.

use nalgebra::{DMatrix, DVector};

/// Least variance of whitened residuals: as many rows as unknowns are fitted exactly, and leave nothing to judge by.
pub(crate) const LEAST_UNIT: f64 = 1e-12;

/// Sizes over which a candidate is averaged, one sigma in plausible sizes: a decade either side of 1 (decision 0012).
pub(crate) const SIZES: [f64; 5] = [0.1, 0.3, 1.0, 3.0, 10.0];

/// Factors are multiplied until their product is larger than this.
const LARGE: f64 = 1e100;

/// Residual of the fit, and the certainty of its noise. The scale of the chi-square is itself uncertain, so all tests
/// are Student's. A stated scale that is wrong by half then raises no false alarm; from some thirty degrees of freedom
/// on this costs no power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Remainder {
    /// Whitened residual sum of squares, including the prior knowledge of the scale: `r^T r + nu_0 s_0²`.
    pub squares: f64,
    /// Its degrees of freedom: `nu + nu_0`.
    pub dof: f64,
}

impl Remainder {
    /// Estimated variance of the whitened residuals: 1 if the noise is as stated and nothing is missing.
    pub fn unit(&self) -> f64 {
        self.squares / self.dof
    }

    /// Log likelihood ratio with and without an effect that explains `explained` of the sum of squares.
    pub fn gain(&self, explained: f64) -> f64 {
        // By rounding, slightly more than the whole sum may be explained.
        -0.5 * self.dof * (1.0 - (explained / self.squares).min(1.0 - 1e-12)).ln()
    }
}

/// `ln sum exp(x)`, without overflow.
pub(crate) fn ln_sum_exp(x: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = x.clone().fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY { largest } else { largest + x.map(|x| (x - largest).exp()).sum::<f64>().ln() }
}

/// `ln mean exp(x)`.
pub(crate) fn ln_mean_exp(x: &[f64]) -> f64 {
    ln_sum_exp(x.iter().copied()) - (x.len() as f64).ln()
}

/// A candidate's projected columns in plausible sizes: their inner products `K`, and those with the remainder, `z`.
pub(crate) struct Seen {
    /// Eigenvalues of K.
    lambda: DVector<f64>,
    /// z in the basis of the eigenvectors.
    u: DVector<f64>,
}

impl Seen {
    pub fn new(k: DMatrix<f64>, z: &DVector<f64>) -> Self {
        if k.nrows() == 1 {
            return Seen { lambda: DVector::from_element(1, k[(0, 0)].max(0.0)), u: z.clone() };
        }
        let eigen = k.symmetric_eigen();
        Seen { u: eigen.eigenvectors.tr_mul(z), lambda: eigen.eigenvalues.map(|l| l.max(0.0)) }
    }

    /// `ln B = ln mean_s exp( -1/2 sum ln(1 + s² lambda) + gain(sum s² u² / (1 + s² lambda)) )`: the coefficients are
    /// normal with one sigma of s plausible sizes, and s is averaged over `sizes`.
    pub fn ln_evidence(&self, remainder: &Remainder, sizes: &[f64]) -> f64 {
        let of_size = |&s: &f64| {
            let (mut ln_grown, mut grown, mut explained) = (0.0, 1.0, 0.0);
            for (l, u) in self.lambda.iter().zip(&self.u) {
                // One logarithm of the product in place of many.
                grown *= 1.0 + s * s * l;
                if grown > LARGE {
                    ln_grown += grown.ln();
                    grown = 1.0;
                }
                explained += s * s * u * u / (1.0 + s * s * l);
            }
            remainder.gain(explained) - 0.5 * (ln_grown + grown.ln())
        };
        ln_sum_exp(sizes.iter().map(of_size)) - (sizes.len() as f64).ln()
    }

    /// Sum of squares that the best coefficients explain, `z^T K^+ z`, without directions that are only rounding; and
    /// the number of directions.
    pub fn explained(&self) -> (f64, usize) {
        let floor = 1e-9 * self.lambda.max();
        let seen = || self.lambda.iter().zip(&self.u).filter(|(l, _)| **l > floor);
        (seen().map(|(l, u)| u * u / l).sum(), seen().count())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_degrees_of_freedom_make_it_normal() {
        let remainder = Remainder { squares: 1e8, dof: 1e8 };
        assert!((remainder.gain(8.0) - 4.0).abs() < 1e-6);
    }

    #[test]
    fn evidence_of_one_column_by_hand() {
        let seen = Seen::new(DMatrix::from_element(1, 1, 3.0), &DVector::from_element(1, 6.0));
        let remainder = Remainder { squares: 1e9, dof: 1e9 };
        let by_hand = -0.5 * 4.0_f64.ln() + 0.5 * 36.0 / 4.0;
        assert!((seen.ln_evidence(&remainder, &[1.0]) - by_hand).abs() < 1e-6);
        assert_eq!(seen.explained(), (12.0, 1));
    }

    #[test]
    fn the_volume_of_many_columns_is_the_sum_of_their_logarithms() {
        let lambda: Vec<f64> = (0..60).map(|k| 10f64.powi(k % 40 - 20)).collect();
        let seen = Seen { lambda: DVector::from_vec(lambda.clone()), u: DVector::zeros(60) };
        let sum: f64 = lambda.iter().map(|l| -0.5 * l.ln_1p()).sum();
        assert!((seen.ln_evidence(&Remainder { squares: 1.0, dof: 1.0 }, &[1.0]) - sum).abs() < 1e-9);
    }

    #[test]
    fn a_column_that_is_not_seen_says_nothing() {
        let seen = Seen::new(DMatrix::zeros(2, 2), &DVector::zeros(2));
        assert_eq!(seen.ln_evidence(&Remainder { squares: 100.0, dof: 50.0 }, &SIZES), 0.0);
        assert_eq!(seen.explained(), (0.0, 0));
    }
}
