//! A known distance between balls, as a row of the least-squares problem.

use nalgebra::Vector3;

/// A known distance between two balls: `d - |b1 - b2|`.
#[derive(Debug, Clone)]
pub(super) struct DistanceRow {
    pub balls: [Vector3<f64>; 2],
    /// First of three parameters of each ball, if it has any.
    pub parameters: [Option<usize>; 2],
    pub distance: f64,
    pub weight: f64,
}

impl DistanceRow {
    /// Vector from the second ball to the first, m.
    pub fn between(&self, values: &[f64]) -> Vector3<f64> {
        let position = |b: usize| match self.parameters[b] {
            Some(p) => self.balls[b] + Vector3::new(values[p], values[p + 1], values[p + 2]),
            None => self.balls[b],
        };
        position(0) - position(1)
    }

    /// Calls `emit(parameter, d(distance)/d(parameter))` for the coordinates on which it depends.
    pub fn columns(&self, values: &[f64], emit: &mut dyn FnMut(usize, f64)) {
        let between = self.between(values);
        let direction = between / between.norm().max(f64::MIN_POSITIVE);
        for (first, sign) in self.parameters.iter().zip([1.0, -1.0]) {
            if let Some(p) = first {
                (0..3).for_each(|axis| emit(p + axis, sign * direction[axis]));
            }
        }
    }
}
