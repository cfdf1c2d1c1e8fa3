//! `tracker_registration`: the tracker's world differs from that of the artifact, `point += (x, y, z) + (rx, ry, rz) x
//! point`. Six parameters.
//!
//! Plausible size: three nests some 0.4 m apart, each located within the tracker's 20 um.

use nalgebra::Vector3;

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::situation::Kind;
use crate::effects::{Needs, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{UM, URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "tracker_registration",
    arguments: "",
    name: "registration of the tracker",
    what: "the tracker's world frame is off",
    equation: "point += (x, y, z) + (rx, ry, rz) x p",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::Point],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Sizes(100.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the tracker's frame does not coincide with the world's",
        intervention: Intervention {
            work: Work::Instrument,
            act: "measure the reference points of the tracker again",
            verify: "the reference points agree within the noise",
        },
    },
    signature: Signature {
        looks: [
            "Every point is off by one shift and one turn of the room, and the balls are not.",
            "A robot measured by the tracker alone absorbs it as a wrong base.",
            "It is the same for all postures, loads and times.",
        ],
        parted_by: "The reference points of the tracker measured again, or balls beside the points.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let mut parameters = ParameterSpec::xyz("tracker_registration", Unit::UM, 20.0 * UM);
        let turn = |axis| ParameterSpec::new(format!("tracker_registration.r{axis}"), Unit::URAD, 50.0 * URAD);
        parameters.extend(["x", "y", "z"].map(turn));
        Shape::new(id, parameters, |at, emit| {
            if let (Some(Kind::Point), Some(point)) = (at.kind, at.target) {
                for axis in 0..3 {
                    emit(axis, Site::target(axis), 1.0);
                    let turned = Vector3::ith(axis, 1.0).cross(&point);
                    (0..3).for_each(|k| emit(3 + axis, Site::target(k), turned[k]));
                }
            }
        })
        .owner(Owner::Session)
        .needs(&[Needs::Points])
        .built()
    },
};
