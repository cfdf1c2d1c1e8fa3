//! `base_frame`: the pose of the robot in the world. `T_W0(chi) = Tr(x, y, z) Rz Ry Rx` (paper Eq. 2), six parameters.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
};
use crate::effects::family::alone;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::constant;
use crate::effects::{EffectId, Owner, ParameterSpec};
use crate::robot::sites::{Axis6, Site};
use crate::units::{DEG, MM, Unit};

impl EffectId {
    /// The pose of the base in the world, which a dataset states.
    pub const BASE_FRAME: &str = "base_frame";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::BASE_FRAME,
    arguments: "",
    name: "pose of the base",
    what: "the base is displaced from its nominal pose",
    equation: "chi_B += (x, y, z, rz, ry, rx)",
    origin: Origin::SetUp,
    scan: Scan::None,
    follows: &[Follows::World],
    role: Role::Baseline,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Unlimited,
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the robot does not stand where the program believes",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "With nothing else fitted, every residual points the same way, or turns about one axis as the pages of a book do.",
            "Fitted lengths and zeros absorb most of it and leave broad bows against the first joints, which show where in the cell the tool was.",
            "Nothing in it depends on the load, the time or the side of approach.",
        ],
        parted_by: "Points far apart in the cell, at least three of them not on a line; a robot that was only moved leaves the distances between its points as they were.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: alone,
    build: |id, _| {
        id.at_most(0)?;
        let parameters = Axis6::ALL.iter().map(|axis| {
            let (unit, plausible) = if (*axis as usize) < 3 { (Unit::MM, MM) } else { (Unit::DEG, 0.1 * DEG) };
            ParameterSpec::new(format!("base_{}", axis.name()), unit, plausible)
        });
        let terms = Axis6::ALL.into_iter().enumerate().map(|(k, axis)| (k, Site::Base(axis), 1.0)).collect();
        constant(id, parameters.collect(), terms).owner(Owner::Session).built()
    },
};
