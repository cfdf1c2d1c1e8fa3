//! Search for errors of one joint that follow two variables at once: two joint angles, or the joint's own load and an angle.
//!
//! `theta_J += f(v, w)`, where f is a Gaussian process whose covariance is the product of those of the [heat map](super::heat_map).
//! Columns of one variable leave such an error at the poses that were measured and put it elsewhere.

use std::borrow::Cow;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::background::Background;
use super::evidence::{LEAST_UNIT, Seen, ln_mean_exp};
use super::examination::Examination;
use super::heat_map::{AMPLITUDE, CREDIBLE_ODDS, CurveTerm, SIZES, Scaled, Variable, own_effect, size, term, variables};
use super::sweep::{self, Block, Sweep};
use crate::effects::own::OwnEffect;
use crate::identify::fit::FitError;
use crate::math::positive_definite;
use crate::robot::JointKind;

/// Length scales on [-1, 1]; the first one finds the pair, both describe it.
const LENGTHS: [f64; 2] = [0.7, 0.4];

/// Terms whose variance is below this share of the largest are left out.
const LEAST_VARIANCE: f64 = 1e-3;

/// Highest term of either variable.
const HIGHEST: usize = 9;

/// Number of pairs that are described after the search.
const DESCRIBED: usize = 3;

/// The error of a joint as a function of two variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// The joint, counted from 0.
    pub joint: usize,
    /// The variables.
    pub variables: [Variable; 2],
    /// Log evidence vs. background that any joint follows any pair, if it is this one.
    pub ln_evidence_against_background: f64,
    /// Share of the remaining sum of squares that it explains at its plausible size.
    pub explains: f64,
    /// The surface as terms of a user-defined effect.
    pub terms: Vec<CurveTerm>,
}

/// A joint and two variables, by index.
#[derive(Clone, Copy)]
struct Pair {
    joint: usize,
    variables: [usize; 2],
}

impl Surface {
    /// The surface with the highest evidence, if it is credible.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub(crate) fn best(examination: &Examination, background: &Background) -> Result<Option<Self>, FitError> {
        let variables = variables(examination);
        let robot = examination.problem.robot();
        let turning: Vec<usize> = (0..robot.joints()).filter(|&j| robot.kind(j) == JointKind::Revolute).collect();
        let search = |&joint: &usize| {
            let pairs = pairs(joint, &variables);
            let features = pairs.iter().map(|p| features(*p, &variables, LENGTHS[0])).collect::<Vec<_>>();
            let Some(count) = features.first().map(DMatrix::ncols) else { return Vec::new() };
            let samples = examination.contexts.len();
            let mut all = DMatrix::zeros(samples, count * features.len());
            features.iter().enumerate().for_each(|(k, of)| all.columns_mut(k * count, count).copy_from(of));
            let sweep = Sweep::new(examination, background, &sweep::joint(&examination.contexts, joint), Cow::Owned(all));
            let ln = |k: usize| sweep.block(k * count, count, AMPLITUDE).ln_evidence(examination, background, &SIZES)[1];
            pairs.into_iter().enumerate().map(|(k, pair)| (pair, ln(k))).collect()
        };
        let mut found: Vec<(Pair, f64)> = turning.par_iter().flat_map_iter(search).collect();
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let tried = found.len() as f64;
        let described = found.iter().take(DESCRIBED).map(|(pair, _)| {
            let surface = of_pair(examination, background, *pair, &variables)?;
            Ok(Surface { ln_evidence_against_background: surface.ln_evidence_against_background - tried.ln(), ..surface })
        });
        let described = described.collect::<Result<Vec<Surface>, FitError>>()?.into_iter();
        let best = described.max_by(|a, b| a.ln_evidence_against_background.total_cmp(&b.ln_evidence_against_background));
        Ok(best.filter(|s| s.ln_evidence_against_background > CREDIBLE_ODDS.ln()))
    }

    /// Computes the surface of any joint, counted from 0, and pair; `None` if a variable does not vary in the data.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn of(examination: &Examination, joint: usize, over: [Variable; 2]) -> Result<Option<Self>, FitError> {
        let variables = variables(examination);
        let place = |of: Variable| variables.iter().position(|(v, _)| *v == of);
        let (Some(v), Some(w)) = (place(over[0]), place(over[1])) else { return Ok(None) };
        let background = Background::new(examination)?;
        Ok(Some(of_pair(examination, &background, Pair { joint, variables: [v, w] }, &variables)?))
    }

    /// As the verb `add` takes it: `curve:3:q2:q4`.
    #[must_use]
    pub fn id(&self) -> String {
        let [v, w] = self.variables.map(Variable::name);
        format!("curve:{}:{v}:{w}", self.joint + 1)
    }

    /// Name of the surface as a user-defined effect: `curve_3_q2_q4`.
    #[must_use]
    pub fn effect_name(&self) -> String {
        self.id().replace([':', '+'], "_")
    }

    /// The surface as a user-defined effect, with a prior of the size estimated from the data.
    pub(crate) fn own_effect(&self) -> OwnEffect {
        own_effect(self.effect_name(), self.joint, &self.terms)
    }
}

