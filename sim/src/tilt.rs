//! Errors of the robot sampled from another distribution than the scenario's, so that robots with rare results are frequent.
//!
//! The result is close to a quadratic form of the sampled errors x (in units of their one-sigma): with the linear response A of
//! the errors at the validation poses and their part e that is not sampled, the mean square is `Q(x) = |A x + e|² / n`.
//! Weighing the normal density by `exp(theta Q)` gives another normal density, under which the mean square of a robot is on
//! average as large as it is rarely (Glasserman, Heidelberger & Shahabuddin 2000, who find the losses of portfolios so). A
//! share of the trials is sampled as the scenario states, so that no weight exceeds the inverse of that share, however wrong
//! the linear response is (Hesterberg 1995, defensive mixtures). Weights make every mean exactly that of the scenario: the
//! response decides what an answer costs, and never what it is.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rand::RngExt;
use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use crate::random::Streams;

/// Share of the trials that are sampled as the scenario states.
const AS_STATED: f64 = 0.2;

/// Largest part of the way to the pole of the moment generating function, where the tilted density has no width.
const NEAREST_TO_POLE: f64 = 1.0 - 1e-9;

/// Bisections of the exponent: to the last bits of a number.
const BISECTIONS: usize = 100;

/// Samples the errors of a robot, with the importance weight of each.
#[derive(Debug, Clone)]
pub struct Tilt {
    /// Share of trials sampled as stated.
    as_stated: f64,
    /// The other trials are `centre + spread * (standard normal numbers)`.
    centre: DVector<f64>,
    spread: DMatrix<f64>,
    form: QuadraticForm,
    theta: f64,
    /// Logarithm of the mean of `exp(theta Q)` over the scenario's robots.
    log_mean: f64,
}

/// `Q(x) = constant + linear . x + x . curvature x`.
#[derive(Debug, Clone)]
pub struct QuadraticForm {
    constant: f64,
    linear: DVector<f64>,
    curvature: DMatrix<f64>,
}

impl QuadraticForm {
    /// `|response x + offset|² / n` with `n` rows.
    pub fn of(response: &DMatrix<f64>, offset: &DVector<f64>) -> Self {
        let n = offset.len().max(1) as f64;
        QuadraticForm {
            constant: offset.norm_squared() / n,
            linear: response.tr_mul(offset) * (2.0 / n),
            curvature: response.tr_mul(response) / n,
        }
    }

    /// Its value.
    pub fn at(&self, x: &DVector<f64>) -> f64 {
        self.constant + self.linear.dot(x) + x.dot(&(&self.curvature * x))
    }
}

/// Logarithm of the mean of `exp(theta Q)` for standard normal x, with its first two derivatives: those are mean and variance of
/// Q under the tilted density. By principal axes: curvature `l` and slope `b` of each.
fn cumulant(theta: f64, constant: f64, axes: &[(f64, f64)]) -> [f64; 3] {
    let mut sums = [theta * constant, constant, 0.0];
    for &(l, b) in axes {
        let v = 1.0 / (1.0 - 2.0 * theta * l);
        sums[0] += 0.5 * v.ln() + 0.5 * (theta * b).powi(2) * v;
        sums[1] += l * v + theta * b * b * v + theta * theta * b * b * l * v * v;
        sums[2] += 2.0 * (l * v).powi(2) + b * b * v * (1.0 + 2.0 * theta * l * v).powi(2);
    }
    sums
}

/// Probability that Q exceeds its mean under the tilt `theta`, by the saddlepoint (Lugannani & Rice 1980).
fn exceeded(theta: f64, constant: f64, axes: &[(f64, f64)]) -> f64 {
    let [k, mean, variance] = cumulant(theta, constant, axes);
    let (r, u) = ((2.0 * (theta * mean - k)).max(0.0).sqrt(), theta * variance.sqrt());
    let normal = Normal::standard();
    normal.sf(r) + normal.pdf(r) * (1.0 / u - 1.0 / r)
}

