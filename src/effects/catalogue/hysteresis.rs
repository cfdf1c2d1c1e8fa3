//! `hysteresis:J`: lost motion by the direction from which a joint approached, `theta_J += h approach_J`.
//!
//! Plausible: 30 urad, half the width of a strain-wave gear's loop at the torque of a small arm; the unidirectional
//! repeatability of an IRB 1600 leaves no room for more (Slamani, Nubiola, Bonev, Robotics and Computer-Integrated
//! Manufacturing 28 (2012)).

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::any_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{by_kind, per_joint};
use crate::effects::{EffectId, Needs, ParameterSpec};
use crate::units::{UM, URAD, Unit};

impl EffectId {
    /// Lost motion by the side of approach, which a controller of joints has.
    pub const HYSTERESIS: &str = "hysteresis";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::HYSTERESIS,
    arguments: ":J",
    name: "hysteresis of {joint}",
    what: "lost motion by the side of the approach",
    equation: "theta_J += h approach_J",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Approach],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(1e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "a gear stops short on the side from which it came: friction and lost motion",
        intervention: Intervention {
            work: Work::Service,
            act: "approach every pose from the same side; have the gear of the joint adjusted if it grows",
            verify: "one pose approached ten times from either side: the two means agree",
        },
    },
    signature: Signature {
        looks: [
            "The same posture reached from the left and from the right leaves two different residuals.",
            "Against the side of approach the points form two clouds, one above zero and one below.",
            "Within each cloud there is no trend with angle or load.",
        ],
        parted_by: "Every posture twice, arriving from either side, and the columns approach1 ... that say which.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: any_joint,
    build: |id, subject| {
        // The play of a rail's rack and pinion is some hundredths of a millimetre.
        let lost = |j| by_kind(subject.robot, j, [(Unit::URAD, 30.0 * URAD), (Unit::UM, 30.0 * UM)]);
        per_joint(
            id,
            id.any_joints(subject)?,
            |j, name| vec![ParameterSpec::new(format!("{name}.h"), lost(j).0, lost(j).1)],
            |at, j, emit| {
                if let Some(&side) = at.approach.and_then(|signs| signs.get(j)) {
                    emit(0, at.robot.joint_site(j), f64::from(side));
                }
            },
        )
        .needs(&[Needs::Approach])
        .built()
    },
};
