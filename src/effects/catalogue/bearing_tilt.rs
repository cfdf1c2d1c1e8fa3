//! `bearing_tilt:J`: the axis tilts under the moment across it, `phi = k (M_J - z_J (z_J . M_J))`, about the origin of
//! frame J.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
    Unphysical,
};
use crate::effects::family::each_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::per_joint;
use crate::effects::{EffectId, Needs, ParameterSpec};
use crate::robot::sites::{Axis6, Site};
use crate::units::{URAD, Unit};

impl EffectId {
    /// Bearings that tilt under load.
    pub const BEARING_TILT: &str = "bearing_tilt";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::BEARING_TILT,
    arguments: ":J",
    name: "bearing tilt of {joint}",
    what: "a joint's axis tips under the load",
    equation: "axis J tips by k M across z_J",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Load],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::AtLeast(0.0, Unphysical::NegativeCompliance),
    linear_range: LinearRange::Sizes(60.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "a bearing gives way: the axis tips under the load's moment",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "The tool moves across the plane in which the joint turns, more the greater the moment across its axis.",
            "No turn of any joint undoes it, so against joint angles it is only partly seen.",
            "With a lighter payload it shrinks in proportion.",
        ],
        parted_by: "Two payloads, and postures that load the axis from different sides; one payload and few postures cannot distinguish it from the bending of the link next to it.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: each_joint,
    build: |id, subject| {
        // Cross-roller bearings of a small arm: about 0.3 MN·m/rad near the base, 0.06 in the wrist.
        let plausible = |j: usize| if 2 * j < subject.robot.joints() { 3.0 * URAD } else { 15.0 * URAD };
        per_joint(
            id,
            id.joints(subject)?,
            |j, name| vec![ParameterSpec::new(format!("{name}.k"), Unit::URAD_PER_NM, plausible(j))],
            |at, j, emit| {
                let moment = at.posture.frame(j + 1).components(&at.loads.moment[j + 1]);
                emit(0, Site::flex(j + 1, Axis6::Rx), moment.x);
                emit(0, Site::flex(j + 1, Axis6::Ry), moment.y);
            },
        )
        .needs(&[Needs::Masses])
        .built()
    },
};
