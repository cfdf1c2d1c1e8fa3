//! `joint_step:J:T`: a joint slipped once, T seconds into the session: `theta_J += s` after T.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::any_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{Shape, by_kind};
use crate::effects::{EffectId, Needs, Owner, ParameterSpec};
use crate::units::{UM, URAD, Unit};

impl EffectId {
    /// The joint that slipped.
    pub const JOINT_STEP: &str = "joint_step";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::JOINT_STEP,
    arguments: ":J:T",
    name: "slip of {joint} {time}",
    what: "a joint slipped once",
    equation: "theta_J += s after T",
    origin: Origin::Arm,
    scan: Scan::Time,
    follows: &[Follows::Time],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.02),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "a joint slipped once: a belt, a clamp, or a collision",
        intervention: Intervention {
            work: Work::Remaster,
            act: "master that joint again, after a look at the log: a collision, a slipped belt, an exchanged motor",
            verify: "three touches of the gauge or a pin agree with the calibration (`keep recover`, `keep check`)",
        },
    },
    signature: Signature {
        looks: [
            "Up to a certain sample all is well; from then on a joint is off by one amount.",
            "Over time the points lie on two level shelves.",
            "The lever decides how far the tool is off: much when stretched, nothing on the axis.",
        ],
        parted_by: "Postures of different reach after the event: a turned joint moves a stretched arm more, a bumped base moves all alike. A mastering check of that joint shows it at once.",
    },
    stray: Stray::Moment,
    alias: Alias::None,
    members: any_joint,
    build: |id, subject| {
        let (j, time) = (id.any_joint(0, subject)?, id.time(1)?);
        let (unit, size) = by_kind(subject.robot, j, [(Unit::URAD, 80.0 * URAD), (Unit::UM, 80.0 * UM)]);
        let parameters = vec![ParameterSpec::new(format!("{}.s", id.whole()), unit, size)];
        Shape::new(id, parameters, move |at, emit| {
            if at.is_after(time) {
                emit(0, at.robot.joint_site(j), 1.0);
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Time])
        .built()
    },
};
