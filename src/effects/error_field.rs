//! A field of joint errors as it is kept: errors of the joints' angles over the posture, and effects of the catalogue, all of
//! known size.
//!
//! A [`Model`](crate::identify::Model) that lists the effect `error_field` holds one. It describes what no named effect
//! explains; it is found by [`ladder`](crate::selection::ladder::ladder) and used only where it is measured to help.

use std::collections::BTreeMap;

use super::situation::Situation;
use super::{Effect, EffectError, EffectId, Emit, Needs, Owner, ParameterSpec, Subject, build};
use crate::effects::shape::theta;
use crate::robot::{JointKind, Robot};
use crate::units::Unit;

impl EffectId {
    /// A field of joint errors.
    pub const ERROR_FIELD: &str = "error_field";

    /// That field in words.
    pub(super) const ERROR_FIELD_IN_WORDS: &str = "field of joint errors";
}

/// Orders of a curve within a function of two variables, per turn.
pub const PAIR_ORDERS: usize = 4;

/// Largest load, in multiples of its root mean square, beyond which its effect no longer grows: loads that were not measured
/// are not extrapolated.
const MOST_LOAD: f64 = 4.0;

/// Unit of the coefficients, rad: a nanometre at an arm's length.
pub const COEFFICIENT: f64 = 1e-9;

/// Highest order per turn of a curve.
const MOST_ORDER: usize = 80;

/// Standard uncertainty of the field's share, which is one: it is a result, kept as if it were measured.
pub(crate) const SHARE_SIGMA: f64 = 1e-4;

/// A set of functions that make the error of a joint's angle. Joints are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum JointFunctions {
    /// Sine and cosine of the joint's own angle, from the first to the last of these orders per turn.
    Curve {
        /// The joint that errs.
        joint: usize,
        /// First and last order.
        orders: [usize; 2],
    },
    /// Products of waves of two joint angles, orders 1 to [`PAIR_ORDERS`] each.
    Angles {
        /// The joint that errs.
        joint: usize,
        /// The joints whose angles it follows.
        of: [usize; 2],
    },
    /// The joint's own load x and `x² - 1`, each alone and times the waves of an angle; x is the load over its root mean
    /// square, at most 4.
    Load {
        /// The joint that errs.
        joint: usize,
        /// The joint whose angle it follows as well.
        angle: usize,
    },
}

impl JointFunctions {
    /// The joint that errs.
    pub fn joint(self) -> usize {
        match self {
            JointFunctions::Curve { joint, .. } | JointFunctions::Angles { joint, .. } | JointFunctions::Load { joint, .. } => {
                joint
            }
        }
    }

    /// Number of functions.
    pub fn count(self) -> usize {
        match self {
            JointFunctions::Curve { orders: [first, last], .. } => 2 * (last + 1 - first),
            JointFunctions::Angles { .. } => 4 * PAIR_ORDERS * PAIR_ORDERS,
            JointFunctions::Load { .. } => 2 * (1 + 2 * PAIR_ORDERS),
        }
    }

    /// Calls `put` with the value of each function at joint angles `q` (rad) and loads `tau` (N·m); `load` is the root mean
    /// square load of each joint (N·m). Sine before cosine, order by order; of products the second angle runs faster.
    pub fn values(self, q: &[f64], tau: &[f64], load: &[f64], put: &mut impl FnMut(f64)) {
        match self {
            JointFunctions::Curve { joint, orders: [first, last] } => {
                for order in first..=last {
                    let (sin, cos) = (order as f64 * q[joint]).sin_cos();
                    put(sin);
                    put(cos);
                }
            }
            JointFunctions::Angles { of: [a, b], .. } => {
                let of_b = waves(q[b]);
                waves(q[a]).into_iter().for_each(|a| of_b.iter().for_each(|b| put(a * b)));
            }
            JointFunctions::Load { joint, angle } => {
                let x = (tau[joint] / load[joint]).clamp(-MOST_LOAD, MOST_LOAD);
                let of_angle = waves(q[angle]);
                for load in [x, x * x - 1.0] {
                    put(load);
                    of_angle.iter().for_each(|wave| put(load * wave));
                }
            }
        }
    }
}

