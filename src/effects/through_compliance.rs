//! What a load that is not as entered does to the arm: it changes the joint torques, and so acts through the compliance of the joints,
//! `theta_J += c_J dtau_J`, with the compliance that the model holds at present.

use nalgebra::Vector3;

use super::shape::theta;
use super::{Emit, Needs, Situation};

/// What all of them need.
pub(super) const NEEDS: &[Needs] = &[Needs::Compliance];

/// Emits `theta_J += c_J z_J . moment(o_J)` for the joints below `end` (counted from 0), where `moment` about a point (world, N·m) is
/// what one unit of the parameter adds.
pub(super) fn twist(
    at: &Situation<'_>,
    parameter: usize,
    end: usize,
    moment: impl Fn(usize, &Vector3<f64>) -> Vector3<f64>,
    emit: &mut Emit<'_>,
) {
    for (j, &c) in at.compliance.iter().enumerate().take(end) {
        let (axis, origin) = at.posture.joint_axis(j);
        emit(parameter, theta(j), c * axis.dot(&moment(j, &origin)));
    }
}
