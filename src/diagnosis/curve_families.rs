//! Assigns a curve of any shape to a family of effects, by projection on the families' shapes.

use nalgebra::{DMatrix, DVector};

use super::heat_map::{Curve, Variable};
use crate::effects::EffectId;
use crate::effects::facts::{CurveShape, Follows, Period};
use crate::effects::family::Family;
use crate::effects::registry::Registry;

/// A family must explain at least this share of a curve.
const SHARE: f64 = 0.85;

/// A smoother family is preferred unless another explains more by this share.
const BETTER: f64 = 0.02;

/// Orders of a harmonic that are tested on a curve.
const ORDERS: std::ops::RangeInclusive<u32> = 3..=12;

/// A family to which a curve belongs.
#[derive(Debug, Clone, PartialEq)]
pub struct CurveFamily {
    /// Id of the effect in a model.
    pub effect: EffectId,
    /// Share of the curve's weighted squares about its mean that the family's shape explains.
    pub share: f64,
}

impl CurveFamily {
    /// Finds the family of a curve; `None` if no family explains enough of it.
    pub fn of(curve: &Curve, registry: &Registry) -> Option<Self> {
        let best = shapes(curve, registry).into_iter().fold(None, |best: Option<CurveFamily>, (effect, columns)| {
            let share = share(curve, &columns);
            let better = best.as_ref().is_none_or(|b| share > b.share + BETTER);
            if better { Some(CurveFamily { effect, share }) } else { best }
        });
        best.filter(|b| b.share >= SHARE)
    }
}

type Shape = (EffectId, Vec<Vec<f64>>);

/// Shapes of the families of `registry` over the curve's variable, simple ones first.
fn shapes(curve: &Curve, registry: &Registry) -> Vec<Shape> {
    let joint = curve.joint + 1;
    let (arguments, follows): (String, &[Follows]) = match curve.variable {
        Variable::Angle(j) if j == curve.joint => (joint.to_string(), &[Follows::JointAngle, Follows::JointAngleInProportion]),
        Variable::Torque(j) if j == curve.joint => (joint.to_string(), &[Follows::JointTorque]),
        Variable::Torque(j) => (format!("{joint}:{}", j + 1), &[Follows::OtherTorque]),
        _ => return Vec::new(),
    };
    let of = |f: &dyn Fn(f64) -> f64| curve.at.iter().map(|&x| f(x)).collect::<Vec<f64>>();
    let wave = |k: u32| vec![of(&|x| (f64::from(k) * x).sin()), of(&|x| (f64::from(k) * x).cos())];
    let of_family = |family: &'static Family| -> Vec<(u32, Shape)> {
        let id = EffectId::member(family.id, &arguments);
        match (family.curve, family.period) {
            (CurveShape::Line, _) => vec![(0, (id, vec![of(&|x| x)]))],
            (CurveShape::Wave, Period::PerTurn(k)) => vec![(k, (id, wave(k)))],
            (CurveShape::Wave, Period::LastArgument) => {
                ORDERS.map(|k| (k, (EffectId::new(&format!("{id}:{k}")), wave(k)))).collect()
            }
            (CurveShape::Square, _) => vec![(1, (id, vec![of(&|x| x * x.abs())]))],
            (CurveShape::Sign, _) => vec![(2, (id, vec![of(&|x| if x == 0.0 { 0.0 } else { x.signum() })]))],
            (CurveShape::Wave, Period::None) | (CurveShape::None, _) => Vec::new(),
        }
    };
    let families = registry.families().filter(|f| f.follows.first().is_some_and(|first| follows.contains(first)));
    let mut all: Vec<(u32, Shape)> = families.flat_map(of_family).collect();
    all.sort_by_key(|(order, _)| *order);
    all.into_iter().map(|(_, shape)| shape).collect()
}

/// Share of the curve's squares about its mean that the columns explain; points are weighted by their uncertainty.
fn share(curve: &Curve, columns: &[Vec<f64>]) -> f64 {
    let n = curve.at.len();
    let weight: Vec<f64> = curve.sigma.iter().map(|s| 1.0 / (s * s).max(f64::MIN_POSITIVE).sqrt()).collect();
    let x = DMatrix::from_fn(n, columns.len() + 1, |i, c| weight[i] * if c == 0 { 1.0 } else { columns[c - 1][i] });
    let y = DVector::from_fn(n, |i, _| weight[i] * curve.mean[i]);
    let left = |x: &DMatrix<f64>| -> f64 {
        let svd = x.clone().svd(true, true);
        svd.solve(&y, 1e-9).map_or(f64::INFINITY, |b| (x * b - &y).norm_squared())
    };
    let whole = left(&x.columns(0, 1).into_owned());
    if whole > 0.0 { (1.0 - left(&x) / whole).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(of: impl Fn(f64) -> f64) -> Curve {
        let at: Vec<f64> = (0..41).map(|k| -2.5 + 5.0 * f64::from(k) / 40.0).collect();
        let mean = at.iter().map(|x| of(*x)).collect();
        Curve { joint: 0, variable: Variable::Angle(0), sigma: vec![1e-5; 41], at, mean, terms: Vec::new() }
    }

    #[test]
    fn a_sine_is_a_harmonic_and_a_bump_is_nothing() {
        let found = |c: &Curve| CurveFamily::of(c, Registry::catalogue()).map(|f| f.effect);
        assert_eq!(found(&curve(|q| 2e-4 * (q + 0.3).sin())).as_deref(), Some("harmonic1:1"));
        assert_eq!(found(&curve(|q| 2e-4 * (2.0 * q).cos())).as_deref(), Some("harmonic2:1"));
        assert_eq!(found(&curve(|q| 1e-4 * q)).as_deref(), Some("joint_scale:1"));
        assert_eq!(found(&curve(|q| 2e-4 * (-(q / 0.2).powi(2)).exp())), None);
    }
}
