//! What a fit and an ordinary robot leave of any column: the inner product in which candidates are compared.
//!
//! Residual = fitted columns · b + candidates of the catalogue · c + noise, c of `size` plausible sizes: every real robot has a
//! little of everything, and a law has to be significant against that, not against noise alone.

use nalgebra::{DMatrix, DVector};

use crate::score::{Products, ln_evidence, ln_sum_exp};

/// Sizes of the background, in plausible sizes of the catalogue.
pub(crate) const SIZES: [f64; 3] = [0.0, 0.2, 0.8];

/// Share of a column's length below which it counts as dependent on those before it.
const DEPENDENT: f64 = 1e-6;

/// The residuals, the columns that are fitted, and those of the catalogue.
#[derive(Debug, Clone)]
pub(crate) struct Ground {
    /// Orthonormal columns that span what is fitted (residuals x parameters).
    pub fitted: DMatrix<f64>,
    /// Columns of the catalogue after projection, in principal directions.
    background: DMatrix<f64>,
    /// Square of the length of each.
    lengths: Vec<f64>,
    /// Residuals, one series a column: the data, then simulated ones.
    pub series: DMatrix<f64>,
    /// Number of samples that count as one: those of one posture have the error of the arm there in common.
    repetition: f64,
}

impl Ground {
    /// The ground of these fitted columns and those of the catalogue (residuals x columns each), of samples of which `repetition` count
    /// as one.
    pub fn new(fitted: &DMatrix<f64>, catalogue: &DMatrix<f64>, series: &DMatrix<f64>, repetition: f64) -> Self {
        let fitted = orthonormal(fitted);
        let seen = catalogue - &fitted * fitted.tr_mul(catalogue);
        let eigen = seen.tr_mul(&seen).symmetric_eigen();
        let kept: Vec<usize> = (0..eigen.eigenvalues.len()).filter(|&k| eigen.eigenvalues[k] > 1e-9).collect();
        let background = &seen * eigen.eigenvectors.select_columns(&kept);
        let lengths = kept.iter().map(|&k| eigen.eigenvalues[k]).collect();
        let series = series - &fitted * fitted.tr_mul(series);
        Ground { fitted, background, lengths, series, repetition }
    }

    /// Degrees of freedom of the residuals, repeats counted once.
    pub fn dof(&self) -> f64 {
        (self.series.nrows() as f64 / self.repetition - self.fitted.ncols() as f64).max(1.0)
    }

    /// Number of residuals less that of fitted parameters.
    pub fn free_residuals(&self) -> f64 {
        (self.series.nrows() - self.fitted.ncols()) as f64
    }

    /// The same ground with other residuals.
    pub fn with(&self, series: &DMatrix<f64>) -> Self {
        Ground { series: series - &self.fitted * self.fitted.tr_mul(series), ..self.clone() }
    }

    /// The metric under a background of `size`.
    pub fn metric(&self, size: f64) -> Metric {
        let strengths: Vec<f64> = self.lengths.iter().map(|l| size * size / (1.0 + size * size * l)).collect();
        let mut absorbed = self.background.clone();
        absorbed.column_iter_mut().zip(&strengths).for_each(|(mut c, s)| c *= s.sqrt());
        let columns = self.fitted.ncols() + if size > 0.0 { absorbed.ncols() } else { 0 };
        let mut u = DMatrix::zeros(self.series.nrows(), columns);
        u.columns_mut(0, self.fitted.ncols()).copy_from(&self.fitted);
        if size > 0.0 {
            u.columns_mut(self.fitted.ncols(), absorbed.ncols()).copy_from(&absorbed);
        }
        let seen = &self.series - &u * u.tr_mul(&self.series);
        let energies = (0..seen.ncols()).map(|s| seen.column(s).dot(&self.series.column(s)).max(f64::MIN_POSITIVE));
        let energies: Vec<f64> = energies.collect();
        let volume: f64 = self.lengths.iter().map(|l| -0.5 * (size * size * l).ln_1p()).sum();
        let whole = (0..seen.ncols()).map(|s| self.series.column(s).norm_squared().max(f64::MIN_POSITIVE));
        let ln_evidence = energies.iter().zip(whole).map(|(e, w)| volume - 0.5 * self.dof() * (e / w).ln()).collect();
        Metric { u, seen, energies, ln_evidence }
    }

    /// What an ordinary robot has: a background of `size` times normal numbers, in whitened residuals.
    pub fn of_background(&self, size: f64, mut normal: impl FnMut() -> f64) -> DVector<f64> {
        &self.background * DVector::from_fn(self.lengths.len(), |_, _| size * normal())
    }

