//! The linear model of the sampler, and the state of a chain.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// Kinds of groups, each with a common size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Kind {
    /// Effects of the catalogue.
    Catalogue,
    /// Curves of a joint's own angle.
    Curves,
    /// Functions of two variables.
    Pairs,
}

/// All kinds.
pub const KINDS: [Kind; 3] = [Kind::Catalogue, Kind::Curves, Kind::Pairs];

/// Prior knowledge of the size of a group.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Size {
    /// Known variance.
    Known(f64),
    /// Drawn with the others of its kind, which scatter about a common size.
    Drawn(Kind),
}

/// Columns that share one size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Group {
    /// Indices of the columns.
    pub columns: Range<usize>,
    /// Prior knowledge of the size.
    pub size: Size,
}

/// Columns that are one vector at every sample, each times a number of its own: errors of one joint, whose axis moves the
/// measured point always in the same way. Products of such rows are products of these numbers, of which there are fewer.
#[derive(Serialize, Deserialize)]
pub struct Outer {
    /// The vector of each row.
    pub lever: DVector<f64>,
    /// The numbers: one row per sample, for the first samples; one column per coefficient.
    pub shapes: DMatrix<f64>,
    /// Indices of the columns.
    pub columns: Vec<usize>,
}

impl Outer {
    /// Writes the columns into `x`, whose rows belong to these samples.
    pub fn write(&self, samples: &[Range<usize>], x: &mut DMatrix<f64>) {
        for (&k, shape) in self.columns.iter().zip(self.shapes.column_iter()) {
            for (own, size) in samples.iter().zip(&shape) {
                own.clone().for_each(|r| x[(r, k)] = self.lever[r] * size);
            }
        }
    }
}

/// The linear model.
#[derive(Serialize, Deserialize)]
pub struct LinearModel {
    /// One row per residual, in units of the noise; one column per coefficient.
    pub x: DMatrix<f64>,
    /// The residuals.
    pub y: DVector<f64>,
    /// Rows of each sample, which share a weight.
    pub samples: Vec<Range<usize>>,
    /// Columns that can be multiplied at less cost; they are among those of `x`, and of groups whose size is sampled.
    pub outers: Vec<Outer>,
    /// Groups in the order of the columns, without gaps.
    pub groups: Vec<Group>,
    /// Prior of the noise; `None` if unknown.
    pub noise: Option<NoisePrior>,
}

/// Prior of the noise of a row.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct NoisePrior {
    /// Variance, in units of the noise squared.
    pub variance: f64,
    /// Degrees of freedom that it is worth.
    pub freedom: f64,
}

/// State of a chain.
pub struct State {
    pub common: [f64; KINDS.len()],
    pub variance: Vec<f64>,
    pub weight: Vec<f64>,
    pub noise: f64,
    pub tail: f64,
}
