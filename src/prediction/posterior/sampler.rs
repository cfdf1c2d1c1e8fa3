//! Draws from a linear model whose columns form groups, where the size of each group is sampled too.
//!
//! `y = X b + e`: the coefficients `b` of group g have variance `s_g²`. The sizes scatter about a common one,
//! `s_g² = 2 tau² / chi²(2)`, and tau is log-uniform; columns of known variance are sampled with them. The noise is
//! Student's t with one weight per sample; its scale and its degrees of freedom are sampled. The Gibbs sampler draws all
//! coefficients at once (Bhattacharya, Chakraborty & Mallick 2016 if there are fewer rows than columns). A fitted size
//! would be overconfident where the data contain little information; a sampled size covers all values compatible with
//! them.

use std::ops::Range;

use nalgebra::DVector;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::linear_model::{Group, KINDS, LinearModel, NoisePrior, Size, State};
use super::solver::Solver;
use crate::identify::fit::FitError;
use crate::prediction::chance::{chi_squared, normal, one_of};
use crate::prediction::worker::{self, Worker};

/// Number of chains (decision 0026).
const CHAINS: u64 = 2;
/// Number of sweeps of each chain that are discarded as burn-in.
const FORGOTTEN: usize = 15;
/// Number of sweeps of each chain that are kept.
const KEPT: usize = 45;

/// Lowest point of the log-uniform grid of common sizes, in plausible sizes (decision 0026).
const SMALLEST: f64 = 0.01;
/// Highest point of that grid, in plausible sizes (decision 0026).
const LARGEST: f64 = 3.0;
/// Number of points of that grid.
const SIZE_STEPS: usize = 40;

/// Size at which chains begin: sizes that the data require grow within a few sweeps, others shrink slowly (decision 0026).
const BEGIN: f64 = 0.02;

/// Possible degrees of freedom of the noise.
const TAILS: [f64; 5] = [2.5, 4.0, 7.0, 15.0, 50.0];

/// Weight of the common size in the size of a group, in coefficients.
const COMMON_WEIGHT: f64 = 2.0;

/// Value `k` of the grid of common sizes.
fn common_size(k: usize) -> f64 {
    SMALLEST * (k as f64 * (LARGEST / SMALLEST).ln() / (SIZE_STEPS - 1) as f64).exp()
}

/// One draw from the posterior.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Draw {
    /// The coefficients.
    pub b: DVector<f64>,
    /// Variance of the noise of a row of unit weight, in units of the noise squared.
    pub noise: f64,
    /// Degrees of freedom of the noise distribution.
    pub tail: f64,
    /// The common size of each kind.
    pub common: [f64; KINDS.len()],
}

impl Draw {
    /// Draws the noise of a further sample, in units of the noise: `width` components of one weight.
    pub fn noise_of_sample(&self, width: usize, random: &mut impl Rng) -> Vec<f64> {
        let weight = chi_squared(self.tail, random) / self.tail;
        let sigma = (self.noise / weight).sqrt();
        (0..width).map(|_| sigma * normal(random)).collect()
    }

    /// Mean square of the noise of a row, in units of the noise squared.
    pub fn mean_square(&self) -> f64 {
        self.noise * self.tail / (self.tail - 2.0)
    }
}

