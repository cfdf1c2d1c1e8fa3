//! Sizes by sampling: a chain of Gibbs' over all coefficients, the size of each group, the common size of each kind, and a
//! noise of Student's distribution.
//!
//! A size from evidence is a single number, which few samples do not determine; a sampled one stands for all that they allow.
//! After each sweep the scale of every group is drawn anew with its shape fixed, and then that of every kind: drawn only given
//! its coefficients, a size hardly moves (interweaving, Yu & Meng 2011).

use nalgebra::{DMatrix, DVector};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use statrs::function::gamma::ln_gamma;

use super::basis::{KINDS, Kind};
use super::conditional::Sizes;
use super::evidence::{STATED_NOISE, covariance_of_rows};
use super::kernels::{Kernels, Room};
use super::rows::{Coefficients, Groups, Rows};
use crate::identify::fit::FitError;
use crate::math::linalg::Cholesky;
use crate::prediction::chance::{chi_squared, normal, one_of};

/// Number of sweeps.
const SWEEPS: usize = 160;

/// Number of those that are dropped.
const DROPPED: usize = 60;

/// Weight of the common size in a size, in coefficients: the sizes of a kind are those of Student's t.
const COMMON_WEIGHT: f64 = 2.0;

/// Size at which all groups begin, in plausible sizes.
const BEGIN: f64 = 0.05;

/// Grid of common sizes: least, largest, number of points.
const COMMON: (f64, f64, usize) = (0.01, 3.0, 48);

/// Grid of a group's new scale: logarithms of its variance over the common one.
const SCALES: (f64, f64, usize) = (-5.0, 7.0, 25);

/// Degrees of freedom that the noise may have.
const TAILS: [f64; 5] = [2.5, 4.0, 7.0, 15.0, 50.0];

/// Fixed seed: the same data give the same chain.
pub(super) const SEED: u64 = 0x0ca1_1b45;

/// What a chain found.
#[derive(Debug, Clone)]
pub(super) struct Sampled {
    /// Sizes that stand for the chain: geometric means of the sizes, means of the noise.
    pub sizes: Sizes,
    /// Mean of the coefficients, from sweeps that are not among the draws: no model is judged by draws of which it is the mean.
    pub mean: Coefficients,
    /// Coefficients of every other sweep.
    pub draws: Vec<Coefficients>,
}

fn common_size(k: usize) -> f64 {
    let (least, largest, count) = COMMON;
    least * (k as f64 * (largest / least).ln() / (count - 1) as f64).exp()
}

/// State of the chain and its memory.
struct Chain<'a> {
    rows: &'a Rows,
    groups: &'a Groups,
    y: &'a DVector<f64>,
    stated: Option<f64>,
    kinds: Vec<Kind>,
    common: [f64; KINDS.len()],
    sizes: Sizes,
    tail: f64,
    b: Coefficients,
    /// What each group moves.
    moved: DMatrix<f64>,
    /// What no coefficient explains.
    left: DVector<f64>,
    /// Weight of each row.
    weights: DVector<f64>,
    order: Vec<usize>,
    of_samples: DVector<f64>,
    of_kind: DVector<f64>,
}

