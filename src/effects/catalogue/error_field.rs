//! `error_field`: what no named effect explains, as a table of joint errors over the posture.

use crate::effects::EffectId;
use crate::effects::error_field::error_field;
use crate::effects::facts::{
    Alias, CurveShape, Follows, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
};
use crate::effects::family::{Family, Origin, Scan, by_name};

impl EffectId {
    /// A field of joint errors.
    pub const ERROR_FIELD: &str = "error_field";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::ERROR_FIELD,
    arguments: "",
    name: "field of joint errors",
    what: "the joints err by any smooth function of two angles, or of load and angle",
    equation: "theta_J += f_J(q, tau), a table beside the list of effects",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointAngle, Follows::OtherAngles, Follows::JointTorque],
    role: Role::AnyShape,
    offered: Offered::ByName,
    physical: Physical::Any,
    linear_range: LinearRange::Unlimited,
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning { physics: "the joints err together, by causes that nobody has named", look: "" },
    signature: Signature {
        looks: [
            "Errors change smoothly with posture and come back with it.",
            "Against any one angle they only scatter; neighbours in joint space agree.",
            "Where nothing was measured the field says nothing.",
        ],
        parted_by: "Measured postures spread over the robot's work; a cause, once named, needs fewer numbers.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: by_name,
    build: error_field,
};
