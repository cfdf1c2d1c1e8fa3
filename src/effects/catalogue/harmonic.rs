//! `harmonic1:J`, `harmonic2:J`, `harmonic:J:k`: periodic transmission error, `theta_J += s sin(k q_J) + c cos(k q_J)`.
//!
//! Once per turn is eccentricity of a gear or of the encoder, twice is ovality; k at once or twice the gear ratio is the ripple of
//! the wave generator of a strain-wave gear, of which accuracy classes of about 1 arcmin peak to peak allow tens of microradians.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::each_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{per_joint, theta};
use crate::effects::{Effect, EffectError, EffectId, ParameterSpec};
use crate::units::{URAD, Unit};

impl EffectId {
    /// Once per turn.
    pub const HARMONIC_1: &str = "harmonic1";
    /// Twice per turn.
    pub const HARMONIC_2: &str = "harmonic2";
    /// Any number of times per turn.
    pub const HARMONIC: &str = "harmonic";
}

pub(super) const ONCE: Family = Family {
    id: EffectId::HARMONIC_1,
    arguments: ":J",
    name: "eccentricity of {joint}, 1 per turn",
    what: "a joint errs once per turn (eccentric)",
    equation: "theta_J += s sin(q_J) + c cos(q_J)",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointAngle],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::PerTurn(1),
    curve: CurveShape::Wave,
    meaning: Meaning {
        physics: "a gear or an encoder disc runs eccentric: an error once per turn",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "The joint runs ahead over half a turn and behind over the other half.",
            "Against its own angle the points follow one sine per turn.",
            "Load, time and the other joints do not change it.",
        ],
        parted_by: "Angles of the joint over more than half a turn: over a short range a sine is a straight line, which is a scale, or a bow, which is geometry.",
    },
    stray: Stray::Overtone(0.05),
    alias: Alias::None,
    members: each_joint,
    build: |id, subject| build(id, id.joints(subject)?, 1, ""),
};

pub(super) const TWICE: Family = Family {
    id: EffectId::HARMONIC_2,
    name: "ovality of {joint}, 2 per turn",
    what: "a joint errs twice per turn (oval)",
    equation: "theta_J += s sin(2 q_J) + c cos(2 q_J)",
    period: Period::PerTurn(2),
    meaning: Meaning {
        physics: "a gear runs oval, or an encoder is read at two opposite places: an error twice per turn",
        intervention: Intervention::IN_THE_MODEL,
    },
    signature: Signature {
        looks: [
            "The joint runs ahead and behind twice in a turn.",
            "Against its own angle the points follow two sines per turn.",
            "Load, time and the other joints do not change it.",
        ],
        parted_by: "Angles of the joint over more than a quarter of a turn, best over a whole one.",
    },
    build: |id, subject| build(id, id.joints(subject)?, 2, ""),
    ..ONCE
};

pub(super) const ANY: Family = Family {
    id: EffectId::HARMONIC,
    arguments: ":J:k",
    name: "gear ripple of {joint}, {order} per turn",
    what: "a joint errs k times per turn (teeth)",
    equation: "theta_J += s sin(k q_J) + c cos(k q_J)",
    scan: Scan::Order,
    period: Period::LastArgument,
    meaning: Meaning {
        physics: "teeth, or the wave generator of a strain-wave gear, repeat many times per turn",
        intervention: Intervention {
            work: Work::Model,
            act: "compare the order with the gear ratio and its double: it tells which wheel does it",
            verify: "the joint turned slowly over a few teeth against an indicator",
        },
    },
    signature: Signature {
        looks: [
            "Seen over the whole range it is a fuzzy band that looks like noise.",
            "Folded onto one period the band becomes a clean sine.",
            "The number of periods per turn is that of the teeth, or once or twice the gear ratio.",
        ],
        parted_by: "Many angles of the joint that do not share a step: a regular grid whose step is a multiple of the period shows nothing. A few dozen fine steps of that one joint settle it.",
    },
    build: |id, subject| {
        id.at_most(2)?;
        let joint = id.joint(0, subject)?;
        let order = id.argument(1).and_then(|a| a.parse::<u32>().ok()).filter(|k| (1..=1000).contains(k));
        let order = order.ok_or_else(|| id.wrong("ends in a whole number of periods per turn, 1 to 1000"))?;
        build(id, vec![joint], order, &format!(":{order}"))
    },
    ..ONCE
};

fn build(id: &EffectId, joints: Vec<usize>, order: u32, suffix: &str) -> Result<Box<dyn Effect>, EffectError> {
    let plausible = match order {
        1 => 70.0 * URAD,
        2 => 50.0 * URAD,
        _ => 40.0 * URAD,
    };
    let parameters = |_, name: &str| {
        ["sin", "cos"].map(|part| ParameterSpec::new(format!("{name}{suffix}.{part}"), Unit::URAD, plausible)).to_vec()
    };
    let order = f64::from(order);
    per_joint(id, joints, parameters, move |at, j, emit| {
        let (sin, cos) = (order * at.q[j]).sin_cos();
        emit(0, theta(j), sin);
        emit(1, theta(j), cos);
    })
    .built()
}
