//! `tool_frame`: the TCP deviates from the position measured by the CMM. Three parameters, in the last frame.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::constant;
use crate::effects::{EffectId, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{MM, Unit};

impl EffectId {
    /// The position of the TCP, which a dataset states.
    pub const TOOL_FRAME: &str = "tool_frame";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::TOOL_FRAME,
    arguments: "",
    name: "position of the TCP",
    what: "the TCP is not where the CMM said",
    equation: "tool += (x, y, z)",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Tool],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.05),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the TCP is not where it was measured to be",
        intervention: Intervention {
            work: Work::TcpMeasured,
            act: "measure the tool again",
            verify: "the tool turned about its tip: the tip stays",
        },
    },
    signature: Signature {
        looks: [
            "With the arm known, every residual is the same in the axes of the tool; a fit of the arm hides nearly all of that in its last links.",
            "In the axes of the room it turns with the hand and looks like scatter.",
            "It does not grow with the reach of the arm.",
        ],
        parted_by: "The same point reached with the hand turned to several orientations.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameters = ["x", "y", "z"].map(|axis| ParameterSpec::new(format!("tool_{axis}"), Unit::MM, 0.03 * MM)).to_vec();
        constant(id, parameters, (0..3).map(|k| (k, Site::tool(k), 1.0)).collect()).owner(Owner::Session).built()
    },
};