/// Sine and cosine of an angle (rad), order by order.
fn waves(angle: f64) -> [f64; 2 * PAIR_ORDERS] {
    let mut all = [0.0; 2 * PAIR_ORDERS];
    for (k, pair) in all.chunks_exact_mut(2).enumerate() {
        let (sin, cos) = ((k + 1) as f64 * angle).sin_cos();
        pair.copy_from_slice(&[sin, cos]);
    }
    all
}

/// Sines and cosines of all joints' angles, order by order, each computed once for all terms.
struct Waves {
    /// Of each joint, and how many orders are computed.
    all: Vec<([[f64; 2]; MOST_ORDER], usize)>,
}

impl Waves {
    fn new(joints: usize) -> Self {
        Waves { all: vec![([[0.0; 2]; MOST_ORDER], 0); joints] }
    }

    /// Those of a joint at `angle` (rad), from the first to the last of these orders.
    fn of(&mut self, joint: usize, angle: f64, first: usize, last: usize) -> &[[f64; 2]] {
        let (own, known) = &mut self.all[joint];
        if *known == 0 {
            own[0] = angle.sin_cos().into();
            *known = 1;
        }
        // Next order by recurrence: the errors of some hundred steps stay below 1e-13.
        let [sin_once, cos_once] = own[0];
        while *known < last {
            let [sin, cos] = own[*known - 1];
            own[*known] = [sin * cos_once + cos * sin_once, cos * cos_once - sin * sin_once];
            *known += 1;
        }
        &own[first - 1..last]
    }
}

fn weighted([sin, cos]: &[f64; 2], c: &[i32]) -> f64 {
    sin * f64::from(c[0]) + cos * f64::from(c[1])
}

/// Sum of waves with a coefficient each.
fn sum_of(waves: &[[f64; 2]], c: &[i32]) -> f64 {
    waves.iter().zip(c.chunks_exact(2)).map(|(wave, c)| weighted(wave, c)).sum()
}

/// Functions of one joint, with a coefficient each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FieldTerm {
    /// The functions.
    pub functions: JointFunctions,
    /// One coefficient a function, in nanoradians.
    pub nrad: Vec<i32>,
}

/// An effect of known size.
#[derive(Debug, Clone, PartialEq)]
pub struct SizedEffect {
    /// The effect.
    pub effect: EffectId,
    /// One value a parameter, in plausible sizes.
    pub sizes: Vec<f64>,
}

/// A field of joint errors.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ErrorField {
    /// Root mean square load of each joint, N·m; zero for one without load.
    pub load: Vec<f64>,
    /// Errors of the joints' angles.
    pub terms: Vec<FieldTerm>,
    /// Effects of the catalogue within it.
    pub effects: Vec<SizedEffect>,
    /// One-sigma before the data of the parameters fitted beside it, in plausible sizes, by name.
    pub widths: BTreeMap<String, f64>,
    /// Effects of the set-up that were fitted beside it, listed in the model as well.
    pub beside: Vec<EffectId>,
    /// Digests of the datasets that it was found from.
    pub datasets: Vec<String>,
    /// Effective number of parameters, those of the model not counted.
    pub numbers: f64,
}

