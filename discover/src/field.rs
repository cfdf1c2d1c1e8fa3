//! What a search is made in, and what it finds.

use std::ops::Range;

use nalgebra::DMatrix;

use crate::factors::Factors;
use crate::samples::Place;

/// Largest number of columns of one law.
pub(crate) const WIDEST: usize = 8;

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
