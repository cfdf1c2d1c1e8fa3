//! `gravity_backlash:J`: lost motion taken up by the load in its own direction, `theta_J += b tanh(tau_J / tau_0)`.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical, Work,
};
use crate::effects::family::each_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::reference_torque;
use crate::effects::shape::{per_joint, theta};
use crate::effects::{EffectId, Needs, ParameterSpec};
use crate::units::{URAD, Unit};

impl EffectId {
    /// Play that the load closes.
    pub const GRAVITY_BACKLASH: &str = "gravity_backlash";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::GRAVITY_BACKLASH,
    arguments: ":J",
    name: "backlash of {joint} under gravity",
    what: "lost motion by the side of the load",
    equation: "theta_J += b tanh(tau_J / tau_0)",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointTorque],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::AtLeast(0.0, Unphysical::LostMotionAgainstLoad),
    linear_range: LinearRange::Si(1e-3),
    period: Period::None,
    curve: CurveShape::Sign,
    meaning: Meaning {
        physics: "the play of a gear closes on the side to which the load pulls",
        intervention: Intervention {
            work: Work::Service,
            act: "test the play of the joint by hand, and have its gear adjusted",
            verify: "push and pull the outstretched arm with 50 N: the tool returns to the same reading",
        },
    },
    signature: Signature {
        looks: [
            "The joint errs by one amount while the load pulls one way, and by the opposite amount while it pulls the other way.",
            "Against its torque the points form two level shelves with a steep step at zero.",
            "Arriving from the other side changes nothing, because the load decides where the play closes.",
        ],
        parted_by: "Postures just to either side of the balance of the joint, where the torque is small: only there does a step differ from a line. Arriving from both sides distinguishes it from hysteresis.",
    },
    stray: Stray::Closing(2.0),
    alias: Alias::None,
    members: each_joint,
    build: |id, subject| {
        let closing: Vec<f64> = reference_torque(subject.robot).into_iter().map(|t| CLOSING_SHARE * t).collect();
        per_joint(
            id,
            id.joints(subject)?,
            |_, name| vec![ParameterSpec::new(format!("{name}.b"), Unit::URAD, 60.0 * URAD)],
            move |at, j, emit| emit(0, theta(j), (at.loads.tau[j] / closing[j]).tanh()),
        )
        .needs(&[Needs::Torques])
        .built()
    },
};

/// tau_0 as a share of the largest torque: the load needed to close the play.
const CLOSING_SHARE: f64 = 0.05;
