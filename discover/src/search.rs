//! The search among all laws of one, two and three factors at every place.

use std::collections::HashMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::factors::Factors;
use crate::metric::{Metric, Metrics};
use crate::samples::Place;
use crate::score::{Products, share_for};
use crate::variables::Variable;

/// Shares of the prior among laws of one, two and three factors.
const PRIORS: [f64; 3] = [0.5, 0.35, 0.15];

/// Square of the cosine between the columns of two places from which on they are one.
const SAME: f64 = 0.998;

/// Number of the best laws of a place that are kept.
const KEPT: usize = 40;

/// Number of the best laws of two factors that are extended by a third.
const EXTENDED: usize = 60;

/// Columns that are multiplied at once: what fits into the second cache.
const AT_ONCE: usize = 192;

/// Largest number of columns of one law.
const WIDEST: usize = 8;

/// What a search is made in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Field<'a> {
    /// The places.
    pub places: &'a [Place],
    /// Their whitened columns: places x residuals.
    pub columns: &'a DMatrix<f64>,
    /// The factors.
    pub factors: &'a Factors,
    /// Residuals of each sample.
    pub spans: &'a [Range<usize>],
}

/// A law: a place, and the factors of a product.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shape {
    /// Index of the place.
    pub place: usize,
    /// Indices of the factors.
    pub factors: Vec<usize>,
}

/// A law with its score.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    /// The law.
    pub shape: Shape,
    /// Log odds against no law, the number of laws tried included.
    pub ln_odds: f64,
}

/// Result of a search.
#[derive(Debug, Clone, Default)]
pub(crate) struct Searched {
    /// The best laws, best first.
    pub best: Vec<Found>,
    /// The largest log odds in every series.
    pub of_series: Vec<f64>,
    /// Number of laws tried.
    pub tried: usize,
}

