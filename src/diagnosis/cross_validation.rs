//! Blocked cross-validation: tests whether a model predicts a stretch of the data that it was not fitted to.
//!
//! Each session is split separately, into runs of samples in the order of measurement. Samples close in time share
//! drift, and neighbours on a grid share a pose; they would predict the samples of a random fold.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::examination::Examination;
use crate::identify::BACKGROUND_WIDTH;
use crate::identify::problem::SampleContext;
use crate::math::linalg;

/// Number of folds, if there are enough samples.
const FOLDS: usize = 10;

/// Share of the information on a combination of parameters, left when a fold is left out, below which it is tied to its
/// value.
const TIED: f64 = 1e-3;

/// Fold of each sample: `FOLDS` runs per session, in the order of the file. Where ball positions are unknown, each ball
/// is split separately as well, since nothing predicts a ball without any fitted sample. A posture is never split: its
/// repeats would predict each other.
pub(crate) fn folds(contexts: &[SampleContext]) -> Vec<usize> {
    let place = |c: &SampleContext| (c.setup, c.free_ball);
    let mut counts = BTreeMap::new();
    contexts.iter().for_each(|c| *counts.entry(place(c)).or_insert(0) += 1);
    let mut seen = BTreeMap::new();
    let fold = |c: &SampleContext| {
        let (count, seen) = (counts[&place(c)], seen.entry(place(c)).or_insert(0));
        *seen += 1;
        (*seen - 1) * FOLDS.min(count) / count
    };
    let alone: Vec<usize> = contexts.iter().map(fold).collect();
    let postures = super::folds::postures(contexts);
    let mut of_posture = vec![None; postures.count()];
    alone.iter().zip(postures.of_samples()).map(|(&fold, &posture)| *of_posture[posture].get_or_insert(fold)).collect()
}

/// Cross-validated, whitened sum of squares of each sample. The model is the fitted one plus the columns `beside` of
/// the examination, which have a prior of ordinary size. It is linearised about the fit.
pub(crate) fn cross_validated(examination: &Examination, folds: &[usize], beside: std::ops::Range<usize>) -> Vec<f64> {
    missed(examination, folds, beside, |at| at.height)
}

/// As [`cross_validated`], of the positions alone.
pub(crate) fn cross_validated_positions(examination: &Examination, folds: &[usize]) -> Vec<f64> {
    missed(examination, folds, 0..0, |at| at.positions)
}

/// Squared errors of the first `height` components of every sample's whitened residual.
fn missed(
    examination: &Examination,
    folds: &[usize],
    beside: std::ops::Range<usize>,
    height: fn(&SampleContext) -> usize,
) -> Vec<f64> {
    let Examination { rows, fitted, columns, contexts, problem, fit, .. } = examination;
    let (m, n) = (fitted.len(), columns.len());
    let chosen: Vec<usize> = (0..m).chain(beside.map(|k| m + k)).chain([m + n]).collect();
    let size = chosen.len() - 1;
    let count = folds.iter().max().map_or(0, |f| f + 1);
    let gathered = |places: &[usize]| {
        let mut own = DMatrix::zeros(size + 1, places.len());
        for (mut to, &at) in own.column_iter_mut().zip(places) {
            let from = rows.column(at);
            to.iter_mut().zip(&chosen).for_each(|(x, &k)| *x = from[k]);
        }
        own
    };
    let products = |places: &[usize]| {
        let mut products = DMatrix::zeros(size + 1, size + 1);
        linalg::normal_matrix(&gathered(places), &mut products);
        products
    };
    let rows_of = |f: usize| -> Vec<usize> {
        let own = contexts.iter().zip(folds).filter(|(_, fold)| **fold == f);
        own.flat_map(|(at, _)| at.first_row..at.first_row + at.height).collect()
    };
    let of_fold: Vec<DMatrix<f64>> = (0..count).into_par_iter().map(|f| products(&rows_of(f))).collect();
    // Known distances are not samples; they belong to every training set.
    let samples_end = contexts.iter().map(|c| c.first_row + c.height).max().unwrap_or(0);
    let always = products(&(samples_end..rows.ncols()).collect::<Vec<_>>());
    let mut all = of_fold.iter().fold(always, |sum, f| sum + f);
    // Priors enter as rows of their own; the ordinary size is in units of the remaining noise.
    let unit = examination.remainder.unit().max(f64::MIN_POSITIVE);
    for (k, p) in fit.kept.iter().enumerate() {
        let information = problem.parameters()[*p].knowledge.information() * examination.noise_scale.weight().powi(2);
        all[(k, k)] += information;
        all[(k, size)] -= information * fit.values[*p];
    }
    (m..size).for_each(|k| all[(k, k)] += unit / (BACKGROUND_WIDTH * BACKGROUND_WIDTH));
    // Scaled, so that millimetres and microradians have equal weight. What hardly anything but the left-out fold
    // determines stays at its value: its error would say nothing of the model.
    let scale = DVector::from_fn(size, |k, _| 1.0 / all[(k, k)].max(f64::MIN_POSITIVE).sqrt());
    let step_without = |own: &DMatrix<f64>| {
        let train = &all - own;
        let mut normal = DMatrix::from_fn(size, size, |r, c| (train[(r, c)] + TIED * all[(r, c)]) * scale[r] * scale[c]);
        (0..size).for_each(|k| normal[(k, k)] += 1e-9);
        let mut factor = linalg::Cholesky::new(size);
        factor.factor(&normal).ok()?;
        let mut step = DVector::from_fn(size, |k, _| train[(k, size)] * scale[k]);
        factor.solve_in_place(step.as_mut_slice());
        Some(step.component_mul(&scale))
    };
    let steps: Vec<Option<DVector<f64>>> = of_fold.par_iter().map(step_without).collect();
    let square = |(at, &fold): (&SampleContext, &usize)| {
        let Some(step) = &steps[fold] else { return f64::INFINITY };
        let left = |k: usize| {
            let row = rows.column(at.first_row + k);
            let taken: f64 = chosen[..size].iter().zip(step).map(|(&c, s)| row[c] * s).sum();
            (row[m + n] - taken).powi(2)
        };
        (0..height(at)).map(left).sum()
    };
    contexts.iter().zip(folds).map(square).collect()
}
