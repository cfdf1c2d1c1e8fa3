//! Blocked cross-validation: tests whether a model predicts a stretch of the data that it was not fitted to.
//!
//! Each session is split separately, into runs of samples in the order of measurement. Samples close in time share
//! drift, and neighbours on a grid share a pose; they would predict the samples of a random fold.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::examination::Examination;
use crate::identify::BACKGROUND_WIDTH;
use crate::identify::fit::FitError;
use crate::identify::problem::SampleContext;
use crate::math::linalg;
use crate::math::positive_definite::ScaledCholesky;

/// Number of folds, if there are enough samples.
const FOLDS: usize = 10;

/// Share of the information on a combination of parameters, left when a fold is left out, below which it is tied to its
/// value.
const TIED: f64 = 1e-3;

/// Added to the unit diagonal of a normal matrix: the square root of the rounding of a sum of products.
const RIDGE: f64 = 1e-9;

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
///
/// # Errors
/// When an inner product is not finite.
pub(crate) fn cross_validated(
    examination: &Examination,
    folds: &[usize],
    beside: std::ops::Range<usize>,
) -> Result<Vec<f64>, FitError> {
    missed(examination, folds, beside, |at| at.height)
}

/// As [`cross_validated`], of the positions alone.
///
/// # Errors
/// As [`cross_validated`].
pub(crate) fn cross_validated_positions(examination: &Examination, folds: &[usize]) -> Result<Vec<f64>, FitError> {
    missed(examination, folds, 0..0, |at| at.positions)
}

/// Squared errors of the first `height` components of every sample's whitened residual.
fn missed(
    examination: &Examination,
    folds: &[usize],
    beside: std::ops::Range<usize>,
    height: fn(&SampleContext) -> usize,
) -> Result<Vec<f64>, FitError> {
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
        let information = problem.information(*p) * examination.noise_scale.weight().powi(2);
        all[(k, k)] += information;
        all[(k, size)] -= information * fit.values[*p];
    }
    (m..size).for_each(|k| all[(k, k)] += unit / (BACKGROUND_WIDTH * BACKGROUND_WIDTH));
    // Scaled, so that millimetres and microradians have equal weight. What hardly anything but the left-out fold
    // determines stays at its value: its error would say nothing of the model.
    let scale = |k: usize| 1.0 / all[(k, k)].max(f64::MIN_POSITIVE).sqrt();
    let step_without = |own: &DMatrix<f64>| {
        let train = &all - own;
        let mut factor = ScaledCholesky::new(size);
        factor.factor(scale, |r, c| train[(r, c)] + TIED * all[(r, c)], |_, _| RIDGE)?;
        let mut step = train.column(size).rows(0, size).into_owned();
        factor.solve_in_place(&mut step);
        Ok(step)
    };
    let steps = of_fold.par_iter().map(step_without).collect::<Result<Vec<DVector<f64>>, FitError>>()?;
    let square = |(at, &fold): (&SampleContext, &usize)| {
        let step = &steps[fold];
        let left = |k: usize| {
            let row = rows.column(at.first_row + k);
            let taken: f64 = chosen[..size].iter().zip(step).map(|(&c, s)| row[c] * s).sum();
            (row[m + n] - taken).powi(2)
        };
        (0..height(at)).map(left).sum()
    };
    Ok(contexts.iter().zip(folds).map(square).collect())
}
