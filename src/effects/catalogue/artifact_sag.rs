//! `artifact_sag`: the artifact leans progressively with height, `ball += (x, y) h²`, h being the height above the lowest
//! ball as a share of that of the highest: a stem that bends under its own weight.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "artifact_sag",
    arguments: "",
    name: "lean of the artifact with height",
    what: "the artifact leans with height",
    equation: "ball += (x, y) h^2",
    origin: Origin::Artifact,
    scan: Scan::None,
    follows: &[Follows::PlaceInArtifact],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the artifact leans, more so higher up",
        intervention: Intervention {
            work: Work::Artifact,
            act: "check the clamping of the artifact, and support it",
            verify: "measure the upper balls again: they are where the certificate says",
        },
    },
    signature: Signature {
        looks: [
            "The upper balls are off sideways, the lower ones not at all.",
            "Ball by ball, the residual grows with height.",
            "All postures on a ball agree.",
        ],
        parted_by: "A dial gauge against the highest ball while the artifact is pushed by hand.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameter = |axis| ParameterSpec::new(format!("artifact_sag.{axis}"), Unit::MM, 0.03 * MM);
        Shape::new(id, vec![parameter("x"), parameter("y")], |at, emit| {
            if let (Some(_), Some(ball), Some(artifact)) = (at.ball(), at.target, at.artifact) {
                let h = artifact.share_of_height(ball.z);
                (0..2).for_each(|k| emit(k, Site::target(k), h * h));
            }
        })
        .owner(Owner::Artifact)
        .needs(&[Needs::Balls])
        .built()
    },
};
