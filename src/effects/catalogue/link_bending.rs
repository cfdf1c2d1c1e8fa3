//! `link_bending:J`: the link between joints J and J + 1 bends and twists, as a beam from frame J to frame J + 1.
//!
//! Everything carried by frame J + 1 loads the beam with a force F and a moment M there, so that at p(s), s from 0 to 1, it
//! carries `M(s) = M + (p(1) - p(s)) x F`; each element rotates everything after it by `(M_across(s)/EI + M_along(s)/GJ) L
//! ds` about p(s) (Euler-Bernoulli bending, Saint-Venant torsion; the link's own weight is neglected).

use nalgebra::Vector3;

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical,
};
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{Emit, Needs, ParameterSpec, Subject};
use crate::robot::sites::{Axis6, Site};
use crate::robot::{Frame, JointKind};
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "link_bending",
    arguments: ":J",
    name: "bending of {link}",
    what: "link J bends and twists",
    equation: "beam to J+1: M_across/EI, M_along/GJ",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Load],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::AtLeast(0.0, Unphysical::NegativeCompliance),
    linear_range: LinearRange::Sizes(30.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning { physics: "a link bends and twists as a beam", intervention: Intervention::IN_THE_MODEL },
    signature: Signature {
        looks: [
            "The tool hangs low with a long reach, and the error grows faster than the reach does.",
            "The bent link also turns everything after it, so the direction of the error follows the link and not the joint.",
            "With a lighter payload it shrinks in proportion.",
        ],
        parted_by: "Two payloads, with the link level and with it upright: upright it carries the same weight and does not bend.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: |subject| {
        let links = 1..subject.robot.joints();
        links.filter(|&j| is_beam(subject, j)).map(|j| format!(":{j}")).collect()
    },
    build: |id, subject| {
        id.at_most(1)?;
        let frame = id.joint(0, subject)? + 1;
        if frame == subject.robot.joints() || !is_beam(subject, frame) {
            return Err(id.wrong("names a joint whose axis is some way from the next, both of which turn"));
        }
        // Aluminium castings of a small arm: EI of 1.2 to 2.5e5 N·m² (assumed), the thicker one after joint 2.
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
                displace(k, frame, &near, [&turned[k], &moved[k]], emit);
            }
        })
        .needs(&[Needs::Masses])
        .built()
    },
};

/// Shortest link treated as a beam, m.
const SHORTEST: f64 = 10.0 * MM;

/// Abscissae of the two-point Gauss quadrature on 0..1, dimensionless: exact up to third order; the integrand is of second
/// order.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];
/// Weight of either abscissa, dimensionless.
const GAUSS_WEIGHT: f64 = 0.5;

/// True if the link of frame `j` (counted from 1) reaches from one axis of rotation to another some way off.
fn is_beam(subject: &Subject<'_>, j: usize) -> bool {
    let turns = |j: usize| subject.robot.kind(j) == JointKind::Revolute;
    turns(j - 1) && turns(j) && length(subject, j) > SHORTEST
}

/// Distance from frame `j` (counted from 1) to the next, m.
fn length(subject: &Subject<'_>, j: usize) -> f64 {
    let next = &subject.robot.links[j].mdh;
    next.a.hypot(next.d)
}

/// A rotation about the origin of frame k and a translation (both world), as deviations of its flex sites.
fn displace(parameter: usize, k: usize, frame: &Frame, motion: [&Vector3<f64>; 2], emit: &mut Emit<'_>) {
    let [turn, shift] = motion.map(|v| frame.components(v));
    for (axis, weight) in Axis6::ALL.into_iter().zip([shift.x, shift.y, shift.z, turn.z, turn.y, turn.x]) {
        emit(parameter, Site::flex(k, axis), weight);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::build;
    use crate::effects::situation::Situation;
    use crate::robot::kinematics::Posture;
    use crate::robot::sites::SiteIndex;
    use crate::robot::statics::{Loads, Payload};
    use crate::robot::{FramePose, Link, MdhLink, Robot};

    /// Displacement of a TCP at the end of a beam of 0.6 m along x from joint 1, or beside it, with a weight of 5 kg at the
    /// TCP.
    fn deflection(beside: f64) -> [Vector3<f64>; 2] {
        let link =
            |a: f64| Link { mdh: MdhLink { a, ..MdhLink::default() }, limits: [-1.0, 1.0], mass: 1e-12, com: Vector3::zeros() };
        let robot = Robot {
            name: "beam".into(),
            source: String::new(),
            links: vec![link(0.0), link(LENGTH)],
            gear_ratios: Vec::new(),
            ..Robot::default()
        };
        let payload = Payload { name: String::new(), mass: 5.0, com: Vector3::new(0.0, beside, 0.0) };
        let (mut posture, mut loads) = (Posture::new(&robot), Loads::new(2));
        let tool = FramePose { xyz: [0.0, beside, 0.0], ..FramePose::default() };
        posture.set(&robot, &FramePose::default(), &tool, &[0.0; 2], &vec![0.0; SiteIndex::new(2).len()]);
        loads.compute(&robot, &posture, &payload, &crate::robot::statics::DEFAULT_GRAVITY, &Vector3::zeros());
        let effect = build("link_bending:1", &Subject::new(&robot, &[])).expect("a beam");
        let mut moved = [Vector3::zeros(); 2];
        let at = Situation::at_rest(&robot, &[0.0; 2], &posture, &loads, &payload);
        effect.terms(&at, &mut |k, site, weight| moved[k] += posture.column(site) * weight);
        moved
    }

    /// Length of the beam, m.
    const LENGTH: f64 = 0.6;
    /// Weight at the end of the beam, N.
    const WEIGHT: f64 = 5.0 * 9.81;

    #[test]
    fn a_weight_at_the_end_of_a_beam_lowers_it_as_a_cantilever() {
        let [bent, twisted] = deflection(0.0);
        let textbook = Vector3::new(0.0, 0.0, -WEIGHT * LENGTH.powi(3) / 3.0);
        assert!((bent - textbook).norm() < 1e-9, "{bent} against {textbook}");
        assert!(twisted.norm() < 1e-9);
    }

    #[test]
    fn a_weight_beside_the_end_twists_it() {
        let [bent, twisted] = deflection(0.1);
        let textbook = Vector3::new(0.0, 0.0, -WEIGHT * LENGTH.powi(3) / 3.0);
        assert!((bent - textbook).norm() < 1e-9, "{bent} against {textbook}");
        // The angle is W b L / GJ, and the TCP is as far from the beam axis as the weight.
        let textbook = Vector3::new(0.0, 0.0, -WEIGHT * 0.1 * LENGTH * 0.1);
        assert!((twisted - textbook).norm() < 1e-9, "{twisted} against {textbook}");
    }
}
