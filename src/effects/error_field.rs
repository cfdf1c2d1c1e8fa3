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

/// Orders of a curve within a function of two variables, per turn.
pub const PAIR_ORDERS: usize = 4;

/// Largest load, in multiples of its root mean square, beyond which its effect no longer grows: loads that were not measured
/// are not extrapolated.
const MOST_LOAD: f64 = 4.0;

/// Unit of the coefficients, rad: a nanometre at an arm's length.
pub const COEFFICIENT: f64 = 1e-9;

/// Highest order per turn of a curve, beyond all gears and encoders.
const MOST_ORDER: usize = 1000;

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
        for FieldTerm { functions, nrad } in &self.terms {
            let (mut next, mut sum) = (nrad.iter(), 0.0);
            functions.values(q, tau, &self.load, &mut |value| sum += value * next.next().map_or(0.0, |c| f64::from(*c)));
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
