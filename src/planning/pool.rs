//! Candidate measurements, and the derivatives of their residuals.

pub use super::layout::CellLayout;

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::diagnosis::Examination;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::{Dataset, Measured};
use crate::prediction::at_new_poses::AtNewPoses;
use crate::units::MM;

/// One-sigma of the pose of a moved artifact, m and rad: any place where the arm can still find the balls, and far
/// larger than the uncertainty after the measurements.
pub(super) const ANYWHERE: [f64; 6] = [5.0 * MM, 5.0 * MM, 5.0 * MM, 0.02, 0.02, 0.02];

/// A set of candidate measurements.
#[derive(Debug, Clone)]
pub struct Pool {
    /// The cell, with the candidates as its samples: balls without readings, points at their nominal positions.
    pub dataset: Dataset,
    /// True if the artifact was moved and its new place is known only roughly: its six pose parameters have to be
    /// determined from the new measurements.
    pub artifact_moved: bool,
}

impl Pool {
    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.dataset.samples.len()
    }

    /// True if there are no candidates.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One-sigma sizes of the additional parameters of the pool, if any.
    pub(super) fn nuisance(&self) -> &'static [f64] {
        if self.artifact_moved { &ANYWHERE } else { &[] }
    }

    /// Whitened and transposed Jacobian, three columns per candidate: the rows of the examination, then the nuisance
    /// parameters. Divided by `sigma`, the one-sigma of the whitened residuals.
    pub(super) fn columns(&self, examination: &Examination, sigma: f64) -> Result<DMatrix<f64>, IdentifyError> {
        let there = AtNewPoses::new(&self.dataset, examination, |_| true)?;
        let mut rows = there.whitened();
        let known = rows.nrows();
        // Between them lies the row of the residuals, zero for measurements not yet made.
        rows = rows.resize_vertically(known + 1 + self.nuisance().len(), 0.0);
        if self.artifact_moved {
            let candidates = self.dataset.samples.iter();
            let ball = |measured: &Measured| match measured {
                Measured::Ball { ball, .. } => self.dataset.balls[*ball].position,
                _ => Vector3::zeros(),
            };
            let centre =
                self.dataset.balls.iter().map(|b| b.position).sum::<Vector3<f64>>() / self.dataset.balls.len().max(1) as f64;
            for ((i, sample), at) in candidates.enumerate().zip(there.contexts()) {
                // The columns of a base translation are the whitener; moving a ball is equivalent to moving the base
                // back.
                let whitener = Matrix3::from_columns(&at.base.map(|column| column.fixed_rows::<3>(0).into_owned()));
                let arm = ball(&sample.measured) - centre;
                for axis in 0..3 {
                    let along = Vector3::ith(axis, 1.0);
                    let (shifted, turned) = (whitener * along, whitener * along.cross(&arm));
                    for k in 0..3 {
                        rows[(known + 1 + axis, 3 * i + k)] = shifted[k];
                        rows[(known + 4 + axis, 3 * i + k)] = turned[k];
                    }
                }
            }
        }
        rows /= sigma;
        Ok(rows)
    }
}
