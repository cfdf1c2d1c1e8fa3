//! One row of a fit of the frames: its residual, and its derivatives with respect to the few unknowns that affect it.

use nalgebra::{Matrix3, Vector3};

/// Negative derivatives of a row's residual in blocks of three columns, each with the index of its first column, and
/// the residual. The first `used` blocks are valid.
pub(super) struct RowBlocks {
    pub blocks: [(usize, Matrix3<f64>); 4],
    pub used: usize,
    pub residual: Vector3<f64>,
}

impl RowBlocks {
    /// A row without any columns.
    pub fn new(residual: Vector3<f64>) -> Self {
        RowBlocks { blocks: [(0, Matrix3::zeros()); 4], used: 0, residual }
    }

    /// Adds the columns from `place` on.
    pub fn add(&mut self, place: usize, block: Matrix3<f64>) {
        self.blocks[self.used] = (place, block);
        self.used += 1;
    }

    /// Projects the columns onto a unit vector, as the first row; the residual is then this single number.
    pub fn along(&mut self, sight: &Vector3<f64>, residual: f64) {
        for (_, block) in &mut self.blocks[..self.used] {
            let row = sight.transpose() * *block;
            *block = Matrix3::zeros();
            block.set_row(0, &row);
        }
        self.residual = Vector3::new(residual, 0.0, 0.0);
    }
}
