//! The linear model that is drawn from, and where a chain of draws stands.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

/// Kinds of groups, each with a common size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Effects of the catalogue.
    Catalogue,
    /// Curves of a joint's own angle.
    Curves,
    /// Functions of two variables.
    Pairs,
}

/// All of them.
pub const KINDS: [Kind; 3] = [Kind::Catalogue, Kind::Curves, Kind::Pairs];

/// What is known of some columns before the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// Their variance.
    Known(f64),
    /// It is one of many of its kind that scatter about a common size.
    Drawn(Kind),
}

/// Columns that have one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Their places.
    pub columns: Range<usize>,
    /// What is known of it.
    pub size: Size,
}

/// What is drawn from.
pub struct LinearModel {
    /// One row a residual, in units of the noise, one column a coefficient.
    pub x: DMatrix<f64>,
    /// The residuals.
    pub y: DVector<f64>,
    /// Rows of each sample: they share a weight.
    pub samples: Vec<Range<usize>>,
    /// In the order of the columns, without gaps.
    pub groups: Vec<Group>,
    /// Variance of the noise as far as it is known, in units of the noise, and by how many degrees of freedom.
    pub noise: Option<(f64, f64)>,
}

/// Where a chain of draws stands.
pub struct State {
    pub common: [f64; KINDS.len()],
    pub variance: Vec<f64>,
    pub weight: Vec<f64>,
    pub noise: f64,
    pub tail: f64,
}