impl Tilt {
    /// Draws robots whose mean square `form` is on average what `share` of the scenario's robots stay below; `None` if the
    /// sampled errors change nothing.
    pub fn towards(form: QuadraticForm, share: f64) -> Option<Self> {
        let eigen = SymmetricEigen::try_new(form.curvature.clone(), f64::EPSILON, 0)?;
        let slopes = eigen.eigenvectors.tr_mul(&form.linear);
        let axes: Vec<(f64, f64)> = eigen.eigenvalues.iter().map(|l| l.max(0.0)).zip(slopes.iter().copied()).collect();
        let steepest = axes.iter().map(|(l, _)| *l).fold(0.0, f64::max);
        if steepest.is_nan() || steepest <= 0.0 {
            return None;
        }
        let [mut low, mut high] = [0.0, NEAREST_TO_POLE / (2.0 * steepest)];
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if exceeded(middle, form.constant, &axes) > 1.0 - share {
                low = middle;
            } else {
                high = middle;
            }
        }
        let theta = 0.5 * (low + high);
        let width = |k: usize| 1.0 / (1.0 - 2.0 * theta * axes[k].0);
        let d = axes.len();
        let along = DVector::from_fn(d, |k, _| theta * axes[k].1 * width(k));
        let widths = DMatrix::from_diagonal(&DVector::from_fn(d, |k, _| width(k).sqrt()));
        let [log_mean, ..] = cumulant(theta, form.constant, &axes);
        Some(Tilt {
            as_stated: AS_STATED,
            centre: &eigen.eigenvectors * along,
            spread: &eigen.eigenvectors * widths,
            form,
            theta,
            log_mean,
        })
    }

    /// Every robot has these errors, in units of their one-sigma.
    pub fn fixed(errors: DVector<f64>) -> Self {
        let d = errors.len();
        let nothing = DMatrix::zeros(d, d);
        let form = QuadraticForm { constant: 0.0, linear: DVector::zeros(d), curvature: nothing.clone() };
        Tilt { as_stated: 0.0, centre: errors, spread: nothing, form, theta: 0.0, log_mean: 0.0 }
    }

    /// The errors of the robot of a trial, made from standard normal numbers.
    pub fn drawn(&self, standard: Vec<f64>, streams: &Streams) -> Vec<f64> {
        if streams.stream("tilt").random::<f64>() < self.as_stated {
            return standard;
        }
        (&self.centre + &self.spread * DVector::from_vec(standard)).as_slice().to_vec()
    }

    /// Density of these errors in the scenario over that from which they are sampled: at most the inverse of the share that is
    /// sampled as stated.
    pub fn weight(&self, errors: &[f64]) -> f64 {
        let q = self.form.at(&DVector::from_column_slice(errors));
        1.0 / (self.as_stated + (1.0 - self.as_stated) * (self.theta * q - self.log_mean).exp())
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::StandardNormal;

    use super::*;

    /// A response of 60 errors to 12 draws, of very different strengths, beside a part that is not sampled.
    fn form() -> QuadraticForm {
        let mut random = Streams { seed: 5, trial: 0 }.stream("response");
        let response = DMatrix::from_fn(60, 12, |_, k| random.sample::<f64, _>(StandardNormal) / (1.0 + k as f64));
        let offset = DVector::from_fn(60, |_, _| 0.7 * random.sample::<f64, _>(StandardNormal));
        QuadraticForm::of(&response, &offset)
    }

    fn errors(tilt: &Tilt, trial: u64) -> Vec<f64> {
        let streams = Streams { seed: 11, trial };
        let mut random = streams.stream("effects");
        tilt.drawn((0..12).map(|_| random.sample(StandardNormal)).collect(), &streams)
    }

    /// Means of the scenario from tilted draws: weights are 1 on average, as are the squares of every error.
    #[test]
    fn weights_give_back_the_distribution_of_the_scenario() {
        /// Number of trials.
        const TRIALS: u64 = 40_000;
        let tilt = Tilt::towards(form(), 0.999).expect("it responds");
        let (mut sums, mut squares) = ([0.0; 13], [0.0; 13]);
        for trial in 0..TRIALS {
            let x = errors(&tilt, trial);
            let w = tilt.weight(&x);
            assert!(w > 0.0 && w <= 1.0 / AS_STATED);
            for (k, value) in x.iter().map(|x| w * x * x).chain([w]).enumerate() {
                sums[k] += value;
                squares[k] += value * value;
            }
        }
        for (sum, squares) in sums.iter().zip(&squares) {
            let mean = sum / TRIALS as f64;
            let sigma = ((squares / TRIALS as f64 - mean * mean) / TRIALS as f64).sqrt();
            // Thirteen numbers within 4 sigma: missed by chance once in a thousand seeds.
            assert!((mean - 1.0).abs() < 4.0 * sigma, "{mean} +- {sigma}");
        }
    }

    /// The share of plain robots beyond the mean of tilted ones is as requested: the saddlepoint is good to a few per cent.
    #[test]
    fn tilted_robots_are_as_bad_as_the_rare_ones() {
        let form = form();
        let tilt = Tilt::towards(form.clone(), 0.99).expect("it responds");
        let axes = SymmetricEigen::new(form.curvature.clone());
        let slopes = axes.eigenvectors.tr_mul(&form.linear);
        let pairs: Vec<(f64, f64)> = axes.eigenvalues.iter().copied().zip(slopes.iter().copied()).collect();
        let [_, target, _] = cumulant(tilt.theta, form.constant, &pairs);
        let mut random = Streams { seed: 2, trial: 0 }.stream("plain");
        /// Number of robots sampled as stated.
        const ROBOTS: usize = 100_000;
        let beyond = (0..ROBOTS).filter(|_| {
            let x = DVector::from_fn(12, |_, _| random.sample::<f64, _>(StandardNormal));
            form.at(&x) > target
        });
        let share = beyond.count() as f64 / ROBOTS as f64;
        assert!((share / 0.01 - 1.0).abs() < 0.15, "{share}");
        // And the tilted ones are there on average.
        let far: Vec<f64> = (0..4000).map(|trial| form.at(&DVector::from_vec(errors(&tilt, trial)))).collect();
        let mean = far.iter().sum::<f64>() / far.len() as f64;
        let plain = form.constant + form.curvature.trace();
        let expected = AS_STATED * plain + (1.0 - AS_STATED) * target;
        assert!((mean / expected - 1.0).abs() < 0.05, "{mean} {expected}");
    }

    /// Derivatives of the cumulant by differences.
    #[test]
    fn the_cumulant_has_its_derivatives() {
        let axes = [(0.4, 0.3), (0.1, -0.8), (0.0, 0.5)];
        let (theta, h) = (0.6, 1e-4);
        let [low, here, high] = [theta - h, theta, theta + h].map(|t| cumulant(t, 0.2, &axes));
        assert!(((high[0] - low[0]) / (2.0 * h) - here[1]).abs() < 1e-6);
        assert!(((high[1] - low[1]) / (2.0 * h) - here[2]).abs() < 1e-5);
    }

    #[test]
    fn what_changes_nothing_has_no_tilt() {
        let still = QuadraticForm::of(&DMatrix::zeros(6, 2), &DVector::repeat(6, 1.0));
        assert!(Tilt::towards(still, 0.999).is_none());
        let fixed = Tilt::fixed(DVector::from_vec(vec![0.5, -2.0]));
        assert_eq!(fixed.drawn(vec![1.0, 1.0], &Streams { seed: 1, trial: 3 }), [0.5, -2.0]);
    }
}
