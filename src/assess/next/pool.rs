//! Measurements that could be made, as the residuals would see them.

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::assess::at_new_poses::AtNewPoses;
use crate::assess::examination::Examination;
use crate::identify::IdentifyError;
use crate::measure::{Dataset, Measured};
use crate::units::MM;

/// One-sigma of where a moved artifact stands, m and rad: anywhere that the arm finds it, and far beyond what the data leave open.
pub(super) const ANYWHERE: [f64; 6] = [5.0 * MM, 5.0 * MM, 5.0 * MM, 0.02, 0.02, 0.02];

/// Measurements that could be made.
#[derive(Debug, Clone)]
pub struct Pool {
    /// The cell, and the candidates as its samples: no readings, and points where the drawing has them.
    pub dataset: Dataset,
    /// The artifact stands at a new place, known by hand only: six numbers more have to come out of the new measurements themselves.
    pub artifact_moved: bool,
}

impl Pool {
    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.dataset.samples.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sizes of the numbers that come with the pool.
    pub(super) fn nuisance(&self) -> &'static [f64] {
        if self.artifact_moved { &ANYWHERE } else { &[] }
    }

    /// Whitened columns of an examination's rows, then of the nuisance, transposed: three columns a candidate. Divided by `sigma`,
    /// that of the whitened residuals.
    pub(super) fn columns(&self, examination: &Examination, sigma: f64) -> Result<DMatrix<f64>, IdentifyError> {
        let there = AtNewPoses::new(&self.dataset, examination, |_| true)?;
        let mut rows = there.whitened();
        let known = rows.nrows();
        // The residuals' own row, which what was not measured has not, stands between.
        rows = rows.resize_vertically(known + 1 + self.nuisance().len(), 0.0);
        if self.artifact_moved {
            let candidates = self.dataset.samples.iter();
            let ball = |measured: &Measured| match measured {
                Measured::Ball { ball, .. } => self.dataset.balls[*ball].position,
                _ => Vector3::zeros(),
            };
            let centre =
                self.dataset.balls.iter().map(|b| b.position).sum::<Vector3<f64>>() / self.dataset.balls.len().max(1) as f64;
            for ((i, sample), at) in candidates.enumerate().zip(there.circumstances()) {
                // The base's columns are the whitener's, and a ball moved is a base moved back.
                let whitener = Matrix3::from_columns(&at.base);
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
