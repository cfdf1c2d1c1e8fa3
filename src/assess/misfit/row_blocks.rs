//! One row of a fit of frames: its residual, and how it changes with the few unknowns that it depends on.

use nalgebra::{Matrix3, Vector3};

/// d(row)/d(unknowns): blocks of three columns with the first column's place, and the row's residual.
pub(super) struct RowBlocks {
    pub blocks: [(usize, Matrix3<f64>); 4],
    pub used: usize,
    pub residual: Vector3<f64>,
}

impl RowBlocks {
    /// Without any columns yet.
    pub fn new(residual: Vector3<f64>) -> Self {
        RowBlocks { blocks: [(0, Matrix3::zeros()); 4], used: 0, residual }
    }

    /// The columns from `place` on.
    pub fn add(&mut self, place: usize, block: Matrix3<f64>) {
        self.blocks[self.used] = (place, block);
        self.used += 1;
    }

    /// Keeps only what lies along a unit vector, as the first row; the residual is then this one number.
    pub fn along(&mut self, sight: &Vector3<f64>, residual: f64) {
        for (_, block) in &mut self.blocks[..self.used] {
            let row = sight.transpose() * *block;
            *block = Matrix3::zeros();
            block.set_row(0, &row);
        }
        self.residual = Vector3::new(residual, 0.0, 0.0);
    }
}