impl ErrorField {
    /// Calls `emit` with every joint that errs (counted from 0) and a part of its error, rad, at joint angles `q` (rad) and
    /// loads `tau` (N·m).
    pub fn errors(&self, q: &[f64], tau: &[f64], emit: &mut impl FnMut(usize, f64)) {
        let mut waves = Waves::new(q.len());
        for FieldTerm { functions, nrad } in &self.terms {
            let sum = match *functions {
                JointFunctions::Curve { joint, orders: [first, last] } => {
                    let of_angle = waves.of(joint, q[joint], first, last);
                    of_angle.iter().zip(nrad.chunks_exact(2)).map(|(wave, c)| weighted(wave, c)).sum::<f64>()
                }
                JointFunctions::Angles { of: [a, b], .. } => {
                    let [of_a, of_b] = [a, b].map(|j| {
                        let mut own = [[0.0; 2]; PAIR_ORDERS];
                        own.copy_from_slice(waves.of(j, q[j], 1, PAIR_ORDERS));
                        own
                    });
                    let of_second = nrad.chunks_exact(2 * PAIR_ORDERS).map(|c| sum_of(&of_b, c));
                    of_a.as_flattened().iter().zip(of_second).map(|(wave, second)| wave * second).sum()
                }
                JointFunctions::Load { joint, angle } => {
                    let x = (tau[joint] / self.load[joint]).clamp(-MOST_LOAD, MOST_LOAD);
                    let of_angle = waves.of(angle, q[angle], 1, PAIR_ORDERS);
                    let of_load = [x, x * x - 1.0].into_iter().zip(nrad.chunks_exact(1 + 2 * PAIR_ORDERS));
                    of_load.map(|(load, c)| load * (f64::from(c[0]) + sum_of(of_angle, &c[1..]))).sum()
                }
            };
            emit(functions.joint(), sum * COEFFICIENT);
        }
    }

    /// The first thing that does not fit the robot.
    fn mistake(&self, robot: &Robot) -> Option<String> {
        let joints = robot.joints();
        let turns = |j: usize| j < joints && robot.kind(j) == JointKind::Revolute;
        if self.load.len() != joints {
            return Some(format!("states {} loads for {joints} joints", self.load.len()));
        }
        let of_term = |(k, FieldTerm { functions, nrad }): (usize, &FieldTerm)| {
            let fits = match *functions {
                JointFunctions::Curve { joint, orders: [first, last] } => {
                    turns(joint) && 1 <= first && first <= last && last <= MOST_ORDER
                }
                JointFunctions::Angles { joint, of: [a, b] } => turns(joint) && turns(a) && turns(b) && a != b,
                JointFunctions::Load { joint, angle } => turns(joint) && turns(angle) && self.load[joint] > 0.0,
            };
            if !fits {
                return Some(format!("term {} does not fit the joints of the robot", k + 1));
            }
            let count = functions.count();
            (nrad.len() != count).then(|| format!("term {} holds {} coefficients in place of {count}", k + 1, nrad.len()))
        };
        self.terms.iter().enumerate().find_map(of_term)
    }
}

/// The effect of a field: its only parameter is its share, one.
struct Known {
    field: std::sync::Arc<ErrorField>,
    effects: Vec<(Box<dyn Effect>, Vec<f64>)>,
    parameters: [ParameterSpec; 1],
    needs: Vec<Needs>,
}

/// Builds the effect `error_field`.
pub(super) fn error_field(id: &EffectId, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    id.at_most(0)?;
    let field = subject.field.ok_or_else(|| id.wrong("its table [error_field] is missing; `calibench ladder` writes both"))?;
    if let Some(mistake) = field.mistake(subject.robot) {
        return Err(id.wrong(format!("its table {mistake}")));
    }
    let sized = |sized: &SizedEffect| {
        let effect = build(&sized.effect, subject)?;
        let specs = effect.parameters();
        if specs.len() != sized.sizes.len() {
            let problem = format!("its table gives '{}' {} sizes in place of {}", sized.effect, sized.sizes.len(), specs.len());
            return Err(id.wrong(problem));
        }
        let values = specs.iter().zip(&sized.sizes).map(|(spec, size)| spec.prior * size).collect();
        Ok((effect, values))
    };
    let effects = field.effects.iter().map(sized).collect::<Result<Vec<_>, EffectError>>()?;
    let of_load = field.terms.iter().any(|t| matches!(t.functions, JointFunctions::Load { .. }));
    let mut needs: Vec<Needs> = of_load.then_some(Needs::Torques).into_iter().collect();
    for need in effects.iter().flat_map(|(effect, _)| effect.needs()) {
        if !needs.contains(need) {
            needs.push(*need);
        }
    }
    let share = ParameterSpec::new(format!("{}.share", id.whole()), Unit::RATIO, 1.0);
    Ok(Box::new(Known { field: field.clone(), effects, parameters: [share], needs }))
}