/// Samples sizes and coefficients; `stated` is the variance of the noise, if that is known.
///
/// # Errors
/// When a matrix cannot be factored.
pub(super) fn sample(
    rows: &Rows,
    groups: &Groups,
    y: &DVector<f64>,
    stated: Option<f64>,
    seed: u64,
) -> Result<Sampled, FitError> {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let (n, samples, count) = (rows.count(), rows.samples.len(), groups.all.len());
    let kernels = Kernels::new(rows, groups);
    let squares = y.norm_squared() / n.max(1) as f64;
    let mut chain = Chain {
        rows,
        groups,
        y,
        stated,
        kinds: groups.all.iter().map(|g| g.kind()).collect(),
        common: [BEGIN; KINDS.len()],
        sizes: Sizes {
            groups: vec![BEGIN * BEGIN; count],
            noise: stated.unwrap_or(squares).max(f64::MIN_POSITIVE),
            weights: vec![1.0; samples],
        },
        tail: 15.0,
        b: Coefficients::zeros(rows),
        moved: DMatrix::zeros(n, count),
        left: y.clone(),
        weights: DVector::repeat(n, 1.0),
        order: (0..count).collect(),
        of_samples: DVector::zeros(samples),
        of_kind: DVector::zeros(n),
    };
    let (mut room, mut covariance, mut factor) = (Room::new(rows), DMatrix::zeros(n, n), Cholesky::new(n));
    let (mut step, mut mean) = (Coefficients::zeros(rows), Coefficients::zeros(rows));
    let mut logs = vec![0.0; count];
    let (mut noise, mut noises) = (0.0, vec![0.0; samples]);
    let mut draws = Vec::with_capacity((SWEEPS - DROPPED) / 2);
    for sweep in 0..SWEEPS {
        covariance_of_rows(&kernels, rows, groups, &chain.sizes, &mut room, &mut covariance);
        factor.factor(&covariance)?;
        let is_mean = sweep >= DROPPED && sweep % 2 == 0;
        if is_mean {
            chain.of_kind.copy_from(y);
            factor.solve_in_place(chain.of_kind.as_mut_slice());
            rows.pull(&chain.of_kind, &mut chain.of_samples, &mut step);
            groups.scale(&chain.sizes.groups, &mut step);
            mean.axpy(1.0 / ((SWEEPS - DROPPED) / 2) as f64, &step);
        }
        chain.draw_coefficients(&mut factor, &mut step, random);
        chain.find_moved();
        chain.draw_sizes(random);
        chain.draw_scales(random);
        chain.draw_common(random);
        chain.draw_noise(random);
        if sweep >= DROPPED {
            let share = 1.0 / (SWEEPS - DROPPED) as f64;
            logs.iter_mut().zip(&chain.sizes.groups).for_each(|(log, v)| *log += share * v.ln());
            noise += share * chain.sizes.noise;
            noises.iter_mut().zip(&chain.sizes.weights).for_each(|(own, w)| *own += share * chain.sizes.noise / w);
            if !is_mean {
                draws.push(chain.b.clone());
            }
        }
    }
    let weights = noises.iter().map(|own| noise / own).collect();
    let sizes = Sizes { groups: logs.iter().map(|log| log.exp()).collect(), noise, weights };
    Ok(Sampled { sizes, mean, draws })
}

