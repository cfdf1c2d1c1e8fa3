//! The search at one place: every law's columns and their products with each other and with every series, many at once.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use crate::factors::Factors;
use crate::field::{Field, Found, Searched, Shape, WIDEST};
use crate::metric::{Metric, Metrics, SIZES};
use crate::score::{Products, share_for};

/// Columns that are multiplied at once: what fits into the second cache.
const AT_ONCE: usize = 192;

/// Number of the best laws of a place that are kept.
const KEPT: usize = 40;

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
pub(crate) struct Scan<'a> {
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
    /// The search at the place of this index, of laws with these log priors by their number of factors.
    pub fn new(field: &'a Field<'a>, metrics: &'a Metrics, place: usize, ln_priors: [f64; 3]) -> Self {
        let n = field.spans.len();
        let column = field.columns.row(place);
        let squares = DVector::from_fn(n, |i, _| field.spans[i].clone().map(|r| column[r] * column[r]).sum());
        let of = metrics.of_size.iter().map(|metric| of_metric(field, metric, place, &squares)).collect();
        let series = metrics.ln_whole.len();
        let found = Searched { best: Vec::new(), of_series: vec![f64::NEG_INFINITY; series], tried: 0 };
        let limits = vec![DMatrix::zeros(metrics.of_size.len(), WIDEST); series];
        Scan { field, metrics, place, ln_priors, squares, of, found, limits, worst_kept: f64::NEG_INFINITY }
    }

    /// Searches among these laws.
    pub fn over(mut self, shapes: &[Vec<usize>]) -> Searched {
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
            let mut explained = [0.0; SIZES.len()];
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
        let Metrics { of_size, ln_whole, dof, .. } = self.metrics;
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
