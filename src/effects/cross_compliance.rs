//! `cross_compliance:J:K`: the torque of joint K turns joint J, `theta_J += c tau_K`, as where two gears share a housing.

use super::joint_compliance::PLAUSIBLE_MDEG_PER_NM;
use super::shape::{Shape, theta};
use super::{Family, Needs, Origin, ParameterSpec, Scan};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "cross_compliance",
    arguments: ":J:K",
    what: "the torque of one joint turns another",
    equation: "theta_J += c tau_K",
    origin: Origin::Arm,
    scan: Scan::None,
    members: |subject| {
        let joints = 1..=subject.robot.joints();
        let pairs = joints.clone().flat_map(|j| joints.clone().map(move |k| (j, k)));
        pairs.filter(|(j, k)| j != k).map(|(j, k)| format!(":{j}:{k}")).collect()
    },
    build: |id, subject| {
        id.at_most(2)?;
        let (j, k) = (id.joint(0, subject)?, id.joint(1, subject)?);
        if j == k {
            return Err(id.wrong(format!("names two joints; of one joint it is joint_compliance:{}", j + 1)));
        }
        let unit = Unit::MDEG_PER_NM;
        let plausible = unit.to_si(SHARE_OF_COMPLIANCE * PLAUSIBLE_MDEG_PER_NM);
        let parameters = vec![ParameterSpec::new(format!("{}.c", id.whole), unit, plausible)];
        Shape::new(id, parameters, move |at, emit| emit(0, theta(j), at.loads.tau[k])).needs(&[Needs::Torques]).built()
    },
};

/// Plausible: a tenth of a joint's own compliance. A housing is some ten times as stiff as the gear in it (assumed).
const SHARE_OF_COMPLIANCE: f64 = 0.1;
