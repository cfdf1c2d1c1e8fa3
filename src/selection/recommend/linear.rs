//! A fitted model and its possible corrections, linearised about the fit. The prediction of left-out postures by any
//! choice of columns is then linear algebra on the same columns, with errors of second order.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::diagnosis::Examination;
use crate::diagnosis::examination::Span;
use crate::diagnosis::folds::{Folds, places_of_balls, postures};
use crate::identify::fit::FitError;
use crate::identify::problem::Parameter;
use crate::math::linalg;
use crate::math::positive_definite::ScaledCholesky;
use crate::measure::dataset::NamedDataset;
use crate::units::DEG;

/// Held-out rows count only inside the joint ranges of the rows that predict them, extended by this share of the range
/// at either end.
const MARGIN: f64 = 0.1;

/// Smallest extension of a range, rad.
const LEAST_MARGIN: f64 = 1.0 * DEG;

/// A set-up or a ball with fewer training rows per parameter than this is determined from the held-out rows themselves.
const ROWS_A_NUMBER: f64 = 2.0;

/// Added to the unit diagonal of a normal matrix, so that what the rows do not determine keeps its fitted value: the square root
/// of the rounding of a sum of products.
const RIDGE: f64 = 1e-9;

/// A choice of columns, with their priors.
#[derive(Debug, Clone)]
pub(super) struct Choice {
    /// Indices of the columns: first those of the fitted model, then those of candidates.
    pub columns: Vec<usize>,
    /// Prior information of each, 1/unit², in units of the whitened residuals.
    pub information: Vec<f64>,
    /// Contribution of the prior to the gradient of each, at the fit: `information * (prior mean - fit)`.
    pub pull: Vec<f64>,
}

/// The linearised columns, sample by sample.
pub(super) struct Linear<'a> {
    /// Whitened and transposed: one row per column of the model, then the residuals; one column per scalar residual.
    pub rows: &'a DMatrix<f64>,
    pub fitted: usize,
    pub spans: Vec<Span>,
    /// Scalar residuals of each sample, by index.
    pub stretch: Vec<Range<usize>>,
    /// Posture of each sample, and samples of each posture.
    pub posture: Vec<usize>,
    pub members: Vec<Vec<usize>>,
    /// Joint angles of each sample, rad.
    pub q: Vec<Vec<f64>>,
    /// Factor that converts a whitened square to m², for each sample.
    unit: Vec<f64>,
    /// Samples that are neither fitted nor scored.
    pub aside: Vec<bool>,
    /// For each fitted column, the number of the set-up, ball or other item that owns it; `None` for the arm.
    local: Vec<Option<usize>>,
    /// Sum of the squares of each column.
    energy: Vec<f64>,
    /// Index of the place of the ball of each sample; `None` without a ball.
    pub places: Vec<Option<usize>>,
    /// Factor that converts prior information of a fit to units of these rows, which are weighted by the known noise
    /// rather than the stated one.
    pub weight2: f64,
    /// Prior information of the fitted columns, and its pull.
    information: Vec<f64>,
    pull: Vec<f64>,
}

/// Inner products of the rows of each fold, and of all rows.
pub(super) struct FoldProducts {
    pub folds: Folds,
    of_fold: Vec<DMatrix<f64>>,
    all: DMatrix<f64>,
}