impl LinearModel {
    /// Draws from the posterior, one chain of it by the worker if there is one; the same `seed` gives the same draws on any
    /// number of threads, with a worker and without.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn draws(&self, seed: u64, worker: Option<&dyn Worker>) -> Result<Vec<Draw>, FitError> {
        let last = CHAINS - 1;
        let handed_over = worker::begin(worker, &(self, seed, last));
        let own: Vec<u64> = (0..if handed_over.is_some() { last } else { CHAINS }).collect();
        let chains: Result<Vec<Vec<Draw>>, FitError> = own.par_iter().map(|&k| self.chain(seed, k)).collect();
        let mut chains = chains?;
        if let Some(begun) = handed_over {
            chains.push(begun.result().map_or_else(|| self.chain(seed, last), Ok)?);
        }
        Ok(chains.into_iter().flatten().collect())
    }

    /// The draws of one chain.
    fn chain(&self, seed: u64, chain: u64) -> Result<Vec<Draw>, FitError> {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(chain);
        let rows = self.x.nrows();
        let mut state = State {
            common: [BEGIN; KINDS.len()],
            variance: vec![BEGIN * BEGIN; self.groups.len()],
            weight: vec![1.0; self.samples.len()],
            noise: self.noise.map_or(self.y.norm_squared() / rows.max(1) as f64, |prior| prior.variance).max(f64::MIN_POSITIVE),
            tail: 15.0,
        };
        let mut solver = Solver::new(self);
        let mut draws = Vec::with_capacity(KEPT);
        for sweep in 0..FORGOTTEN + KEPT {
            let mut b = solver.draw(self, &state, sweep, random)?;
            let left = self.scale_kinds(&mut b, &mut state, random);
            self.sizes(&b, &mut state, random);
            self.noise(&left, &mut state, random);
            if sweep >= FORGOTTEN {
                draws.push(Draw { b, noise: state.noise, tail: state.tail, common: state.common });
            }
        }
        Ok(draws)
    }

    /// Draws the sizes of the groups, and the common sizes.
    fn sizes(&self, b: &DVector<f64>, state: &mut State, random: &mut ChaCha8Rng) {
        for (group, variance) in self.groups.iter().zip(&mut state.variance) {
            if let Size::Drawn(kind) = group.size {
                let own: f64 = group.columns.clone().map(|k| b[k] * b[k]).sum();
                let freedom = group.columns.len() as f64 + COMMON_WEIGHT;
                *variance = (own + COMMON_WEIGHT * state.common[kind as usize].powi(2)) / chi_squared(freedom, random);
            }
        }
        let half = COMMON_WEIGHT / 2.0;
        for kind in KINDS {
            let drawn = self.groups.iter().zip(&state.variance).filter(|(g, _)| g.size == Size::Drawn(kind));
            let (count, inverse) = drawn.fold((0.0, 0.0), |(c, i), (_, v)| (c + 1.0, i + 1.0 / v));
            let ln = |k: usize| half * (2.0 * count * common_size(k).ln() - common_size(k).powi(2) * inverse);
            state.common[kind as usize] = common_size(one_of(SIZE_STEPS, ln, random));
        }
    }

    /// Scales the coefficients, sizes and common size of a kind together. Only the data determine this scale, and it
    /// moves freely where they contain no information (Liu & Sabatti 2000). Drawn one after the other, these quantities
    /// would hardly move. Returns the residuals that are left.
    fn scale_kinds(&self, b: &mut DVector<f64>, state: &mut State, random: &mut ChaCha8Rng) -> DVector<f64> {
        let mut left = self.y.clone();
        let mut of_kinds = KINDS.map(|_| DVector::zeros(left.len()));
        for Group { columns, size } in &self.groups {
            let (x, b) = (self.x.columns(columns.start, columns.len()), b.rows(columns.start, columns.len()));
            match size {
                Size::Known(_) => left.gemv(-1.0, &x, &b, 1.0),
                Size::Drawn(kind) => of_kinds[*kind as usize].gemv(1.0, &x, &b, 1.0),
            }
        }
        of_kinds.iter().for_each(|own| left -= own);
        for (kind, own) in KINDS.into_iter().zip(&of_kinds) {
            let of_kind = || self.groups.iter().filter(|g| g.size == Size::Drawn(kind)).map(|g| g.columns.clone());
            let (mut with_left, mut with_own) = (0.0, 0.0);
            for (rows, weight) in self.samples.iter().zip(&state.weight) {
                let (l, o) = (left.rows(rows.start, rows.len()), own.rows(rows.start, rows.len()));
                with_left += weight * l.dot(&o);
                with_own += weight * o.norm_squared();
            }
            let ln = |k: usize| {
                let more = common_size(k) / state.common[kind as usize] - 1.0;
                (more * with_left - 0.5 * more * more * with_own) / state.noise
            };
            let common = common_size(one_of(SIZE_STEPS, ln, random));
            let factor = common / state.common[kind as usize];
            of_kind().flatten().for_each(|k| b[k] *= factor);
            for (group, variance) in self.groups.iter().zip(&mut state.variance) {
                if group.size == Size::Drawn(kind) {
                    *variance *= factor * factor;
                }
            }
            state.common[kind as usize] = common;
            left.axpy(1.0 - factor, own, 1.0);
        }
        left
    }

    /// Draws the weights of the samples, the scale of the noise and its tail, from the residuals that are left.
    fn noise(&self, left: &DVector<f64>, state: &mut State, random: &mut ChaCha8Rng) {
        let squares: Vec<f64> = self.samples.iter().map(|rows| left.rows(rows.start, rows.len()).norm_squared()).collect();
        for ((weight, rows), square) in state.weight.iter_mut().zip(&self.samples).zip(&squares) {
            *weight = chi_squared(state.tail + rows.len() as f64, random) / (state.tail + square / state.noise);
        }
        let weighted: f64 = state.weight.iter().zip(&squares).map(|(w, s)| w * s).sum();
        let count = self.samples.iter().map(Range::len).sum::<usize>() as f64;
        let NoisePrior { variance, freedom } = self.noise.unwrap_or(NoisePrior { variance: 0.0, freedom: 0.0 });
        state.noise = (weighted + variance * freedom).max(f64::MIN_POSITIVE) / chi_squared(count + freedom, random);
        // Weights have mean one: gamma distribution of shape and rate tail/2.
        let (sum, sum_ln) = state.weight.iter().fold((0.0, 0.0), |(s, l), w| (s + w, l + w.ln()));
        let n = state.weight.len() as f64;
        let ln = |k: usize| {
            let half = TAILS[k] / 2.0;
            n * (half * half.ln() - statrs::function::gamma::ln_gamma(half)) + half * (sum_ln - sum)
        };
        state.tail = TAILS[one_of(TAILS.len(), ln, random)];
    }
}

