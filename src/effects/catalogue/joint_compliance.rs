//! `joint_compliance`, `joint_compliance:J`: the gearbox twists under gravity, `theta_J += c_J tau_J` (paper section 5).
//!
//! tau_J is the moment of the load about +z_J, so a compliant gearbox has c_J > 0; a negative estimate is not physical.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical,
};
use crate::effects::family::each_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{per_joint, theta};
use crate::effects::{EffectId, Needs, ParameterSpec};
use crate::units::Unit;

/// Plausible size: a few thousandths of a degree per newton metre (paper Table 8 spans 3 to 28).
const PLAUSIBLE_MDEG_PER_NM: f64 = 10.0;

impl EffectId {
    /// The compliances of the joints: other loads act through them.
    pub const JOINT_COMPLIANCE: &str = "joint_compliance";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::JOINT_COMPLIANCE,
    arguments: ":J",
    name: "compliance of {joint}",
    what: "gearboxes twist under gravity",
    equation: "theta_J += c_J tau_J",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointTorque, Follows::Payload],
    role: Role::Baseline,
    offered: Offered::AsWholeToo,
    physical: Physical::AtLeast(0.0, Unphysical::NegativeCompliance),
    linear_range: LinearRange::Sizes(10.0),
    period: Period::None,
    curve: CurveShape::Line,
    meaning: Meaning {
        physics: "gearboxes are springs: the load twists them by c times its torque",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "The tool hangs low, lower the farther the arm reaches out.",
            "Against the torque of a joint the error is a straight line through zero; fitted lengths and zeros bend with it and leave waves about that line.",
            "With a lighter payload it shrinks in proportion.",
        ],
        parted_by: "The same postures with a light and a heavy payload; without a change of load, the weight of the links alone looks much like wrong geometry.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: each_joint,
    build: |id, subject| {
        let unit = Unit::MDEG_PER_NM;
        per_joint(
            id,
            id.joints(subject)?,
            |j, _| vec![ParameterSpec::new(format!("c{}", j + 1), unit, unit.to_si(PLAUSIBLE_MDEG_PER_NM))],
            |at, j, emit| emit(0, theta(j), at.loads.tau[j]),
        )
        .needs(&[Needs::Torques])
        .built()
    },
};
