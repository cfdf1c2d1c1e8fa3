//! `cross_compliance:J:K`: the torque of joint K turns joint J, `theta_J += c tau_K`, for instance if two gears share a
//! housing.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
};
use crate::effects::family::turning;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::reference_torque;
use crate::effects::shape::{Shape, theta};
use crate::effects::{EffectId, Needs, ParameterSpec};
use crate::units::{URAD, Unit};

impl EffectId {
    /// Compliance to the torque of another joint.
    pub const CROSS_COMPLIANCE: &str = "cross_compliance";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::CROSS_COMPLIANCE,
    arguments: ":J:K",
    name: "compliance of {joint} to the torque of {joint 2}",
    what: "the torque of one joint turns another",
    equation: "theta_J += c tau_K",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::OtherTorque],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Sizes(20.0),
    period: Period::None,
    curve: CurveShape::Line,
    meaning: Meaning {
        physics: "two gears share a housing: the torque of one turns the other",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "A joint errs although its own load explains nothing.",
            "Drawn against the torque of the other joint the points lie on a line; drawn against its own they scatter.",
            "It vanishes where the other joint hangs in balance.",
        ],
        parted_by: "Postures in which one of the two joints is loaded and the other is not; with two payloads they are easy to find.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: |subject| {
        let joints = turning(subject);
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
        let plausible = AT_REFERENCE_TORQUE / reference_torque(subject.robot)[k];
        let parameters = vec![ParameterSpec::new(format!("{}.c", id.whole()), unit, plausible)];
        Shape::new(id, parameters, move |at, emit| emit(0, theta(j), at.loads.tau[k])).needs(&[Needs::Torques]).built()
    },
};

/// Plausible size: rotation of the other joint when joint K carries its reference torque, about as large as its other
/// errors (assumed).
const AT_REFERENCE_TORQUE: f64 = 60.0 * URAD;
