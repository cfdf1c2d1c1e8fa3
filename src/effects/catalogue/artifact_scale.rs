//! `artifact_scale`: the artifact is warmer than on the CMM, `ball += s (ball - centroid)`. A shift of the whole artifact
//! belongs to the base.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "artifact_scale",
    arguments: "",
    name: "scale of the artifact",
    what: "the artifact is warmer than on the CMM",
    equation: "ball += s (ball - centroid)",
    origin: Origin::Artifact,
    scan: Scan::None,
    follows: &[Follows::PlaceInArtifact],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(1e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the artifact is warmer or colder than when it was certified",
        intervention: Intervention {
            work: Work::Artifact,
            act: "log the temperature of the artifact",
            verify: "the distance of two balls far apart, at the temperature of the certificate",
        },
    },
    signature: Signature {
        looks: [
            "Balls far from the middle of the artifact are off outwards (or inwards), those in the middle not at all.",
            "Ball by ball, the residual points away from the centre in proportion to the distance, as far as lengths and base do not absorb it.",
            "It is the same at the beginning and at the end.",
        ],
        parted_by: "The temperature of the artifact against that of its certificate: steel grows by 11.5 µm per metre and kelvin; or the distance of two balls by another instrument.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        // Steel, 3.5 K.
        Shape::new(id, vec![ParameterSpec::new("artifact_scale.s", Unit::UM_PER_M, 4e-5)], |at, emit| {
            if let (Some(_), Some(ball), Some(artifact)) = (at.ball(), at.target, at.artifact) {
                let from_centre = ball - artifact.centroid;
                (0..3).for_each(|k| emit(0, Site::target(k), from_centre[k]));
            }
        })
        .owner(Owner::Artifact)
        .needs(&[Needs::Balls])
        .built()
    },
};
