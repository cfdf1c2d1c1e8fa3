//! `artifact_step:T`: the artifact moved once, T seconds into the session: every ball is shifted by (x, y, z) after T, in
//! the world.
//!
//! If only balls are measured, this is exactly [`base_step`](super::base_step) with the opposite sign: only other targets,
//! or an inspection of the clamps, can distinguish the two.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, Needs, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{MM, Unit};

impl EffectId {
    /// The artifact that was moved.
    pub const ARTIFACT_STEP: &str = "artifact_step";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::ARTIFACT_STEP,
    arguments: ":T",
    name: "artifact bumped {time}",
    what: "the artifact was bumped once",
    equation: "every ball += (x, y, z) after T",
    origin: Origin::Artifact,
    scan: Scan::Time,
    follows: &[Follows::Time, Follows::World],
    role: Role::Event,
    offered: Offered::BesideOtherTargets,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.02),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the artifact was bumped once",
        intervention: Intervention {
            work: Work::Artifact,
            act: "tighten the clamps of the artifact; what was measured before and after are two sessions",
            verify: "three balls measured again at the end agree with the beginning",
        },
    },
    signature: Signature {
        looks: [
            "From a certain sample on every ball is off by the same amount, while points measured by another instrument are not.",
            "Over time the residuals on balls lie on two shelves.",
            "With balls alone it cannot be distinguished from a bump of the base.",
        ],
        parted_by: "Points measured without the artifact, before and after: they move if the base did, and stay if it was the artifact.",
    },
    stray: Stray::Moment,
    alias: Alias::OnBalls(EffectId::BASE_STEP),
    members: alone,
    build: |id, _| {
        let time = id.time(0)?;
        Shape::new(id, ParameterSpec::xyz(id.whole(), Unit::MM, 0.05 * MM), move |at, emit| {
            if at.ball().is_some() && at.is_after(time) {
                (0..3).for_each(|k| emit(k, Site::target(k), 1.0));
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Time, Needs::Balls])
        .built()
    },
};
