//! `outlier:ID`: one sample disagrees with all others, `target += (x, y, z)` at that sample, in the world.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{EffectId, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{MM, Unit};

/// Id of the effect that excludes this sample.
pub fn setting_aside(sample: &str) -> String {
    EffectId::member(EffectId::OUTLIER, sample).into()
}

/// The sample excluded by an effect; `None` for any other effect.
///
/// ```
/// use calibench::effects::catalogue::{set_aside_by, setting_aside};
///
/// assert_eq!(setting_aside("p7"), "outlier:p7");
/// assert_eq!(set_aside_by("outlier:p7"), Some("p7"));
/// assert_eq!(set_aside_by("hysteresis:2"), None);
/// ```
pub fn set_aside_by(effect: &str) -> Option<&str> {
    effect.strip_prefix(EffectId::OUTLIER)?.strip_prefix(':')
}

impl EffectId {
    /// A sample set aside.
    pub const OUTLIER: &str = "outlier";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::OUTLIER,
    arguments: ":ID",
    name: "sample {name} excluded",
    what: "one sample disagrees with all others",
    equation: "target += (x, y, z) at sample ID",
    origin: Origin::SetUp,
    scan: Scan::Sample,
    follows: &[Follows::Sample],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.2),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "one sample disagrees with all others",
        intervention: Intervention {
            work: Work::Sample,
            act: "look at that sample: a wrong ball, a bad contact, a centring that did not end; clean ball and plungers, repeat it or leave it out",
            verify: "the same pose measured again agrees with the others",
        },
    },
    signature: Signature {
        looks: [
            "One sample lies far above all others.",
            "Its neighbours in posture and in time are right.",
            "Any smooth cause would have moved them too.",
        ],
        parted_by: "That sample once more. If it repeats, it is not an outlier but the first sign of something that no other posture shows.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, subject| {
        let sample = id.sample(subject)?.to_owned();
        Shape::new(id, ParameterSpec::xyz(id.whole(), Unit::MM, 0.2 * MM), move |at, emit| {
            if at.sample == Some(sample.as_str()) {
                (0..3).for_each(|k| emit(k, Site::target(k), 1.0));
            }
        })
        // Sample names are unique within a dataset only.
        .owner(Owner::Artifact)
        .built()
    },
};
