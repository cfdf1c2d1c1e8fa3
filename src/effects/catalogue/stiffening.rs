//! `stiffening:J`: nonlinear compliance, `theta_J += k sign(tau_J) |tau_J / tau_ref|³`.
//!
//! Strain-wave gears are stiffer at high torque than at low (catalogues give three slopes), so k is negative for a physical
//! joint.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical,
};
use crate::effects::family::each_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::reference_torque;
use crate::effects::shape::{per_joint, theta};
use crate::effects::{EffectId, Needs, ParameterSpec};
use crate::units::{DEG, Unit};

impl EffectId {
    /// Gears that stiffen under load.
    pub const STIFFENING: &str = "stiffening";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::STIFFENING,
    arguments: ":J",
    name: "stiffening of {joint} under load",
    what: "gearboxes are stiffer under load",
    equation: "theta_J += k (tau_J / tau_ref)^3",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointTorque, Follows::Payload],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::AtMost(0.0, Unphysical::Softening),
    linear_range: LinearRange::Sizes(20.0),
    period: Period::None,
    curve: CurveShape::Square,
    meaning: Meaning {
        physics: "a strain-wave gear is stiffer at high torque than at low, so its twist is not a straight line",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "The joint sags, but less and less for each further newton metre.",
            "Against its torque the points follow an S that is steep at neither end: a straight line fitted to it leaves a third-order wave.",
            "At small torques nothing is seen at all.",
        ],
        parted_by: "Several payloads in one posture: three points on the curve of one joint distinguish an S from a line and from a step.",
    },
    stray: Stray::Power { nominal: 3.0, spread: 0.8 },
    alias: Alias::None,
    members: each_joint,
    build: |id, subject| {
        let reference = reference_torque(subject.robot);
        let plausible = |j: usize| SHARE_OF_LINEAR * TYPICAL_COMPLIANCE * reference[j];
        let parameters = |j: usize, name: &str| vec![ParameterSpec::new(format!("{name}.k"), Unit::URAD, plausible(j))];
        let joints = id.joints(subject)?;
        let scales = reference.clone();
        per_joint(id, joints, parameters, move |at, j, emit| emit(0, theta(j), (at.loads.tau[j] / scales[j]).powi(3)))
            .needs(&[Needs::Torques])
            .built()
    },
};

/// Plausible size at the reference torque, as a share of the linear deflection.
const SHARE_OF_LINEAR: f64 = 0.15;
/// Compliance of that linear deflection, rad/(N·m): 5 mdeg/(N·m), within the 3 to 28 of the paper's Table 8.
const TYPICAL_COMPLIANCE: f64 = 5e-3 * DEG;
