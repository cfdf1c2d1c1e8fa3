//! The direction of the last motion: joints and plungers rest differently after moving up than after moving down.

/// Signs of the last motions of several coordinates, tracked from one rest to the next.
///
/// A coordinate keeps its sign until it has moved by the threshold from its last such position; so a slow drift in one
/// direction accumulates, and a step too small to take up the lost motion changes nothing.
///
/// ```
/// use calibench::measure::campaign::LastMotion;
///
/// let mut motion = LastMotion::new(1.0);
/// motion.rest_at(&[0.0, 0.0]);
/// motion.rest_at(&[5.0, 0.6]);
/// motion.rest_at(&[4.5, 1.2]);
/// // The first came back by too little; the second has crept by enough.
/// assert_eq!(motion.signs(), [1, 1]);
/// ```
#[derive(Debug, Clone)]
pub struct LastMotion {
    threshold: f64,
    reference: Vec<f64>,
    signs: Vec<i8>,
}

impl LastMotion {
    /// Creates a tracker without any motion; `threshold` in the unit of the coordinates.
    pub fn new(threshold: f64) -> Self {
        LastMotion { threshold, reference: Vec::new(), signs: Vec::new() }
    }

    /// Updates the signs with the coordinates now at rest.
    pub fn rest_at(&mut self, values: &[f64]) {
        if self.reference.len() != values.len() {
            self.reference = values.to_vec();
            self.signs = vec![0; values.len()];
        }
        for ((reference, sign), &value) in self.reference.iter_mut().zip(&mut self.signs).zip(values) {
            let moved = value - *reference;
            if moved.abs() >= self.threshold {
                *sign = if moved > 0.0 { 1 } else { -1 };
                *reference = value;
            }
        }
    }

    /// -1, 0 (has not moved by the threshold yet) or +1 for each coordinate.
    pub fn signs(&self) -> &[i8] {
        &self.signs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_reversals_do_not_count_and_a_creep_adds_up() {
        let mut motion = LastMotion::new(1.0);
        motion.rest_at(&[0.0, 0.0, 0.0]);
        motion.rest_at(&[5.0, 0.6, 0.3]);
        motion.rest_at(&[4.5, 1.2, 0.3]);
        assert_eq!(motion.signs(), [1, 1, 0]);
        motion.rest_at(&[3.9, 1.2, -0.8]);
        assert_eq!(motion.signs(), [-1, 1, 0]);
    }
}
