//! `hose_drag:J:V`: the hose or cable of joint V follows it with play and pulls at joint J by where it lies,
//! `theta_J += h (q_V - hose_V) / play`, with a play of 0.5 rad on either side; the hose begins where the joint begins, and goes
//! through the samples of a session in the order of measurement.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::{Family, Origin, Scan, turning};
use crate::effects::shape::{Shape, theta};
use crate::effects::{EffectId, ParameterSpec};
use crate::units::{URAD, Unit};

impl EffectId {
    /// Pull of a joint's hose at another joint, `hose_drag:J:V`.
    pub const HOSE_DRAG: &str = "hose_drag";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::HOSE_DRAG,
    arguments: ":J:V",
    name: "pull at {joint} by the hose of {joint 2}",
    what: "a hose that follows one joint with play pulls at another",
    equation: "theta_J += h (q_V - hose_V) / 0.5 rad",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::LastMove],
    role: Role::Event,
    offered: Offered::InOrder,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "a hose or cable pack is dragged along: it pulls to the side from which the joint came, the farther the more",
        intervention: Intervention {
            work: Work::Service,
            act: "look at the hoses and cables along the arm: clamps too tight, too short a loop, a pack that rubs",
            verify: "one pose approached from either side of the joint that carries the hose: the two agree",
        },
    },
    signature: Signature {
        looks: [
            "The same posture reached from two sides leaves two different residuals, of another joint than the one that moved.",
            "After a short move back the residual has changed by a part only.",
            "In another order of measurement the same postures have different residuals.",
        ],
        parted_by: "The same postures in another order: what comes from where the arm stands stays, what comes from where it was changes.",
    },
    stray: Stray::None,
    alias: Alias::None,
    // At the joint itself it is lost motion, which has an effect of its own.
    members: |subject| {
        let of_joint = |j: usize| turning(subject).filter(move |v| *v != j).map(move |v| format!(":{j}:{v}"));
        turning(subject).flat_map(of_joint).collect()
    },
    build: |id, subject| {
        id.at_most(2)?;
        let (j, v) = (id.joint(0, subject)?, id.joint(1, subject)?);
        if j == v {
            return Err(id.wrong("names one joint twice; at the joint itself it is hysteresis"));
        }
        let pull = ParameterSpec::new(format!("{}.h", id.whole()), Unit::URAD, 50.0 * URAD);
        Shape::new(id, vec![pull], move |at, emit| {
            if let Some(hose) = at.hose.and_then(|hose| hose.get(v)) {
                emit(0, theta(j), *hose);
            }
        })
        .built()
    },
};
