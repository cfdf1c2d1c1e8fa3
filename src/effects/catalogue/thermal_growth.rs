//! `thermal_growth`: all links grow, `a_i += e a_i`, `d_i += e d_i`, with `e = l t + s (1 - exp(-4 t))`, t being time as a
//! share of the session; `thermal_growth:temp`: with `e = k (T - 20 °C)`. The tool, mounted on the flange and measured
//! separately, does not grow.
//!
//! Plausible size: 1e-4 over a session, about 5 K of aluminium (23e-6 / K), a typical warm-up of a small arm.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::Shape;
use crate::effects::situation::Situation;
use crate::effects::{EffectId, Emit, Needs, Owner, ParameterSpec};
use crate::robot::sites::{MdhEntry, Site};
use crate::units::Unit;

impl EffectId {
    /// Links that grow as the arm warms up.
    pub const THERMAL_GROWTH: &str = "thermal_growth";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::THERMAL_GROWTH,
    arguments: "[:temp]",
    name: "thermal growth of the links with {clock}",
    what: "links grow with time, or temperature",
    equation: "l t + s (1 - exp(-4 t)), or k (T - 20)",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::Time, Follows::Temperature],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Sizes(20.0),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "links grow as the arm warms up",
        intervention: Intervention {
            work: Work::WarmUp,
            act: "let the arm run as long as before the calibration, or log temp_c",
            verify: "one pose measured every ten minutes stays",
        },
    },
    signature: Signature {
        looks: [
            "The arm grows: residuals point outwards along it, more each minute.",
            "Over time they rise fast at first and then level off.",
            "A long reach shows more of it than a short one.",
        ],
        parted_by: "The same stretched posture measured every few minutes from cold to warm, and temp_c: heat follows the temperature, a slipping clamp does not.",
    },
    stray: Stray::Slower(1.6),
    alias: Alias::None,
    members: |_| vec![String::new(), ":temp".into()],
    build: |id, _| match id.rest() {
        None => {
            let parameter = |part| ParameterSpec::new(format!("thermal_growth.{part}"), Unit::UM_PER_M, 1e-4);
            Shape::new(id, vec![parameter("linear"), parameter("settling")], |at, emit| {
                if let Some(t) = at.share_of_session() {
                    grow(at, 0, t, emit);
                    grow(at, 1, 1.0 - (-SETTLING * t).exp(), emit);
                }
            })
            .owner(Owner::Session)
            .needs(&[Needs::Time])
            .built()
        }
        Some("temp") => {
            let parameters = vec![ParameterSpec::new("thermal_growth:temp.k", Unit::UM_PER_M_K, 2e-5)];
            Shape::new(id, parameters, |at, emit| {
                if let Some(temperature) = at.temp_c {
                    grow(at, 0, temperature - REFERENCE_C, emit);
                }
            })
            .needs(&[Needs::Temperature])
            .built()
        }
        _ => Err(id.wrong("takes nothing after its name (by time), or `temp` (by temperature)")),
    },
};

/// Number of warm-up time constants in a session: each is half an hour of a two-hour session.
const SETTLING: f64 = 4.0;

/// Reference temperature of lengths (ISO 1), °C.
const REFERENCE_C: f64 = 20.0;

fn grow(at: &Situation<'_>, parameter: usize, share: f64, emit: &mut Emit<'_>) {
    for (i, link) in at.robot.links.iter().enumerate() {
        emit(parameter, Site::mdh(i, MdhEntry::A), share * link.mdh.a);
        emit(parameter, Site::mdh(i, MdhEntry::D), share * link.mdh.d);
    }
}