/// The chain that a worker is handed.
#[derive(Deserialize)]
struct OneChain(LinearModel, u64, u64);

/// Computes what was handed to a worker, a chain; `None` if it cannot be drawn, or if this is none.
#[must_use]
pub fn help(job: &[u8]) -> Option<Vec<u8>> {
    let OneChain(model, seed, chain) = postcard::from_bytes(job).ok()?;
    postcard::to_allocvec(&model.chain(seed, chain).ok()?).ok()
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use nalgebra::DMatrix;
    use rand::RngExt;

    use super::*;

    /// A worker in the same process.
    #[derive(Debug, Default)]
    struct Neighbour {
        is_there: bool,
        fails: bool,
        job: Mutex<Vec<u8>>,
    }

    impl Worker for Neighbour {
        fn is_there(&self) -> bool {
            self.is_there
        }

        fn begin(&self, job: &[u8]) {
            job.clone_into(&mut self.job.lock().unwrap());
        }

        fn result(&self) -> Option<Vec<u8>> {
            if self.fails { None } else { help(&self.job.lock().unwrap()) }
        }
    }

    /// Number of robots sampled from the prior.
    const ROBOTS: u64 = 500;
    /// Number of bins of the rank histogram.
    const BINS: usize = 10;
    /// Chi-square with nine degrees of freedom exceeds this with a probability of 1 %.
    const BY_CHANCE: f64 = 21.67;

    /// Draws a model from its own prior, with the true coefficients.
    fn drawn(random: &mut ChaCha8Rng, rows: usize) -> (LinearModel, DVector<f64>) {
        let mut groups = vec![Group { columns: 0..3, size: Size::Known(4.0) }];
        groups.extend((0..12).map(|g| Group { columns: 3 + 2 * g..5 + 2 * g, size: Size::Drawn(KINDS[g % KINDS.len()]) }));
        let common: Vec<f64> = KINDS.iter().map(|_| common_size(random.random_range(0..SIZE_STEPS))).collect();
        let x = DMatrix::from_fn(rows, 27, |_, _| 3.0 * normal(random));
        let mut b = DVector::zeros(27);
        for group in &groups {
            let variance = match group.size {
                Size::Known(variance) => variance,
                Size::Drawn(kind) => COMMON_WEIGHT * common[kind as usize].powi(2) / chi_squared(COMMON_WEIGHT, random),
            };
            group.columns.clone().for_each(|k| b[k] = variance.sqrt() * normal(random));
        }
        let noise = 10.0 / chi_squared(10.0, random);
        let truth = Draw { b: b.clone(), noise, tail: TAILS[random.random_range(0..TAILS.len())], common: [0.0; KINDS.len()] };
        let samples: Vec<Range<usize>> = (0..rows / 3).map(|s| 3 * s..3 * s + 3).collect();
        let e: Vec<f64> = samples.iter().flat_map(|_| truth.noise_of_sample(3, random)).collect();
        let y = &x * &b + DVector::from_vec(e);
        (LinearModel { x, y, samples, outers: Vec::new(), groups, noise: Some(NoisePrior { variance: 1.0, freedom: 10.0 }) }, b)
    }

    /// Simulation-based calibration (Talts and others 2018): ranks of the truth among the draws are uniform.
    fn ranks_are_uniform(rows: usize) {
        let robots: Vec<u64> = (0..ROBOTS).collect();
        let ranks = |&robot: &u64| {
            let mut random = ChaCha8Rng::seed_from_u64(robot);
            random.set_stream(7);
            let (model, b) = drawn(&mut random, rows);
            let elsewhere = DMatrix::from_fn(30, 27, |_, _| normal(&mut random));
            let of = |b: &DVector<f64>| {
                let at = &elsewhere * b;
                [at.abs().mean(), at.abs().max()]
            };
            let truth = of(&b);
            let draws: Vec<[f64; 2]> = model.draws(robot, None).unwrap().iter().map(|d| of(&d.b)).collect();
            [0, 1].map(|k| draws.iter().filter(|d| d[k] < truth[k]).count() * BINS / (draws.len() + 1))
        };
        let ranks: Vec<[usize; 2]> = robots.par_iter().map(ranks).collect();
        for k in [0, 1] {
            let mut count = [0.0; BINS];
            ranks.iter().for_each(|r| count[r[k]] += 1.0);
            let expected = ROBOTS as f64 / BINS as f64;
            let chi2: f64 = count.iter().map(|c: &f64| (c - expected).powi(2) / expected).sum();
            assert!(chi2 < BY_CHANCE, "{rows} rows, {}: chi-square {chi2:.1}, {count:?}", ["mean", "largest"][k]);
        }
    }

    #[test]
    fn a_chain_drawn_by_a_worker_is_the_same_to_the_last_bit() {
        let (model, _) = drawn(&mut ChaCha8Rng::seed_from_u64(3), 24);
        let alone = model.draws(5, None).unwrap();
        let there = Neighbour { is_there: true, ..Neighbour::default() };
        assert_eq!(model.draws(5, Some(&there)).unwrap(), alone);
        let job = there.job.lock().unwrap().clone();
        let by_worker: Vec<Draw> = postcard::from_bytes(&help(&job).unwrap()).unwrap();
        assert_eq!(alone[KEPT..], by_worker);
        assert_eq!(help(&job[..job.len() - 1]), None);
        // Neither one that is not there nor one that fails changes anything.
        let away = Neighbour::default();
        assert_eq!(model.draws(5, Some(&away)).unwrap(), alone);
        assert!(away.job.lock().unwrap().is_empty());
        let failing = Neighbour { is_there: true, fails: true, ..Neighbour::default() };
        assert_eq!(model.draws(5, Some(&failing)).unwrap(), alone);
    }

    #[test]
    fn draws_rank_the_truth_uniformly_with_fewer_rows_than_columns() {
        ranks_are_uniform(24);
    }

    #[test]
    fn draws_rank_the_truth_uniformly_with_more_rows_than_columns() {
        ranks_are_uniform(60);
    }
}
