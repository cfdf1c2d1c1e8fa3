//! Blocked cross-validation: does a model predict the stretch of the data that it has not seen?
//!
//! Folds are runs of samples as they were taken, each split of every session by itself: neighbours in time share drift, neighbours on a
//! grid share pose, and a random fold would be predicted by them.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::examination::Examination;
use crate::identify::{BACKGROUND_WIDTH, Circumstance};
use crate::math::linalg;

/// Folds, where there are samples enough.
const FOLDS: usize = 10;

/// Fold of each sample: `FOLDS` runs of each session in the order of the file; where balls stand at unknown places, of each ball, since
/// nothing predicts a ball of which no sample is left. A posture is never split: its repeats would predict each other.
pub(super) fn folds(circumstances: &[Circumstance]) -> Vec<usize> {
    let place = |c: &Circumstance| (c.setup, c.free_ball);
    let mut counts = BTreeMap::new();
    circumstances.iter().for_each(|c| *counts.entry(place(c)).or_insert(0) += 1);
    let mut seen = BTreeMap::new();
    let fold = |c: &Circumstance| {
        let (count, seen) = (counts[&place(c)], seen.entry(place(c)).or_insert(0));
        *seen += 1;
        (*seen - 1) * FOLDS.min(count) / count
    };
    let alone: Vec<usize> = circumstances.iter().map(fold).collect();
    let postures = super::recommend::postures(circumstances);
    let mut of_posture = vec![None; postures.count()];
    alone.iter().zip(postures.of_samples()).map(|(&fold, &posture)| *of_posture[posture].get_or_insert(fold)).collect()
}

/// Cross-validated sum of squares of each sample, whitened, of the fitted model with these columns of the examination beside it, held
/// to an ordinary size. The model is taken as linear near the fit.
pub(super) fn cross_validated(examination: &Examination, folds: &[usize], beside: std::ops::Range<usize>) -> Vec<f64> {
    let Examination { rows, fitted, columns, circumstances, problem, fit, .. } = examination;
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
        let own = circumstances.iter().zip(folds).filter(|(_, fold)| **fold == f);
        own.flat_map(|(at, _)| at.first_row..at.first_row + at.height).collect()
    };
    let of_fold: Vec<DMatrix<f64>> = (0..count).into_par_iter().map(|f| products(&rows_of(f))).collect();
    // Known distances are no samples: they are there whichever block is left out.
    let samples_end = circumstances.iter().map(|c| c.first_row + c.height).max().unwrap_or(0);
    let always = products(&(samples_end..rows.ncols()).collect::<Vec<_>>());
    let mut all = of_fold.iter().fold(always, |sum, f| sum + f);
    // What is known beforehand, as rows of its own; the ordinary size in units of the noise that is left.
    let unit = examination.remainder.unit().max(f64::MIN_POSITIVE);
    for (k, p) in fit.kept.iter().enumerate() {
        let information = problem.parameters()[*p].knowledge.information() * examination.yardstick.weight().powi(2);
        all[(k, k)] += information;
        all[(k, size)] -= information * fit.values[*p];
    }
    (m..size).for_each(|k| all[(k, k)] += unit / (BACKGROUND_WIDTH * BACKGROUND_WIDTH));
    // Scaled, so that millimetres and microradians weigh alike; a fold that alone knows a parameter leaves it where it is.
    let scale = DVector::from_fn(size, |k, _| 1.0 / all[(k, k)].max(f64::MIN_POSITIVE).sqrt());
    let step_without = |own: &DMatrix<f64>| {
        let train = &all - own;
        let mut normal = DMatrix::from_fn(size, size, |r, c| train[(r, c)] * scale[r] * scale[c]);
        (0..size).for_each(|k| normal[(k, k)] += 1e-9);
        let mut factor = linalg::Cholesky::new(size);
        factor.factor(&normal).ok()?;
        let mut step = DVector::from_fn(size, |k, _| train[(k, size)] * scale[k]);
        factor.solve_in_place(step.as_mut_slice());
        Some(step.component_mul(&scale))
    };
    let steps: Vec<Option<DVector<f64>>> = of_fold.par_iter().map(step_without).collect();
    let square = |(at, &fold): (&Circumstance, &usize)| {
        let Some(step) = &steps[fold] else { return f64::INFINITY };
        let left = |k: usize| {
            let row = rows.column(at.first_row + k);
            let taken: f64 = chosen[..size].iter().zip(step).map(|(&c, s)| row[c] * s).sum();
            (row[m + n] - taken).powi(2)
        };
        (0..at.height).map(left).sum()
    };
    circumstances.iter().zip(folds).map(square).collect()
}