impl Effect for Known {
    fn id(&self) -> &str {
        EffectId::ERROR_FIELD
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn owner(&self) -> Owner {
        Owner::Robot
    }

    fn needs(&self) -> &[Needs] {
        &self.needs
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>) {
        self.field.errors(at.q, &at.loads.tau, &mut |joint, error| emit(0, theta(joint), error));
        for (effect, values) in &self.effects {
            effect.terms(at, &mut |parameter, site, weight| emit(0, site, weight * values[parameter]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_sums_of_the_functions() {
        let all = [
            JointFunctions::Curve { joint: 2, orders: [1, 4] },
            JointFunctions::Curve { joint: 1, orders: [41, 80] },
            JointFunctions::Angles { joint: 0, of: [1, 3] },
            JointFunctions::Load { joint: 2, angle: 0 },
        ];
        let term = |functions: JointFunctions| {
            let nrad = (0..functions.count()).map(|k| (k as i32 * 7919) % 60_000 - 30_000).collect();
            FieldTerm { functions, nrad }
        };
        let field = ErrorField { load: vec![1.0, 20.0, 5.0, 1.0], terms: all.map(term).into(), ..ErrorField::default() };
        let (q, tau) = ([0.3, -1.7, 2.9, 0.8], [0.0, 31.0, -45.0, 0.1]);
        let mut by_joint = [0.0; 4];
        field.errors(&q, &tau, &mut |joint, error| by_joint[joint] += error);
        let mut plain = [0.0; 4];
        for FieldTerm { functions, nrad } in &field.terms {
            let mut next = nrad.iter();
            functions.values(&q, &tau, &field.load, &mut |value| {
                plain[functions.joint()] += value * f64::from(*next.next().unwrap()) * COEFFICIENT;
            });
        }
        for (a, b) in by_joint.iter().zip(plain) {
            assert!((a - b).abs() < 1e-15, "{a} {b}");
        }
        assert!(plain[0].abs() > 1e-6 && plain[1].abs() > 1e-6 && plain[2].abs() > 1e-6);
    }

    #[test]
    fn what_does_not_fit_the_robot_is_named() {
        let robot = crate::robot::built_in("ur5").unwrap();
        let balls: Vec<String> = Vec::new();
        let said = |field: ErrorField| {
            let field = std::sync::Arc::new(field);
            let subject = Subject { field: Some(&field), ..Subject::new(&robot, &balls) };
            build(EffectId::ERROR_FIELD, &subject).err().map(|e| e.to_string())
        };
        let with = |functions, count| ErrorField {
            load: vec![0.0; 6],
            terms: vec![FieldTerm { functions, nrad: vec![1; count] }],
            ..ErrorField::default()
        };
        let curve = JointFunctions::Curve { joint: 0, orders: [1, 4] };
        assert_eq!(said(with(curve, 8)), None);
        assert!(said(with(curve, 7)).unwrap().contains("term 1 holds 7 coefficients in place of 8"));
        let beyond = JointFunctions::Angles { joint: 0, of: [1, 6] };
        assert!(said(with(beyond, 64)).unwrap().contains("term 1 does not fit"));
        // No load is known of this joint.
        assert!(said(with(JointFunctions::Load { joint: 1, angle: 2 }, 18)).unwrap().contains("term 1 does not fit"));
        assert!(said(ErrorField::default()).unwrap().contains("states 0 loads for 6 joints"));
        let unknown = SizedEffect { effect: "harmonic1:2".into(), sizes: vec![1.0] };
        let field = ErrorField { load: vec![0.0; 6], effects: vec![unknown], ..ErrorField::default() };
        assert!(said(field).unwrap().contains("1 sizes in place of 2"));
    }
}
