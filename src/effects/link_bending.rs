//! `link_bending:J`: the link between joints J and J + 1 bends and twists, as a beam from frame J to frame J + 1.
//!
//! What hangs on frame J + 1 loads the beam with a force F and a moment M there, so that at p(s), s from 0 to 1, it carries
//! `M(s) = M + (p(1) - p(s)) x F`; each piece turns all after it by `(M_across(s)/EI + M_along(s)/GJ) L ds` about p(s)
//! (Euler-Bernoulli bending, Saint-Venant torsion; the link's own weight is left out).

use nalgebra::Vector3;

use super::shape::Shape;
use super::{Emit, Family, Needs, Origin, ParameterSpec, Scan, Subject};
use crate::robot::{Axis6, Frame, Site};
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "link_bending",
    arguments: ":J",
    what: "the link after a joint bends and twists under what it carries",
    equation: "integral of (M_across/EI + M_along/GJ) x (p - p(s)) ds from o_J to o_{J+1}",
    origin: Origin::Arm,
    scan: Scan::None,
    members: |subject| {
        let links = 1..subject.robot.joints();
        links.filter(|&j| length(subject, j) > SHORTEST).map(|j| format!(":{j}")).collect()
    },
    build: |id, subject| {
        id.at_most(1)?;
        let frame = id.joint(0, subject)? + 1;
        if frame == subject.robot.joints() || length(subject, frame) <= SHORTEST {
            return Err(id.wrong("names a joint whose axis is some way from the next"));
        }
        // Aluminium castings of a small arm: EI of 1.2 to 2.5e5 N·m² (assumed), the thicker after joint 2.
        let plausible = Unit::PER_MN_M2.to_si(if frame == 2 { 4.0 } else { 8.0 });
        let parameters = ["bending", "torsion"]
            .map(|part| ParameterSpec::new(format!("link_bending:{frame}.{part}"), Unit::PER_MN_M2, plausible));
        Shape::new(id, parameters.to_vec(), move |at, emit| {
            let (near, far) = (at.posture.frame(frame), at.posture.frame(frame + 1));
            let beam = far.o - near.o;
            let length = beam.norm();
            let along = beam / length;
            let mut turned = [Vector3::zeros(); 2];
            let mut moved = [Vector3::zeros(); 2];
            for s in GAUSS {
                let moment = at.loads.moment[frame + 1] + (beam * (1.0 - s)).cross(&at.loads.force[frame + 1]);
                let torsion = along * along.dot(&moment);
                for (k, part) in [moment - torsion, torsion].into_iter().enumerate() {
                    let turn = part * (length * GAUSS_WEIGHT);
                    turned[k] += turn;
                    moved[k] -= turn.cross(&(beam * s));
                }
            }
            for k in 0..2 {
                displace(k, frame, near, &turned[k], &moved[k], emit);
            }
        })
        .needs(&[Needs::Masses])
        .built()
    },
};

/// A link shorter than this is no beam, m.
const SHORTEST: f64 = 10.0 * MM;

/// Gauss's two points on 0..1: exact up to the third power, and the integrand is of the second.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];
const GAUSS_WEIGHT: f64 = 0.5;

/// Distance of frame `j` (counted from 1) from the next, m.
fn length(subject: &Subject<'_>, j: usize) -> f64 {
    let next = &subject.robot.links[j].mdh;
    next.a.hypot(next.d)
}

/// A turn about the origin of frame k and a shift (world), as deviations of its flex sites.
fn displace(parameter: usize, k: usize, frame: &Frame, turn: &Vector3<f64>, shift: &Vector3<f64>, emit: &mut Emit<'_>) {
    let (turn, shift) = (frame.components(turn), frame.components(shift));
    for (axis, weight) in Axis6::ALL.into_iter().zip([shift.x, shift.y, shift.z, turn.z, turn.y, turn.x]) {
        emit(parameter, Site::Flex(k, axis), weight);
    }
}
