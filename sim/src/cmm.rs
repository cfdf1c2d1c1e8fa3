//! The simulated coordinate measuring machine that certifies the artifact's balls and the TCP of the TriCal.

use calibench::units::UM;
use nalgebra::Vector3;
use rand::Rng;

use crate::random::noisy_point;

/// Accuracy of a coordinate measuring machine in finding the centre of a ball.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedCmm {
    /// One-sigma of a ball's centre, per axis, m.
    pub centre: f64,
}

impl Default for SimulatedCmm {
    /// The paper's machine has "an uncertainty of 1.9 um" (section 4), without stating the quantity or the coverage. It is
    /// taken as one-sigma per axis of a ball's centre, the most pessimistic reading; as an expanded uncertainty (k = 2) it
    /// would be 0.95 um.
    fn default() -> Self {
        SimulatedCmm { centre: 1.9 * UM }
    }
}

impl SimulatedCmm {
    /// Returns the measured centre of a ball whose true centre is `centre` (m).
    ///
    /// The error is symmetric, so this also draws a true centre for a ball certified at `centre`.
    pub fn measure_ball(&self, centre: &Vector3<f64>, rng: &mut impl Rng) -> Vector3<f64> {
        noisy_point(centre, self.centre, rng)
    }
}