impl Field<'_> {
    /// Columns of a law in the residuals (residuals x columns).
    pub fn columns_of(&self, shape: &Shape) -> DMatrix<f64> {
        let values = self.factors.product(&shape.factors);
        let place = self.columns.row(shape.place);
        let mut columns = DMatrix::zeros(self.columns.ncols(), values.ncols());
        for (sample, rows) in self.spans.iter().enumerate() {
            for row in rows.clone() {
                columns.row_mut(row).copy_from(&(values.row(sample) * place[row]));
            }
        }
        columns
    }

    /// Laws of one and two factors at a place.
    fn shapes(&self, place: usize) -> Vec<Vec<usize>> {
        let joint = self.places[place].joint;
        let all = &self.factors.all;
        let here = |k: &usize| all[*k].only_of.is_none_or(|j| Some(j) == joint);
        if self.is_another(place) {
            return Vec::new();
        }
        let single: Vec<usize> = (0..all.len()).filter(here).collect();
        // Of a joint's own angle any curve is an effect of the catalogue: its waves stand for it.
        let is_law = |k: &&usize| all[**k].is_wave() || joint.is_none_or(|j| all[**k].variable != Variable::Joint(j));
        let mut shapes: Vec<Vec<usize>> = single.iter().filter(is_law).map(|&k| vec![k]).collect();
        // Variable by variable: products of the same two have columns in common.
        let of_variables: Vec<&[usize]> = single.chunk_by(|&a, &b| all[a].variable == all[b].variable).collect();
        for (n, first) in of_variables.iter().enumerate() {
            for second in &of_variables[n + 1..] {
                let pairs = first.iter().flat_map(|&a| second.iter().map(move |&b| [a, b]));
                shapes.extend(pairs.filter(|&[a, b]| self.multiply(a, b)).map(|pair| pair.to_vec()));
            }
        }
        shapes
    }

    /// True if a place moves what is measured as one before it does, so that no data tell the two from each other.
    fn is_another(&self, place: usize) -> bool {
        let own = self.columns.row(place);
        (0..place).any(|k| {
            let other = self.columns.row(k);
            own.dot(&other).powi(2) > SAME * own.norm_squared() * other.norm_squared()
        })
    }

    fn multiply(&self, a: usize, b: usize) -> bool {
        let (a, b) = (&self.factors.all[a], &self.factors.all[b]);
        a.multiplies && b.multiplies && !a.variable.overlaps(b.variable)
    }

    /// Searches among all laws of one and two factors, and extends the best by a third if `thrice`.
    pub fn search(&self, metrics: &Metrics, thrice: bool) -> Searched {
        let shapes: Vec<Vec<Vec<usize>>> = (0..self.places.len()).map(|p| self.shapes(p)).collect();
        let count = |factors: usize| shapes.iter().flatten().filter(|s| s.len() == factors).count() as f64;
        let third = self.factors.all.iter().filter(|f| f.multiplies && f.only_of.is_none()).count().max(1) as f64;
        let counts = [count(1), count(2), count(2) * third / 3.0];
        let ln_priors = [0, 1, 2].map(|k| (PRIORS[k] / counts[k].max(1.0)).ln());
        let all = (0..self.places.len()).into_par_iter();
        let found = all.map(|p| Scan::new(self, metrics, p, ln_priors).over(&shapes[p])).collect::<Vec<_>>();
        let mut searched = merged(found);
        if thrice {
            let longer: Vec<Vec<Vec<usize>>> = (0..self.places.len()).map(|p| self.extended(&searched.best, p)).collect();
            let all = (0..self.places.len()).into_par_iter().filter(|&p| !longer[p].is_empty());
            let found = all.map(|p| Scan::new(self, metrics, p, ln_priors).over(&longer[p])).collect::<Vec<_>>();
            searched = merged(std::iter::once(searched).chain(found).collect());
        }
        searched
    }

    /// The best wave of a joint over its own angle, with its log odds among all such.
    pub fn best_wave(&self, metrics: &Metrics) -> Option<Found> {
        let of_joint = |p: usize| {
            let own = |k: &usize| {
                let factor = &self.factors.all[*k];
                factor.is_wave() && self.places[p].joint.is_some_and(|j| factor.variable == Variable::Joint(j))
            };
            (0..self.factors.all.len()).filter(own).map(|k| vec![k]).collect::<Vec<_>>()
        };
        let shapes: Vec<Vec<Vec<usize>>> = (0..self.places.len()).map(of_joint).collect();
        let ln_prior = -(shapes.iter().map(Vec::len).sum::<usize>().max(1) as f64).ln();
        let all = (0..self.places.len()).into_par_iter().filter(|&p| !shapes[p].is_empty());
        merged(all.map(|p| Scan::new(self, metrics, p, [ln_prior; 3]).over(&shapes[p])).collect()).best.into_iter().next()
    }

    /// The best laws of two factors at a place, each with every third.
    fn extended(&self, best: &[Found], place: usize) -> Vec<Vec<usize>> {
        let pairs = best.iter().take(EXTENDED).filter(|f| f.shape.place == place && f.shape.factors.len() == 2);
        let mut longer: Vec<Vec<usize>> = Vec::new();
        for pair in pairs.map(|f| &f.shape.factors) {
            for (c, factor) in self.factors.all.iter().enumerate() {
                let width: usize = pair.iter().map(|&k| self.factors.all[k].width()).product::<usize>() * factor.width();
                if factor.only_of.is_none() && width <= WIDEST && pair.iter().all(|&k| self.multiply(k, c)) {
                    let mut shape = [pair.as_slice(), &[c]].concat();
                    shape.sort_unstable();
                    if !longer.contains(&shape) {
                        longer.push(shape);
                    }
                }
            }
        }
        longer
    }
}

impl Factors {
    /// The columns of a product of factors (samples x columns).
    pub fn product(&self, factors: &[usize]) -> DMatrix<f64> {
        let mut columns = DMatrix::from_element(self.values.nrows(), 1, 1.0);
        for &k in factors {
            let factor = &self.all[k];
            let mut next = DMatrix::zeros(columns.nrows(), columns.ncols() * factor.width());
            for a in 0..columns.ncols() {
                for b in 0..factor.width() {
                    let product = columns.column(a).component_mul(&self.values.column(factor.values_of(b)));
                    next.column_mut(a * factor.width() + b).copy_from(&product);
                }
            }
            columns = next;
        }
        columns
    }
}

/// The best of several searches.
fn merged(found: Vec<Searched>) -> Searched {
    let mut all = Searched::default();
    for one in found {
        all.best.extend(one.best);
        all.tried += one.tried;
        if all.of_series.is_empty() {
            all.of_series = one.of_series;
        } else {
            all.of_series.iter_mut().zip(one.of_series).for_each(|(a, b)| *a = a.max(b));
        }
    }
    // A stable sort: of equal laws the one at the first place stays first.
    all.best.sort_by(|a, b| b.ln_odds.total_cmp(&a.ln_odds));
    all
}

