//! The search for what moved: every combination of zeros, tool, base and one bent link is weighed by its marginal likelihood.
//!
//! Whitened by what was known before the crash, the touches are of unit variance where nothing moved; a combination adds the
//! variance of its columns. The scale of noise and prior is known as well as ten measurements tell it, so that the likelihoods
//! are those of Student's t. The average ratio of all combinations to none is exceeded by `1 / alpha` with a probability of at most
//! `alpha` where nothing moved (Markov's inequality), as in a [check](calibench::monitoring::check).

use nalgebra::{DMatrix, DVector};

use super::scene::{Movable, Near, Scene};
use super::{Moved, RecoveryError};
use calibench::identify::calibration::IdentifyError;
use calibench::identify::fit::FitError;
use calibench::math::LinalgError;
use calibench::math::ScaledCholesky;

/// Most zeros that one crash takes.
const MOST_ZEROS: usize = 3;

/// Degrees of freedom that the stated noise is worth: an error of a third is not unusual.
const NOISE_FREEDOM: f64 = 10.0;

/// Share of crashes, before any data, by the number of zeros lost: none, one, two, three. Motors slip one at a time more often
/// than together.
const ZEROS_LOST: [f64; MOST_ZEROS + 1] = [0.15, 0.45, 0.25, 0.15];

/// Share of crashes in which the tool moved, before any data.
const TOOL_MOVED: f64 = 0.5;

/// The same for the base or the artifact.
const BASE_MOVED: f64 = 0.05;

/// The same for a link.
const LINK_BENT: f64 = 0.1;

/// Combinations that are looked at about their own solution.
const LOOKED_AT: usize = 16;

/// Most steps to a solution: five are usual from zeros of degrees.
const STEPS: usize = 25;

/// The step, in its own uncertainties, that ends a search: far less than what a result is rounded to.
const STEP_ENDS: f64 = 1e-3;

/// Steps beyond which values are no postures any more, rad or m.
const LOST: f64 = 2.0;

/// A combination with its evidence.
pub(super) struct Weighed {
    pub moved: Moved,
    /// Logarithm of its share before the data times its likelihood, up to a constant.
    pub ln: f64,
}

/// A combination at its own solution.
pub(super) struct Solution {
    pub weighed: Weighed,
    /// Deviation of every parameter, SI.
    pub values: DVector<f64>,
    /// Its covariance, of noise and prior as stated.
    pub covariance: DMatrix<f64>,
    /// The change of each movable parameter of the combination.
    pub changes: Vec<Change>,
    /// Sum of squares, whitened by the whole covariance.
    pub squares: f64,
}

/// The change of one parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Change {
    pub parameter: usize,
    pub value: f64,
    pub sigma: f64,
}

impl Scene {
    /// The parameters that a combination moves, with their variances added up.
    pub fn columns(&self, moved: &Moved) -> Vec<Movable> {
        let mut all: Vec<Movable> = moved.zeros.iter().filter_map(|&j| self.zeros.get(j - 1).copied()).collect();
        let mut add = |more: &[Movable]| {
            for new in more {
                match all.iter_mut().find(|m| m.parameter == new.parameter) {
                    Some(same) => same.sigma = same.sigma.hypot(new.sigma),
                    None => all.push(*new),
                }
            }
        };
        if moved.tool {
            add(&self.tool);
        }
        if moved.base {
            add(&self.base);
        }
        if let Some(link) = moved.bent.and_then(|j| self.links.get(j - 1)) {
            add(link);
        }
        all
    }

    /// Every combination but "nothing".
    fn combinations(&self) -> Vec<Moved> {
        let joints = self.zeros.len();
        let mut sets: Vec<Vec<usize>> = vec![Vec::new()];
        let mut first = 0;
        for _ in 0..MOST_ZEROS {
            let last = sets.len();
            for k in first..last {
                let from = sets[k].last().map_or(1, |j| j + 1);
                sets.extend((from..=joints).map(|j| [sets[k].as_slice(), &[j]].concat()).collect::<Vec<_>>());
            }
            first = last;
        }
        let either = |exists: bool| if exists { vec![false, true] } else { vec![false] };
        let links = || std::iter::once(None).chain((1..=self.links.len()).map(Some));
        let mut all = Vec::new();
        for zeros in &sets {
            for &tool in &either(!self.tool.is_empty()) {
                for &base in &either(!self.base.is_empty()) {
                    all.extend(links().map(|bent| Moved { zeros: zeros.clone(), tool, base, bent }));
                }
            }
        }
        all.retain(|moved| !moved.is_nothing());
        all
    }