    /// The metrics of every size of the background.
    pub fn metrics(&self) -> Metrics {
        let of_size: Vec<Metric> = SIZES.iter().map(|&size| self.metric(size)).collect();
        let all = |s: usize| of_size.iter().map(|m| m.ln_evidence[s]).collect::<Vec<_>>();
        let ln_whole = (0..self.series.ncols()).map(|s| ln_sum_exp(&all(s))).collect();
        Metrics { of_size, ln_whole, dof: self.dof(), free_residuals: self.free_residuals() }
    }
}

/// The metrics of every size of the background.
#[derive(Debug, Clone)]
pub(crate) struct Metrics {
    /// One for each of [`SIZES`].
    pub of_size: Vec<Metric>,
    /// Log of the sum of the evidences of all sizes, for every series.
    pub ln_whole: Vec<f64>,
    /// Degrees of freedom of the residuals, repeats counted once.
    pub dof: f64,
    /// Number of residuals less that of fitted parameters.
    pub free_residuals: f64,
}

impl Metrics {
    /// Log evidence of `columns` columns over none for a series, given the square that they explain of it in every metric.
    pub fn ln_evidence(&self, series: usize, columns: usize, explained: impl Fn(usize) -> f64) -> f64 {
        let of = |(t, m): (usize, &Metric)| {
            m.ln_evidence[series] + ln_evidence(explained(t) / m.energies[series], columns, self.dof)
        };
        ln_sum_exp(&self.of_size.iter().enumerate().map(of).collect::<Vec<_>>()) - self.ln_whole[series]
    }

    /// The same of columns of the residuals (residuals x columns), for the data; `None` if they are not seen.
    pub fn ln_evidence_of(&self, columns: &DMatrix<f64>) -> Option<f64> {
        let explained: Vec<f64> =
            self.of_size.iter().map(|m| Some(m.seen_columns(columns)?.explained())).collect::<Option<_>>()?;
        Some(self.ln_evidence(0, columns.ncols(), |t| explained[t]))
    }

    /// The size of the background that is most probable with these columns, by index.
    pub fn likely_size(&self, columns: &DMatrix<f64>) -> usize {
        let of = |m: &Metric| {
            let explained = m.seen_columns(columns).map_or(0.0, |seen| seen.explained());
            m.ln_evidence[0] + ln_evidence(explained / m.energies[0], columns.ncols(), self.dof)
        };
        let all: Vec<f64> = self.of_size.iter().map(of).collect();
        (0..all.len()).fold(0, |best, t| if all[t] > all[best] { t } else { best })
    }
}

/// `x' P y` with `P = I - U U'`.
#[derive(Debug, Clone)]
pub(crate) struct Metric {
    /// U (residuals x absorbed directions).
    pub u: DMatrix<f64>,
    /// `P` times every series.
    pub seen: DMatrix<f64>,
    /// Every series' own product.
    pub energies: Vec<f64>,
    /// Log evidence of this size of the background, for every series.
    pub ln_evidence: Vec<f64>,
}

impl Metric {
    /// Columns of the residuals (residuals x columns) as this metric sees them beside the data; `None` if they are not seen.
    pub fn seen_columns(&self, columns: &DMatrix<f64>) -> Option<SeenColumns> {
        let along = self.u.tr_mul(columns);
        let gram = columns.tr_mul(columns) - along.tr_mul(&along);
        let whole: Vec<f64> = columns.column_iter().map(|c| c.norm_squared()).collect();
        let with = columns.tr_mul(&self.seen.column(0)).iter().copied().collect();
        Some(SeenColumns { products: Products::of(&gram, &whole)?, with })
    }
}

/// Columns and their products with the data, in one metric.
pub(crate) struct SeenColumns {
    /// Their products with each other.
    pub products: Products,
    /// Those with the data.
    with: Vec<f64>,
}

impl SeenColumns {
    /// Square of what they explain of the data.
    pub fn explained(&self) -> f64 {
        self.products.explained(&self.with)
    }

    /// Their coefficients.
    pub fn coefficients(&self) -> DVector<f64> {
        self.products.coefficients(&self.with)
    }
}

/// Orthonormal columns that span those of `columns`.
fn orthonormal(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let mut kept: Vec<DVector<f64>> = Vec::new();
    for column in columns.column_iter() {
        let length = column.norm();
        if length == 0.0 {
            continue;
        }
        let mut rest = column / length;
        // Twice is enough.
        for _ in 0..2 {
            for q in &kept {
                let along = q.dot(&rest);
                rest.axpy(-along, q, 1.0);
            }
        }
        let left = rest.norm();
        if left > DEPENDENT {
            kept.push(rest / left);
        }
    }
    if kept.is_empty() { DMatrix::zeros(columns.nrows(), 0) } else { DMatrix::from_columns(&kept) }
}