/// Products of one place with the metrics.
struct OfMetric {
    /// Either inner products of every pair of samples, or of every sample with what is absorbed.
    samples: Option<DMatrix<f64>>,
    absorbed: DMatrix<f64>,
    /// Inner products of every series with the place at every sample (series x samples).
    with: DMatrix<f64>,
}

/// The columns of several laws, each once.
#[derive(Default)]
struct Distinct {
    /// The factors' columns that make each.
    keys: Vec<Vec<usize>>,
    places: HashMap<Vec<usize>, usize>,
    /// Columns of each law.
    of_shapes: Vec<Vec<usize>>,
}

impl Distinct {
    fn add(&mut self, factors: &Factors, shape: &[usize]) {
        let mut keys = vec![Vec::new()];
        for &k in shape {
            let factor = &factors.all[k];
            let each = |key: &Vec<usize>| {
                (0..factor.width()).map(|b| [key.as_slice(), &[factor.values_of(b)]].concat()).collect::<Vec<_>>()
            };
            keys = keys.iter().flat_map(each).collect();
        }
        let place = |key: Vec<usize>| {
            *self.places.entry(key).or_insert_with_key(|key| {
                self.keys.push(key.clone());
                self.keys.len() - 1
            })
        };
        self.of_shapes.push(keys.into_iter().map(place).collect());
    }
}

/// Inner products of columns with the samples or what is absorbed, and with every series.
struct SeenColumns {
    with_samples: DMatrix<f64>,
    with_series: DMatrix<f64>,
}

/// Columns of several laws: their values, those weighted by the place, and their products in every metric.
struct Chunk {
    values: DMatrix<f64>,
    weighted: DMatrix<f64>,
    products: Vec<SeenColumns>,
}

/// The search at one place.
struct Scan<'a> {
    field: &'a Field<'a>,
    metrics: &'a Metrics,
    place: usize,
    ln_priors: [f64; 3],
    squares: DVector<f64>,
    of: Vec<OfMetric>,
    found: Searched,
    /// Share of each simulated series that would be better than the best so far: (metric x widths) for each.
    limits: Vec<DMatrix<f64>>,
    /// Log odds below which no law is kept any more.
    worst_kept: f64,
}

impl<'a> Scan<'a> {
    fn new(field: &'a Field<'a>, metrics: &'a Metrics, place: usize, ln_priors: [f64; 3]) -> Self {
        let n = field.spans.len();
        let column = field.columns.row(place);
        let squares = DVector::from_fn(n, |i, _| field.spans[i].clone().map(|r| column[r] * column[r]).sum());
        let of = metrics.of_size.iter().map(|metric| of_metric(field, metric, place, &squares)).collect();
        let series = metrics.ln_whole.len();
        let found = Searched { best: Vec::new(), of_series: vec![f64::NEG_INFINITY; series], tried: 0 };
        let limits = vec![DMatrix::zeros(metrics.of_size.len(), WIDEST); series];
        Scan { field, metrics, place, ln_priors, squares, of, found, limits, worst_kept: f64::NEG_INFINITY }
    }

    fn over(mut self, shapes: &[Vec<usize>]) -> Searched {
        let mut rest = shapes;
        while !rest.is_empty() {
            let mut columns = Distinct::default();
            let mut count = 0;
            while count < rest.len() && (count == 0 || columns.keys.len() + WIDEST <= AT_ONCE) {
                columns.add(self.field.factors, &rest[count]);
                count += 1;
            }
            self.some(&rest[..count], &columns);
            rest = &rest[count..];
        }
        self.found.best.sort_by(|a, b| b.ln_odds.total_cmp(&a.ln_odds));
        self.found.best.truncate(KEPT);
        self.found
    }

    fn some(&mut self, shapes: &[Vec<usize>], columns: &Distinct) {
        let of_factors = &self.field.factors.values;
        let mut values = DMatrix::from_element(self.squares.len(), columns.keys.len(), 1.0);
        for (mut column, key) in values.column_iter_mut().zip(&columns.keys) {
            key.iter().for_each(|&factor| column.component_mul_assign(&of_factors.column(factor)));
        }
        let mut weighted = values.clone();
        weighted.column_iter_mut().for_each(|mut c| c.component_mul_assign(&self.squares));
        let products: Vec<SeenColumns> = self
            .of
            .iter()
            .map(|of| SeenColumns {
                with_samples: of.samples.as_ref().unwrap_or(&of.absorbed) * &values,
                with_series: &of.with * &values,
            })
            .collect();
        let chunk = Chunk { values, weighted, products };
        shapes.iter().zip(&columns.of_shapes).for_each(|(shape, of)| self.one(shape, of, &chunk));
    }

