//! Effect on the arm of a load that differs from the entered one: it changes the joint torques, and so acts through the
//! compliance of the joints, `theta_J += c_J dtau_J`, with the model's present compliance.

use nalgebra::Vector3;

use crate::effects::shape::theta;
use crate::effects::situation::Situation;
use crate::effects::{Emit, Needs};

/// Requirements of all these effects.
pub(super) const NEEDS: &[Needs] = &[Needs::Compliance];

/// Emits `theta_J += c_J z_J . moment(o_J)` for the joints below `end` (counted from 0), where `moment` is the moment about
/// a point (world, N·m) per unit of the parameter.
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

#[cfg(test)]
mod tests {
    use nalgebra::Rotation3;

    use super::*;
    use crate::effects::{Subject, build};
    use crate::robot::kinematics::Posture;
    use crate::robot::sites::{Site, SiteIndex};
    use crate::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
    use crate::robot::{FramePose, Robot, built_in};

    /// Torques of an arm whose loads are changed by `change`, recomputed.
    fn torques(change: impl Fn(&mut Robot, &mut Payload, &mut Vector3<f64>), posture: &Posture) -> Vec<f64> {
        let mut robot = built_in("kr6_r700").expect("built in");
        let mut payload = payload();
        let mut gravity = DEFAULT_GRAVITY;
        change(&mut robot, &mut payload, &mut gravity);
        let mut loads = Loads::new(6);
        loads.compute(&robot, posture, &payload, &gravity, &Vector3::zeros());
        loads.tau
    }

    fn payload() -> Payload {
        Payload { name: "heavy".into(), mass: 6.0, com: Vector3::new(0.025, 0.01, -0.07) }
    }

    /// For torques of up to 100 N·m, over steps of a thousandth.
    const ROUNDING: f64 = 1e-10;

    #[test]
    fn a_wrong_load_turns_each_joint_by_its_compliance_times_the_torque_it_adds() {
        let robot = built_in("kr6_r700").expect("built in");
        let mut posture = Posture::new(&robot);
        let q = [0.4, -1.1, 1.3, 0.7, -0.6, 1.9];
        let base = FramePose { xyz: [0.0; 3], rz_ry_rx: [0.2, 0.3, -0.1] };
        posture.set(&robot, &base, &FramePose::default(), &q, &vec![0.0; SiteIndex::new(6).len()]);
        let mut loads = Loads::new(6);
        let payload = payload();
        loads.compute(&robot, &posture, &payload, &DEFAULT_GRAVITY, &Vector3::zeros());
        let compliance = [1e-5, 5e-5, 6e-5, 2e-4, 5e-4, 5e-4];
        let at = Situation { compliance: &compliance, ..Situation::at_rest(&robot, &q, &posture, &loads, &payload) };
        type Change = fn(&mut Robot, &mut Payload, &mut Vector3<f64>, f64);
        let cases: [(&str, usize, Change); 9] = [
            ("payload_mass", 0, |_, p, _, by| p.mass += by),
            ("payload_com", 0, |_, p, _, by| p.com.x += by),
            ("payload_com", 1, |_, p, _, by| p.com.y += by),
            ("payload_com", 2, |_, p, _, by| p.com.z += by),
            ("link_mass", 0, |r, _, _, by| r.links[1].mass *= 1.0 + by),
            ("link_mass", 1, |r, _, _, by| r.links[2].mass *= 1.0 + by),
            ("link_mass", 2, |r, _, _, by| r.links[3].mass *= 1.0 + by),
            ("gravity_direction", 0, |_, _, g, by| *g = Rotation3::new(Vector3::x() * by) * *g),
            ("gravity_direction", 1, |_, _, g, by| *g = Rotation3::new(Vector3::y() * by) * *g),
        ];
        for (id, parameter, change) in cases {
            let effect = build(id, &Subject::new(&robot, &[])).expect("in the catalogue");
            let mut turned = [0.0; 6];
            effect.terms(&at, &mut |p, site, weight| match site {
                Site::Mdh(j, _) if p == parameter => turned[usize::from(j)] += weight,
                _ => {}
            });
            let step = 1e-3;
            let more = torques(|r, p, g| change(r, p, g, step), &posture);
            let less = torques(|r, p, g| change(r, p, g, -step), &posture);
            assert!(turned.iter().any(|t| t.abs() > 1e-6), "{id} {parameter} turns nothing");
            for j in 0..6 {
                let slope = compliance[j] * (more[j] - less[j]) / (2.0 * step);
                // All but the rotation of gravity are linear; a rotation by a thousandth is linear to a millionth.
                let tolerance = compliance[j] * (ROUNDING + 1e-6 * loads.tau[j].abs().max(1.0));
                assert!(
                    (turned[j] - slope).abs() < tolerance,
                    "{id} {parameter} joint {}: {} against {slope}",
                    j + 1,
                    turned[j]
                );
            }
        }
    }
}