    /// Logarithm of the share of a combination before the data.
    pub fn ln_share(&self, moved: &Moved) -> f64 {
        let one_of = |share: f64, is: bool, exists: bool| match (exists, is) {
            (false, _) => 1.0,
            (true, true) => share,
            (true, false) => 1.0 - share,
        };
        let sets = (0..moved.zeros.len()).map(|k| (self.zeros.len() - k) as f64 / (k + 1) as f64).product::<f64>();
        let zeros = ZEROS_LOST.get(moved.zeros.len()).copied().unwrap_or(0.0) / sets;
        let tool = one_of(TOOL_MOVED, moved.tool, !self.tool.is_empty());
        let base = one_of(BASE_MOVED, moved.base, !self.base.is_empty());
        let bent = one_of(LINK_BENT, moved.bent.is_some(), !self.links.is_empty());
        let of_links = if moved.bent.is_some() { self.links.len() as f64 } else { 1.0 };
        (zeros * tool * base * bent / of_links).ln()
    }

    /// Logarithm of a likelihood, up to a constant: of the logarithm of the determinant of the covariance and the sum of squares.
    fn ln_likelihood(&self, ln_determinant: f64, squares: f64) -> f64 {
        let rows = self.rows() as f64;
        -0.5 * ln_determinant - 0.5 * (NOISE_FREEDOM + rows) * (squares / NOISE_FREEDOM).ln_1p()
    }

    /// Factor of all uncertainties, from a sum of squares.
    pub fn scale(&self, squares: f64) -> f64 {
        ((NOISE_FREEDOM + squares) / (NOISE_FREEDOM + self.rows() as f64)).sqrt()
    }

    /// The likeliest combinations at their own solutions, the best first, and "nothing" beside them.
    ///
    /// # Errors
    /// When the touches are not finite under the model.
    pub fn search(&self) -> Result<Search, RecoveryError> {
        let nothing = self.solve(&Moved::default(), &self.mean)?;
        // Zeros of degrees bend every column: all are weighed near the solution in which everything may have moved.
        let everything = Moved {
            zeros: (1..=self.zeros.len()).collect(),
            tool: !self.tool.is_empty(),
            base: !self.base.is_empty(),
            bent: None,
        };
        let broad = self.solve(&everything, &self.mean)?;
        let mut starts = vec![broad.values.clone(), self.mean.clone()];
        starts.dedup();
        let mut weighed: Vec<Weighed> = Vec::new();
        for start in &starts {
            let shortlist = self.weighed(&self.near(start))?;
            for new in shortlist.into_iter().take(LOOKED_AT) {
                if !weighed.iter().any(|w| w.moved == new.moved) {
                    weighed.push(new);
                }
            }
        }
        let mut found: Vec<Solution> = Vec::with_capacity(weighed.len());
        for w in &weighed {
            let mut best = self.solve(&w.moved, &broad.values)?;
            if !best.weighed.ln.is_finite() {
                best = self.solve(&w.moved, &self.mean)?;
            }
            found.push(best);
        }
        found.retain(|s| s.weighed.ln.is_finite());
        found.sort_by(|a, b| b.weighed.ln.total_cmp(&a.weighed.ln));
        Ok(Search { nothing, found, broad })
    }