impl Chain<'_> {
    /// Draws all coefficients at once: from the prior, corrected by what that misses of the residuals (Matheron's rule).
    fn draw_coefficients(&mut self, factor: &mut Cholesky, step: &mut Coefficients, random: &mut ChaCha8Rng) {
        let Chain { rows, groups, y, b, left, sizes, weights, of_samples, .. } = self;
        b.for_each(|b| *b = normal(random));
        groups.scale_by(|g| sizes.groups[g].sqrt(), b);
        left.copy_from(y);
        rows.apply(-1.0, b, of_samples, left);
        left.iter_mut().zip(weights.iter()).for_each(|(left, w)| *left -= (sizes.noise / w).sqrt() * normal(random));
        factor.solve_in_place(left.as_mut_slice());
        rows.pull(left, of_samples, step);
        groups.scale(&sizes.groups, step);
        b.axpy(1.0, step);
    }

    /// Computes what each group moves and what is left.
    fn find_moved(&mut self) {
        let Chain { rows, groups, y, b, left, moved, of_samples, .. } = self;
        left.copy_from(y);
        left.gemv(-1.0, &rows.smooth, &b.smooth, 1.0);
        moved.fill(0.0);
        for (g, span) in groups.effects.iter().enumerate() {
            let (x, b) = (rows.effects.columns(span.start, span.len()), b.effects.rows(span.start, span.len()));
            moved.column_mut(g).gemv(1.0, &x, &b, 0.0);
        }
        for (j, (spans, first)) in groups.spans.iter().zip(&groups.first).enumerate() {
            for (span, g) in spans.iter().zip(*first..) {
                let x = rows.functions[j].columns(span.start, span.len());
                of_samples.gemv(1.0, &x, &b.joints[j].rows(span.start, span.len()), 0.0);
                let mut to = moved.column_mut(g);
                for (own, angle) in rows.samples.iter().zip(of_samples.iter()) {
                    own.clone().for_each(|r| to[r] = rows.levers[j][r] * angle);
                }
            }
        }
        moved.column_iter().for_each(|own| *left -= own);
    }

    /// Draws the size of every group given its coefficients.
    fn draw_sizes(&mut self, random: &mut ChaCha8Rng) {
        for g in 0..self.kinds.len() {
            let squares = self.groups.part(g, &self.b).norm_squared();
            let common = self.common[self.kinds[g] as usize];
            let freedom = self.groups.width(g) as f64 + COMMON_WEIGHT;
            self.sizes.groups[g] = (squares + COMMON_WEIGHT * common * common) / chi_squared(freedom, random);
        }
    }

    /// Draws the scale of every group with its shape fixed, in random order.
    fn draw_scales(&mut self, random: &mut ChaCha8Rng) {
        let mut order = std::mem::take(&mut self.order);
        order.shuffle(random);
        let (least, largest, count) = SCALES;
        for &g in &order {
            let common2 = self.common[self.kinds[g] as usize].powi(2);
            let shift = common2.ln() + random.random_range(-0.25..0.25);
            let log = |k: usize| shift + least + (largest - least) * k as f64 / (count - 1) as f64;
            let own = self.moved.column(g);
            let (mut with_own, mut with_left) = (0.0, 0.0);
            for ((u, l), w) in own.iter().zip(&self.left).zip(&self.weights) {
                with_own += w * u * u;
                with_left += w * u * l;
            }
            let (v, noise) = (self.sizes.groups[g], self.sizes.noise);
            let ln = |k: usize| {
                let more = (0.5 * (log(k) - v.ln())).exp() - 1.0;
                let likelihood = (more * with_left - 0.5 * more * more * with_own) / noise;
                likelihood - 0.5 * COMMON_WEIGHT * (log(k) + common2 / log(k).exp())
            };
            let chosen = log(one_of(count, ln, random));
            let factor = (0.5 * (chosen - v.ln())).exp();
            self.left.axpy(1.0 - factor, &self.moved.column(g), 1.0);
            self.moved.column_mut(g).scale_mut(factor);
            self.groups.part_mut(g, &mut self.b).scale_mut(factor);
            self.sizes.groups[g] = chosen.exp();
        }
        self.order = order;
    }

    /// Draws the common size of every kind given its sizes, and then scales all of the kind together.
    fn draw_common(&mut self, random: &mut ChaCha8Rng) {
        for kind in KINDS {
            let of_kind = |g: &usize| self.kinds[*g] == kind;
            let (mut count, mut inverse) = (0.0, 0.0);
            self.of_kind.fill(0.0);
            for g in (0..self.kinds.len()).filter(of_kind) {
                count += 1.0;
                inverse += 1.0 / self.sizes.groups[g];
                self.of_kind += self.moved.column(g);
            }
            if count == 0.0 {
                continue;
            }
            let half = 0.5 * COMMON_WEIGHT;
            let ln = |k: usize| half * (2.0 * count * common_size(k).ln() - common_size(k).powi(2) * inverse);
            let now = common_size(one_of(COMMON.2, ln, random));
            let (mut with_own, mut with_left) = (0.0, 0.0);
            for ((u, l), w) in self.of_kind.iter().zip(&self.left).zip(&self.weights) {
                with_own += w * u * u;
                with_left += w * u * l;
            }
            let ln = |k: usize| {
                let more = common_size(k) / now - 1.0;
                (more * with_left - 0.5 * more * more * with_own) / self.sizes.noise
            };
            let chosen = common_size(one_of(COMMON.2, ln, random));
            let factor = chosen / now;
            self.left.axpy(1.0 - factor, &self.of_kind, 1.0);
            for g in 0..self.kinds.len() {
                if self.kinds[g] == kind {
                    self.moved.column_mut(g).scale_mut(factor);
                    self.groups.part_mut(g, &mut self.b).scale_mut(factor);
                    self.sizes.groups[g] *= factor * factor;
                }
            }
            self.common[kind as usize] = chosen;
        }
    }

    /// Draws the weights of the samples, the scale of the noise and its tail.
    fn draw_noise(&mut self, random: &mut ChaCha8Rng) {
        let mut weighted = 0.0;
        let (mut sum, mut sum_ln) = (0.0, 0.0);
        let mut last = 0;
        for (own, weight) in self.rows.samples.iter().zip(&mut self.sizes.weights) {
            let squares: f64 = own.clone().map(|r| self.left[r] * self.left[r]).sum();
            *weight = chi_squared(self.tail + own.len() as f64, random) / (self.tail + squares / self.sizes.noise);
            own.clone().for_each(|r| self.weights[r] = *weight);
            weighted += *weight * squares;
            sum += *weight;
            sum_ln += weight.ln();
            last = own.end;
        }
        weighted += (last..self.left.len()).map(|r| self.left[r] * self.left[r]).sum::<f64>();
        let (known, freedom) = self.stated.map_or((0.0, 0.0), |known| (known, STATED_NOISE));
        let rows = self.left.len() as f64;
        self.sizes.noise = (weighted + known * freedom).max(f64::MIN_POSITIVE) / chi_squared(rows + freedom, random);
        let samples = self.rows.samples.len() as f64;
        let ln = |k: usize| {
            let half = 0.5 * TAILS[k];
            samples * (half * half.ln() - ln_gamma(half)) + half * (sum_ln - sum)
        };
        self.tail = TAILS[one_of(TAILS.len(), ln, random)];
    }
}