impl<'a> Linear<'a> {
    /// Linearises an examined fit and its candidates.
    pub fn new(examination: &'a Examination, datasets: &[NamedDataset<'_>]) -> Self {
        let Examination { rows, fitted, spans, contexts, problem, fit, .. } = examination;
        let parameters = problem.parameters();
        let postures = postures(contexts);
        let weight2 = examination.noise_scale.weight().powi(2);
        let information: Vec<f64> = fit.kept.iter().map(|&p| weight2 * problem.information(p)).collect();
        let pull = fit.kept.iter().zip(&information).map(|(&p, i)| -i * fit.values[p]).collect();
        Linear {
            rows,
            fitted: fitted.len(),
            spans: spans.clone(),
            stretch: contexts.iter().map(|c| c.first_row..c.first_row + c.height).collect(),
            posture: postures.of_samples().to_vec(),
            members: postures.members(),
            q: contexts.iter().map(|c| c.q.clone()).collect(),
            unit: examination.squared_units(),
            aside: vec![false; contexts.len()],
            local: locals(fit.kept.iter().map(|&p| &parameters[p])),
            energy: rows.row_iter().map(|row| row.norm_squared()).collect(),
            places: places_of_balls(examination, datasets),
            weight2,
            information,
            pull,
        }
    }

    /// The choice of the fitted model alone.
    pub fn base(&self) -> Choice {
        Choice { columns: (0..self.fitted).collect(), information: self.information.clone(), pull: self.pull.clone() }
    }

    /// The choice of the fitted model and candidates, each with the prior information of its parameters in a fit.
    pub fn with(&self, held: impl Iterator<Item = (usize, f64)>) -> Choice {
        let mut choice = self.base();
        for (candidate, information) in held {
            for k in self.spans[candidate].range() {
                choice.columns.push(self.fitted + k);
                choice.information.push(self.weight2 * information);
                choice.pull.push(0.0);
            }
        }
        choice
    }

    /// Number of scalar residuals not excluded, known distances included.
    pub fn scalars(&self) -> usize {
        let aside: usize = (0..self.stretch.len()).filter(|&s| self.aside[s]).map(|s| self.stretch[s].len()).sum();
        self.rows.ncols() - aside
    }

    /// Effective number of parameters of a choice: the trace of its hat matrix, from the inner products `all` of all
    /// rows.
    ///
    /// # Errors
    /// When the normal matrix cannot be factored.
    pub fn effective(&self, all: &DMatrix<f64>, choice: &Choice) -> Result<f64, FitError> {
        let mut factor = self.factored(all, choice)?;
        let m = choice.columns.len();
        let inverse = factor.inverse_of_scaled();
        let scale = factor.scale();
        let held = |k: usize| inverse[(k, k)] * scale[k] * scale[k] * choice.information[k];
        Ok(m as f64 - (0..m).map(held).sum::<f64>())
    }

    /// Factors the normal matrix of a choice, from inner products of rows. The scale is computed from all rows, as those of a
    /// fold may not determine a parameter.
    fn factored(&self, products: &DMatrix<f64>, choice: &Choice) -> Result<ScaledCholesky, FitError> {
        let m = choice.columns.len();
        let mut normal = DMatrix::from_fn(m, m, |r, c| products[(choice.columns[r], choice.columns[c])]);
        (0..m).for_each(|k| normal[(k, k)] += choice.information[k]);
        let size = |k: usize| (self.energy[choice.columns[k]] + choice.information[k]).max(f64::MIN_POSITIVE);
        let mut factor = ScaledCholesky::new(m);
        // A parameter that is determined only by the held-out fold keeps its fitted value.
        factor.factor(|k| 1.0 / size(k).sqrt(), |r, c| normal[(r, c)], |_, _| RIDGE)?;
        Ok(factor)
    }

    fn taken(&self) -> impl Iterator<Item = usize> {
        (0..self.stretch.len()).filter(|&s| !self.aside[s])
    }

    /// Inner products of the rows of these samples.
    fn products(&self, samples: &[usize]) -> DMatrix<f64> {
        let width = self.rows.nrows();
        let count: usize = samples.iter().map(|&s| self.stretch[s].len()).sum();
        let mut rows = DMatrix::zeros(width, count);
        let mut to = 0;
        for &s in samples {
            let Range { start, end } = self.stretch[s];
            let height = end - start;
            rows.columns_mut(to, height).copy_from(&self.rows.columns(start, height));
            to += height;
        }
        let mut products = DMatrix::zeros(width, width);
        linalg::normal_matrix(&rows, &mut products);
        products
    }

    /// Inner products of the rows that belong to no sample: known distances between balls.
    pub fn always(&self) -> DMatrix<f64> {
        let from = self.stretch.iter().map(|rows| rows.end).max().unwrap_or(0);
        let mut products = DMatrix::zeros(self.rows.nrows(), self.rows.nrows());
        linalg::normal_matrix(&self.rows.columns(from, self.rows.ncols() - from).into_owned(), &mut products);
        products
    }

    /// Inner products of all rows not excluded.
    pub fn all_products(&self) -> DMatrix<f64> {
        self.products(&self.taken().collect::<Vec<_>>()) + self.always()
    }

    /// Inner products for the folds of a division.
    pub fn fold_products(&self, folds: Folds) -> FoldProducts {
        let of_fold: Vec<DMatrix<f64>> = (0..folds.count)
            .into_par_iter()
            .map(|f| self.products(&self.taken().filter(|&s| folds.of[self.posture[s]] == f).collect::<Vec<_>>()))
            .collect();
        let all = of_fold.iter().fold(self.always(), |sum, own| sum + own);
        FoldProducts { folds, of_fold, all }
    }

    /// Solves for the coefficients of a choice from inner products of rows; returned for all columns, zero for those
    /// not chosen.
    pub fn solve(&self, products: &DMatrix<f64>, choice: &Choice) -> Result<DVector<f64>, FitError> {
        let (m, last) = (choice.columns.len(), products.nrows() - 1);
        let mut factor = self.factored(products, choice)?;
        let mut step = DVector::from_fn(m, |k, _| products[(choice.columns[k], last)] + choice.pull[k]);
        factor.solve_in_place(&mut step);
        let mut all = DVector::zeros(last);
        (0..m).for_each(|k| all[choice.columns[k]] = step[k]);
        Ok(all)
    }

    /// Mean square error of a choice at the held-out samples of each posture, m²; `None` if no sample of the posture
    /// lies inside the joint ranges of the training rows.
    pub fn held_out(&self, products: &FoldProducts, choice: &Choice) -> Result<Vec<Option<f64>>, FitError> {
        let of_fold = |f: usize| -> Result<Vec<(usize, f64)>, FitError> {
            let held: Vec<usize> = self.taken().filter(|&s| products.folds.of[self.posture[s]] == f).collect();
            let train = &products.all - &products.of_fold[f];
            let step = self.solve(&train, choice)?;
            let mut residual: Vec<f64> = Vec::new();
            for &s in &held {
                for k in self.stretch[s].clone() {
                    let column = self.rows.column(k);
                    residual.push(column[step.len()] - column.rows(0, step.len()).dot(&step));
                }
            }
            let widen = self.give_back(products, f, &held, &mut residual);
            let inside = self.inside(products, f);
            let mut at = 0;
            let mut squares = Vec::with_capacity(held.len());
            for (&s, widen) in held.iter().zip(&widen) {
                let height = self.stretch[s].len();
                let sum: f64 = residual[at..at + height].iter().map(|r| r * r).sum();
                at += height;
                if inside(&self.q[s]) {
                    squares.push((s, sum * self.unit[s] * widen));
                }
            }
            Ok(squares)
        };
        let all: Vec<Vec<(usize, f64)>> = (0..products.folds.count).into_par_iter().map(of_fold).collect::<Result<_, _>>()?;
        let mut sums = vec![(0.0, 0.0); self.members.len()];
        for (s, square) in all.into_iter().flatten() {
            let sum = &mut sums[self.posture[s]];
            *sum = (sum.0 + square, sum.1 + 1.0);
        }
        Ok(sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect())
    }

    /// Returns a test whether joint angles lie inside the ranges of the training rows of a fold.
    fn inside(&self, products: &FoldProducts, f: usize) -> impl Fn(&[f64]) -> bool {
        let joints = self.q.first().map_or(0, Vec::len);
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; joints];
        for s in self.taken().filter(|&s| products.folds.of[self.posture[s]] != f) {
            ranges.iter_mut().zip(&self.q[s]).for_each(|(r, &q)| *r = [r[0].min(q), r[1].max(q)]);
        }
        move |q: &[f64]| {
            q.iter().zip(&ranges).all(|(q, r)| {
                let margin = (MARGIN * (r[1] - r[0])).max(LEAST_MARGIN);
                *q >= r[0] - margin && *q <= r[1] + margin
            })
        }
    }

    /// Fits the set-ups and balls that the training rows of a fold do not determine to its held-out rows. Returns a
    /// factor for the squares of each held-out sample that compensates for this fit; zero if it leaves no degrees of
    /// freedom.
    fn give_back(&self, products: &FoldProducts, f: usize, held: &[usize], residual: &mut [f64]) -> Vec<f64> {
        let mut widen = vec![1.0; held.len()];
        let groups = self.local.iter().flatten().copied().max().map_or(0, |g| g + 1);
        for group in 0..groups {
            let columns: Vec<usize> = (0..self.fitted).filter(|&k| self.local[k] == Some(group)).collect();
            let touches = |s: usize| self.stretch[s].clone().any(|k| columns.iter().any(|&c| self.rows[(c, k)] != 0.0));
            let own: Vec<usize> = (0..held.len()).filter(|&i| touches(held[i])).collect();
            if own.is_empty() {
                continue;
            }
            let training = self.taken().filter(|&s| products.folds.of[self.posture[s]] != f && touches(s));
            let rows: usize = training.map(|s| self.stretch[s].len()).sum();
            if rows as f64 >= ROWS_A_NUMBER * columns.len() as f64 {
                continue;
            }
            let starts: Vec<usize> = held
                .iter()
                .scan(0, |at, &s| {
                    let start = *at;
                    *at += self.stretch[s].len();
                    Some(start)
                })
                .collect();
            let places: Vec<(usize, usize)> = own
                .iter()
                .flat_map(|&i| (0..self.stretch[held[i]].len()).map(move |k| (i, k)))
                .map(|(i, k)| (starts[i] + k, self.stretch[held[i]].start + k))
                .collect();
            let x = DMatrix::from_fn(places.len(), columns.len(), |r, c| self.rows[(columns[c], places[r].1)]);
            let y = DVector::from_fn(places.len(), |r, _| residual[places[r].0]);
            let Ok(b) = x.clone().svd(true, true).solve(&y, 1e-9) else { continue };
            let left = y - x * b;
            places.iter().zip(left.iter()).for_each(|((to, _), r)| residual[*to] = *r);
            let (n, p) = (places.len() as f64, columns.len() as f64);
            own.iter().for_each(|&i| widen[i] *= if n > p { n / (n - p) } else { f64::INFINITY });
        }
        widen.iter_mut().filter(|w| !w.is_finite()).for_each(|w| *w = 0.0);
        widen
    }
}

/// Numbers the owners of parameters that do not belong to the arm: set-ups (base and tool), balls, artifacts.
fn locals<'p>(parameters: impl Iterator<Item = &'p Parameter>) -> Vec<Option<usize>> {
    use crate::effects::Owner;
    let mut known: Vec<(Option<usize>, String)> = Vec::new();
    let mut number = |key: (Option<usize>, String)| {
        known.iter().position(|k| *k == key).unwrap_or_else(|| {
            known.push(key);
            known.len() - 1
        })
    };
    let of = |p: &Parameter| match p.owner {
        Owner::Robot => None,
        Owner::Session => Some(number((p.setup, String::new()))),
        Owner::Artifact => Some(number((p.setup, p.effect.to_string()))),
    };
    parameters.map(of).collect()
}