    /// Every combination near some values, the likeliest first.
    fn weighed(&self, near: &Near) -> Result<Vec<Weighed>, RecoveryError> {
        let all: Vec<Movable> =
            [&self.zeros, &self.tool, &self.base].into_iter().chain(&self.links).flatten().copied().collect();
        let mut parameters: Vec<usize> = all.iter().map(|m| m.parameter).collect();
        parameters.sort_unstable();
        parameters.dedup();
        let noise = spread(&near.jacobian, &self.covariance);
        let factor = ScaledCholesky::of(&noise).map_err(not_finite)?;
        let known = DMatrix::from_fn(noise.nrows(), parameters.len(), |r, k| near.jacobian[(r, parameters[k])]);
        let columns = factor.half(known);
        let seen = factor.half(DMatrix::from_column_slice(near.residuals.len(), 1, near.residuals.as_slice()));
        let (gram, along, squares) = (columns.tr_mul(&columns), columns.tr_mul(&seen), seen.norm_squared());
        let place = |parameter: usize| parameters.binary_search(&parameter).unwrap_or(0);
        let weigh = |moved: Moved| -> Result<Weighed, RecoveryError> {
            let columns: Vec<(usize, f64)> = self.columns(&moved).iter().map(|m| (place(m.parameter), m.sigma)).collect();
            let size = columns.len();
            let grown = DMatrix::from_fn(size, size, |r, c| {
                let [(p, s), (q, t)] = [columns[r], columns[c]];
                f64::from(u8::from(r == c)) + s * t * gram[(p, q)]
            });
            let root = ScaledCholesky::of(&grown).map_err(not_finite)?;
            let of = DMatrix::from_fn(size, 1, |k, _| columns[k].1 * along[(columns[k].0, 0)]);
            let (ln_determinant, squares) = (root.log_determinant(), squares - root.half(of).norm_squared());
            let ln = self.ln_share(&moved) + self.ln_likelihood(ln_determinant, squares.max(0.0));
            Ok(Weighed { moved, ln })
        };
        let mut all = self.combinations().into_iter().map(weigh).collect::<Result<Vec<_>, _>>()?;
        all.sort_by(|a, b| b.ln.total_cmp(&a.ln));
        Ok(all)
    }

    /// The solution of one combination, by Gauss and Newton's steps from `start`.
    pub fn solve(&self, moved: &Moved, start: &DVector<f64>) -> Result<Solution, RecoveryError> {
        let columns = self.columns(moved);
        let mut prior = self.covariance.clone();
        columns.iter().for_each(|m| prior[(m.parameter, m.parameter)] += m.sigma * m.sigma);
        let mut values = start.clone();
        let (mut ended, mut steps) = (false, 0);
        loop {
            let near = self.near(&values);
            let mut factor = ScaledCholesky::of(&spread(&near.jacobian, &prior)).map_err(not_finite)?;
            let mut solved = near.residuals.clone();
            factor.solve_in_place(&mut solved);
            let gain = &prior * near.jacobian.transpose();
            let half = factor.half(gain.transpose());
            let next = &self.mean + &gain * &solved;
            let lost = (&next - &self.mean).amax() > LOST;
            let step = &next - &values;
            steps += 1;
            if ended || lost || steps == STEPS {
                let covariance = &prior - half.tr_mul(&half);
                let squares = near.residuals.dot(&solved);
                let ln_likelihood = self.ln_likelihood(factor.log_determinant(), squares);
                let ln = if lost { f64::NEG_INFINITY } else { self.ln_share(moved) + ln_likelihood };
                let pulled = near.jacobian.tr_mul(&solved);
                let seen = factor.half(near.jacobian.clone());
                let change = |m: &Movable| {
                    let variance = m.sigma * m.sigma;
                    let left = variance * (1.0 - variance * seen.column(m.parameter).norm_squared());
                    Change { parameter: m.parameter, value: variance * pulled[m.parameter], sigma: left.max(0.0).sqrt() }
                };
                let changes = columns.iter().map(change).collect();
                let weighed = Weighed { moved: moved.clone(), ln };
                return Ok(Solution { weighed, values: next, covariance, changes, squares });
            }
            let sized = |(p, step): (usize, &f64)| {
                let variance = prior[(p, p)] - half.column(p).norm_squared();
                if variance > 0.0 { step.abs() / variance.sqrt() } else { 0.0 }
            };
            ended = step.iter().enumerate().map(sized).fold(0.0, f64::max) < STEP_ENDS;
            values = next;
        }
    }
}

/// What the search found.
pub(super) struct Search {
    pub nothing: Solution,
    /// Combinations, the best first.
    pub found: Vec<Solution>,
    /// The solution in which every zero, the tool and the base may have moved.
    pub broad: Solution,
}

/// Covariance of whitened residuals of which the parameters have a covariance.
pub(super) fn spread(jacobian: &DMatrix<f64>, covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let mut noise = jacobian * covariance * jacobian.transpose();
    (0..noise.nrows()).for_each(|k| noise[(k, k)] += 1.0);
    noise
}

pub(super) fn not_finite(error: LinalgError) -> RecoveryError {
    RecoveryError::Identify(IdentifyError::Fit(FitError::from(error)))
}