/// The pairs that the error of a joint may follow: two angles, or its own torque and an angle.
fn pairs(joint: usize, variables: &[(Variable, Scaled)]) -> Vec<Pair> {
    let is_angle = |k: &usize| matches!(variables[*k].0, Variable::Angle(_));
    let angles: Vec<usize> = (0..variables.len()).filter(is_angle).collect();
    let own = variables.iter().position(|(v, _)| *v == Variable::Torque(joint));
    let of_angles = angles.iter().enumerate().flat_map(|(k, &v)| angles[k + 1..].iter().map(move |&w| [v, w]));
    let of_load = own.into_iter().flat_map(|v| angles.iter().map(move |&w| [v, w]));
    of_angles.chain(of_load).map(|variables| Pair { joint, variables }).collect()
}

/// Numbers of the terms of both variables.
fn terms(length: f64) -> impl Iterator<Item = [usize; 2]> {
    let variance = move |m: usize, n: usize| (size(m, length) * size(n, length)).powi(2);
    let all = (0..HIGHEST).flat_map(|m| (0..HIGHEST).map(move |n| [m, n]));
    all.filter(move |&[m, n]| variance(m, n) >= LEAST_VARIANCE * variance(0, 0))
}

/// The terms of a pair at every sample: samples x terms.
fn features(pair: Pair, variables: &[(Variable, Scaled)], length: f64) -> DMatrix<f64> {
    let [v, w] = pair.variables.map(|k| &variables[k].1.u);
    let terms: Vec<[usize; 2]> = terms(length).collect();
    DMatrix::from_fn(v.len(), terms.len(), |i, k| term(terms[k][0], length, v[i]) * term(terms[k][1], length, w[i]))
}

/// The surface of a pair, at the length and amplitude with the highest evidence.
fn of_pair(
    examination: &Examination,
    background: &Background,
    pair: Pair,
    variables: &[(Variable, Scaled)],
) -> Result<Surface, FitError> {
    let remainder = &examination.remainder;
    let of_length = LENGTHS.map(|length| {
        let features = features(pair, variables, length);
        let count = features.ncols();
        let carriers = sweep::joint(&examination.contexts, pair.joint);
        let block = Sweep::new(examination, background, &carriers, Cow::Owned(features)).block(0, count, AMPLITUDE);
        let aware = block.ln_evidence(examination, background, &SIZES)[1];
        let seen = Seen::new(block.k.clone(), &block.z);
        let of_size = SIZES.map(|s| (s, seen.ln_evidence(remainder, &[s])));
        let (amplitude, plain) = of_size.into_iter().fold((1.0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
        (length, aware, plain, amplitude, block)
    });
    let ln_evidence_against_background = ln_mean_exp(&of_length.each_ref().map(|found| found.1));
    let [coarse, fine] = of_length;
    let (length, _, _, amplitude, block) = if coarse.2 >= fine.2 { coarse } else { fine };
    let [v, w] = pair.variables.map(|k| &variables[k]);
    let term = |[m, n]: [usize; 2]| CurveTerm {
        basis: format!("{} * {}", v.1.basis(m, &v.0.expression()), w.1.basis(n, &w.0.expression())),
        size: amplitude * AMPLITUDE * size(m, length) * size(n, length),
    };
    Ok(Surface {
        joint: pair.joint,
        variables: [v.0, w.0],
        ln_evidence_against_background,
        explains: explained(&block, amplitude, remainder.unit())? / remainder.squares,
        terms: terms(length).map(term).collect(),
    })
}

/// Sum of squares that the posterior mean of these columns explains, for coefficients of `amplitude` and residuals of variance
/// `unit`.
fn explained(block: &Block, amplitude: f64, unit: f64) -> Result<f64, FitError> {
    let (count, unit) = (block.z.len(), unit.max(LEAST_UNIT));
    let precision = &block.k / unit + DMatrix::identity(count, count) / (amplitude * amplitude);
    let mean = positive_definite::inverse(precision)? * (&block.z / unit);
    Ok(2.0 * mean.dot(&block.z) - (&block.k * &mean).dot(&mean))
}
