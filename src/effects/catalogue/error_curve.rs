//! `error_curve:J`: any smooth periodic error of a joint, `theta_J += sum_k s_k sin(k q_J) + c_k cos(k q_J)`, k = 1 to 40;
//! `error_curve:J:LO:HI`: a band of it, k = LO to HI.
//!
//! So many parameters are poorly determined without a prior and are to be fitted with one. The plausible sizes of the whole
//! curve fall with the order; those of a band are equal, and the size of the band is determined from the data.

use crate::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray,
};
use crate::effects::family::each_joint;
use crate::effects::family::{Family, Origin, Scan};
use crate::effects::shape::{per_joint, theta};
use crate::effects::{Effect, EffectError, EffectId, ParameterSpec, Subject};
use crate::units::{URAD, Unit};

impl EffectId {
    /// Any smooth curve of a joint.
    pub const ERROR_CURVE: &str = "error_curve";
}

pub(super) const FAMILY: Family = Family {
    id: EffectId::ERROR_CURVE,
    arguments: ":J",
    name: "error curve of {joint}",
    what: "a joint errs by any smooth curve",
    equation: "the same, summed over k = 1..40",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointAngle],
    role: Role::AnyShape,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning { physics: "a joint errs by a smooth curve of its own angle", intervention: Intervention::IN_THE_MODEL },
    signature: Signature {
        looks: [
            "The joint errs by a curve that belongs to no one cause.",
            "Against its own angle the points follow the same line each time the joint comes by.",
            "Between the angles that were measured the curve is a guess.",
        ],
        parted_by: "More angles of that joint; a named cause, if one fits, says more with fewer parameters.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: each_joint,
    build: |id, subject| match (id.argument(1), id.argument(2), id.argument(3)) {
        (Some(low), Some(high), None) => band(id, low, high, subject),
        _ => curve(id, id.joints(subject)?, 1..=ORDERS, "", plausible),
    },
};

/// Highest order of the Fourier series of a curve, per revolution (docs/hunting-a-missing-effect.md).
const ORDERS: usize = 40;

/// Highest order of a band.
const HIGHEST: usize = 1000;

/// Standard deviation of a plausible band, rad.
const BAND: f64 = 50.0 * URAD;

fn band(id: &EffectId, low: &str, high: &str, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    let joint = id.joint(0, subject)?;
    let (Ok(low), Ok(high)) = (low.parse::<usize>(), high.parse::<usize>()) else {
        return Err(id.wrong("ends in the lowest and the highest order of a band, two whole numbers"));
    };
    if !(1 <= low && low <= high && high <= HIGHEST) {
        return Err(id.wrong(format!("ends in the lowest and the highest order of a band, 1 to {HIGHEST}, ascending")));
    }
    let each = BAND / ((high - low + 1) as f64).sqrt();
    curve(id, vec![joint], low..=high, &format!(":{low}:{high}"), move |_| each)
}

/// Sine and cosine of each order, for each of the joints.
fn curve(
    id: &EffectId,
    joints: Vec<usize>,
    orders: std::ops::RangeInclusive<usize>,
    suffix: &str,
    plausible: impl Fn(usize) -> f64,
) -> Result<Box<dyn Effect>, EffectError> {
    let parameters = |_, name: &str| {
        let each = orders.clone().flat_map(|k| ["sin", "cos"].map(|part| (k, part)));
        each.map(|(k, part)| ParameterSpec::new(format!("{name}{suffix}.{part}{k}"), Unit::URAD, plausible(k))).collect()
    };
    let terms = orders.clone();
    per_joint(id, joints, parameters, move |at, j, emit| {
        let (sin_once, cos_once) = at.q[j].sin_cos();
        let (mut sin, mut cos) = (*terms.start() as f64 * at.q[j]).sin_cos();
        for (place, _) in terms.clone().enumerate() {
            emit(2 * place, theta(j), sin);
            emit(2 * place + 1, theta(j), cos);
            // Next order by recurrence: the errors of some hundred steps stay below 1e-13.
            (sin, cos) = (sin * cos_once + cos * sin_once, cos * cos_once - sin * sin_once);
        }
    })
    .built()
}

/// Plausible size (1 sigma) of a coefficient of order `k`, rad: falls as the root of the order, so that the curve's
/// standard deviation is 100 urad.
fn plausible(k: usize) -> f64 {
    let sum: f64 = (1..=ORDERS).map(|k| 1.0 / k as f64).sum();
    100.0 * URAD / (sum * k as f64).sqrt()
}
