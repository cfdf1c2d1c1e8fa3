//! `base_step:T`: base and artifact moved relative to each other once, T seconds into the session: `base += (x, y, z)`
//! after T, in the world.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, Needs, Owner, ParameterSpec};
use crate::robot::sites::{Axis6, Site};
use crate::units::{MM, Unit};

impl EffectId {
    /// The base that was bumped.
    pub const BASE_STEP: &str = "base_step";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::BASE_STEP,
    arguments: ":T",
    name: "base bumped {time}",
    what: "base or artifact was bumped once",
    equation: "base += (x, y, z) after T",
    origin: Origin::SetUp,
    scan: Scan::Time,
    follows: &[Follows::World, Follows::Time],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.02),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "base or artifact was bumped once",
        intervention: Intervention {
            work: Work::Base,
            act: "tighten base and artifact, and measure again whichever moved; what was measured before and after are two set-ups of the same arm",
            verify: "three poses measured again after an hour of work agree",
        },
    },
    signature: Signature {
        looks: [
            "Up to a certain sample all is well; from then on everything is off by the same amount in the room.",
            "Over time the points of a room axis lie on two level shelves.",
            "Reach and orientation of the tool do not change the height of the step.",
        ],
        parted_by: "Balls or points measured again after the event; points beside balls tell whether it was the base or the artifact.",
    },
    stray: Stray::Moment,
    alias: Alias::OnBalls(EffectId::ARTIFACT_STEP),
    members: alone,
    build: |id, _| {
        let time = id.time(0)?;
        Shape::new(id, ParameterSpec::xyz(id.whole(), Unit::MM, 0.05 * MM), move |at, emit| {
            if at.is_after(time) {
                (0..3).for_each(|k| emit(k, Site::Base(Axis6::ALL[k]), 1.0));
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Time])
        .built()
    },
};
