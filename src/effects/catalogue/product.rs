//! `product:J:A:B`: the error of joint J depends on two joint angles at once, to first order:
//! `theta_J += sum of sin q_A sin q_B, sin q_A cos q_B, cos q_A sin q_B, cos q_A cos q_B`, each with a coefficient.
//!
//! A diagnosis seeks the pair with the highest evidence for each joint; most data cannot separate them all.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
};
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, theta};
use crate::effects::{EffectId, ParameterSpec};
use crate::robot::JointKind;
use crate::units::{URAD, Unit};

impl EffectId {
    /// Error of a joint by two angles at once, `product:J:A:B`.
    pub const PRODUCT: &str = "product";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::PRODUCT,
    arguments: ":J:A:B",
    name: "error of {joint} by the angles of {joint 2} and {joint 3} together",
    what: "a joint errs by two angles at once",
    equation: "theta_J += (sin, cos q_A) x (sin, cos q_B)",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointAngle, Follows::OtherAngles],
    role: Role::Event,
    offered: Offered::ByName,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the error of a joint depends on how two joints stand at once",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "The error of a joint changes with two angles at once.",
            "Against either angle alone the points only scatter; in a map of both there are hills and valleys.",
            "A curve of one angle absorbs little of it.",
        ],
        parted_by: "Combinations of the two angles on a grid; varying one at a time never shows it.",
    },
    stray: Stray::None,
    alias: Alias::None,
    // Pairs with the next joint: they share a housing or a bearing.
    members: |subject| {
        let turns = |j: usize| subject.robot.kind(j) == JointKind::Revolute;
        let pairs = (1..subject.robot.joints()).filter(|&j| turns(j - 1) && turns(j));
        pairs.map(|j| format!(":{j}:{j}:{}", j + 1)).collect()
    },
    build: |id, subject| {
        id.at_most(3)?;
        let (j, a, b) = (id.joint(0, subject)?, id.joint(1, subject)?, id.joint(2, subject)?);
        if a == b {
            return Err(id.wrong("names two joints after the first; of one angle it is harmonic2"));
        }
        let parameter = |name| ParameterSpec::new(format!("{}.{name}", id.whole()), Unit::URAD, 50.0 * URAD);
        Shape::new(id, ["ss", "sc", "cs", "cc"].map(parameter).to_vec(), move |at, emit| {
            let ((sin_a, cos_a), (sin_b, cos_b)) = (at.q[a].sin_cos(), at.q[b].sin_cos());
            for (k, weight) in [sin_a * sin_b, sin_a * cos_b, cos_a * sin_b, cos_a * cos_b].into_iter().enumerate() {
                emit(k, theta(j), weight);
            }
        })
        .built()
    },
};
