//! `probe_rotation`: the axes of measured orientations are not those of the tool. Three parameters, a rotation vector in them.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::constant;
use crate::effects::{EffectId, Needs, Owner, ParameterSpec};
use crate::robot::sites::Site;
use crate::units::{DEG, Unit};

impl EffectId {
    /// The axes of measured orientations, which a dataset states.
    pub const PROBE_ROTATION: &str = "probe_rotation";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::PROBE_ROTATION,
    arguments: "",
    name: "axes of the measured orientations",
    what: "the axes of measured orientations are not those of the tool",
    equation: "R_measured = R_tool exp(rx, ry, rz)",
    origin: Origin::Gauge,
    scan: Scan::None,
    follows: &[Follows::Tool],
    role: Role::Cause,
    offered: Offered::ToOrientations,
    physical: Physical::Any,
    linear_range: LinearRange::Unlimited,
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the instrument on the flange is not turned as stated",
        intervention: Intervention {
            work: Work::Instrument,
            act: "look at how the probe is mounted; state its axes in the dataset, or that they are free",
            verify: "one posture measured with the wrist turned by 90 deg",
        },
    },
    signature: Signature {
        looks: [
            "Positions are right and the orientations are all off by the same turn.",
            "In the axes of the tool the three numbers are the same at every sample.",
            "It does not change with posture, load or time.",
        ],
        parted_by: "Orientations measured with the hand turned about two axes at least.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameter = |axis| ParameterSpec::new(format!("probe_{axis}"), Unit::DEG, 0.05 * DEG);
        let terms = (0..3).map(|k| (k, Site::probe(k), 1.0)).collect();
        constant(id, ["rx", "ry", "rz"].map(parameter).to_vec(), terms)
            .owner(Owner::Session)
            .needs(&[Needs::Orientations])
            .built()
    },
};
