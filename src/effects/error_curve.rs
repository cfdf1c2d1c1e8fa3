//! `error_curve:J`: any smooth error of a joint that repeats with its turn, `theta_J += sum_k s_k sin(k q_J) + c_k cos(k q_J)`, k = 1 to 40.
//!
//! Eighty numbers say little without a prior: they are to be fitted with their plausible sizes, which fall with the order.

use super::family::each_joint;
use super::shape::{per_joint, theta};
use super::{Family, Follows, LinearRange, Meaning, Origin, ParameterSpec, Period, Physical, Role, Scan, Stray};
use crate::units::{URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "error_curve",
    arguments: ":J",
    what: "a joint errs by any smooth curve",
    equation: "the same, summed over k = 1..40",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointAngle],
    role: Role::AnyShape,
    physical: Physical::Any,
    linear_range: LinearRange::Si(5e-3),
    period: Period::None,
    meaning: Meaning { physics: "a joint errs by a smooth curve of its own angle", look: "" },
    stray: Stray::None,
    members: each_joint,
    build: |id, subject| {
        let parameters = |_, name: &str| {
            let each = (1..=ORDERS).flat_map(|k| ["sin", "cos"].map(|part| (k, part)));
            each.map(|(k, part)| ParameterSpec::new(format!("{name}.{part}{k}"), Unit::URAD, plausible(k))).collect()
        };
        per_joint(id, id.joints(subject)?, parameters, |at, j, emit| {
            for k in 1..=ORDERS {
                let (sin, cos) = (k as f64 * at.q[j]).sin_cos();
                emit(2 * k - 2, theta(j), sin);
                emit(2 * k - 1, theta(j), cos);
            }
        })
        .built()
    },
};

const ORDERS: usize = 40;

/// One-sigma of a coefficient of order `k`, rad: falls as the root of the order, so that the curve's standard deviation is 100 urad.
fn plausible(k: usize) -> f64 {
    let sum: f64 = (1..=ORDERS).map(|k| 1.0 / k as f64).sum();
    100.0 * URAD / (sum * k as f64).sqrt()
}