    fn one(&mut self, shape: &[usize], columns: &[usize], chunk: &Chunk) {
        let Chunk { values, weighted, products } = chunk;
        let k = columns.len();
        self.found.tried += 1;
        let whole: Vec<f64> = columns.iter().map(|&a| values.column(a).dot(&weighted.column(a))).collect();
        let mut factors = Vec::with_capacity(products.len());
        for (of, seen) in self.of.iter().zip(products) {
            let seen = &seen.with_samples;
            let gram = DMatrix::from_fn(k, k, |a, b| {
                let (a, b) = (columns[a], columns[b]);
                match of.samples {
                    Some(_) => values.column(a).dot(&seen.column(b)),
                    None => values.column(a).dot(&weighted.column(b)) - seen.column(a).dot(&seen.column(b)),
                }
            });
            match Products::of(&gram, &whole) {
                Some(factor) => factors.push(factor),
                None => return,
            }
        }
        let ln_prior = self.ln_priors[shape.len() - 1] + self.field.places[self.place].ln_prior;
        let mut with = [0.0; WIDEST];
        for series in 0..self.found.of_series.len() {
            let mut explained = [0.0; crate::metric::SIZES.len()];
            let mut better = series == 0;
            for (t, (factor, seen)) in factors.iter().zip(products).enumerate() {
                with.iter_mut().zip(columns).for_each(|(with, &column)| *with = seen.with_series[(series, column)]);
                explained[t] = factor.explained(&with[..k]);
                better |= explained[t] > self.limits[series][(t, k - 1)] * self.metrics.of_size[t].energies[series];
            }
            if !better {
                continue;
            }
            let ln_odds = ln_prior + self.metrics.ln_evidence(series, k, |t| explained[t]);
            if ln_odds > self.found.of_series[series] {
                self.found.of_series[series] = ln_odds;
                self.limit(series, ln_odds);
            }
            if series == 0 {
                self.keep(shape, ln_odds);
            }
        }
    }

    fn keep(&mut self, shape: &[usize], ln_odds: f64) {
        if ln_odds <= self.worst_kept {
            return;
        }
        let best = &mut self.found.best;
        best.push(Found { shape: Shape { place: self.place, factors: shape.to_vec() }, ln_odds });
        if best.len() > 4 * KEPT {
            best.sort_by(|a, b| b.ln_odds.total_cmp(&a.ln_odds));
            best.truncate(KEPT);
            self.worst_kept = best[KEPT - 1].ln_odds;
        }
    }

    /// Takes the shares that any better law has to explain of a series.
    fn limit(&mut self, series: usize, best: f64) {
        let Metrics { of_size, ln_whole, dof } = self.metrics;
        let most = self.ln_priors.iter().copied().fold(f64::NEG_INFINITY, f64::max) + self.field.places[self.place].ln_prior;
        let sizes = (of_size.len() as f64).ln();
        for (t, metric) in of_size.iter().enumerate() {
            let wanted = best - most + ln_whole[series] - metric.ln_evidence[series] - sizes;
            for k in 1..=WIDEST {
                self.limits[series][(t, k - 1)] = share_for(wanted, k, *dof);
            }
        }
    }
}

fn of_metric(field: &Field<'_>, metric: &Metric, place: usize, squares: &DVector<f64>) -> OfMetric {
    let n = field.spans.len();
    let column = field.columns.row(place);
    let gathered = |of: &DMatrix<f64>| {
        let mut sums = DMatrix::zeros(of.ncols(), n);
        for (i, rows) in field.spans.iter().enumerate() {
            for row in rows.clone() {
                sums.column_mut(i).axpy(column[row], &of.row(row).transpose(), 1.0);
            }
        }
        sums
    };
    let absorbed = gathered(&metric.u);
    let with = gathered(&metric.seen);
    let samples = (n <= absorbed.nrows()).then(|| DMatrix::from_diagonal(squares) - absorbed.tr_mul(&absorbed));
    OfMetric { samples, absorbed, with }
}
