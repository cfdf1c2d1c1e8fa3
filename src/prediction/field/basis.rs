//! The functions of which the error of a joint's angle is made: curves of its own angle, products of curves of two joint
//! angles, and products of its load with a curve of an angle.
//!
//! Every group is a finite set of functions `phi`, scaled so that `sum phi(x) phi(x')` is the kernel of its Gaussian process
//! at plausible size. A posterior mean is then a short list of coefficients.

use std::ops::Range;

use crate::effects::error_field::{JointFunctions, PAIR_ORDERS};
use crate::units::URAD;

/// Plausible size of a joint's error, one-sigma, of a curve's band or of a pair, rad.
const ORDINARY: f64 = 50.0 * URAD;

/// Bands of orders per turn, each with one size.
const BANDS: [[usize; 2]; 5] = [[1, 4], [5, 10], [11, 20], [21, 40], [41, 80]];

/// Highest order of a coarse curve; gears and encoders make the others.
const COARSE: usize = 20;

/// Length scales of a function of two variables, rad; the weights of the orders are a mean over them.
const LENGTHS: [f64; 3] = [0.5, 0.9, 1.5];

/// Weight of the load's square beside the load itself, as variances.
const SQUARE: f64 = 0.3;

/// Weight of a pure function of the load beside those that change with an angle, as variances.
const LOAD_ALONE: f64 = 0.15;

/// Least lever of a joint that has curves, as a share of the largest: what moves less cannot be seen.
const CURVE_LEVER: f64 = 0.02;

/// Least lever of a joint that has pairs, as a share of the largest.
const PAIR_LEVER: f64 = 0.1;

/// Least load of a joint that has functions of it, as a share of the largest: the axis of the others is vertical.
const LEAST_LOAD: f64 = 1e-3;

/// Kinds of groups; sizes of one kind scatter about a common one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// Effects of the catalogue.
    Effect,
    /// Curves of a joint's own angle, to order 20.
    Curve,
    /// Curves of higher orders.
    FineCurve,
    /// Functions of two joint angles.
    Angles,
    /// Functions of a joint's load and an angle.
    Load,
}

/// All kinds.
pub(super) const KINDS: [Kind; 5] = [Kind::Effect, Kind::Curve, Kind::FineCurve, Kind::Angles, Kind::Load];

/// Functions of one size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Group {
    /// A candidate of the catalogue, by its index in the library.
    Effect(usize),
    /// Errors of a joint's angle.
    Joint(JointFunctions),
}

impl Group {
    pub fn kind(self) -> Kind {
        match self {
            Group::Effect(_) => Kind::Effect,
            Group::Joint(JointFunctions::Curve { orders: [_, last], .. }) if last <= COARSE => Kind::Curve,
            Group::Joint(JointFunctions::Curve { .. }) => Kind::FineCurve,
            Group::Joint(JointFunctions::Angles { .. }) => Kind::Angles,
            Group::Joint(JointFunctions::Load { .. }) => Kind::Load,
        }
    }

    /// Number of its functions; of an effect, none.
    pub fn width(self) -> usize {
        match self {
            Group::Effect(_) => 0,
            Group::Joint(functions) => functions.count(),
        }
    }
}

/// Size of each of these functions at plausible size, rad.
pub(super) fn scales(functions: JointFunctions) -> Vec<f64> {
    let weights = pair_weights();
    let of_waves = || weights.iter().flat_map(|w| [w.sqrt(); 2]);
    let shares: Vec<f64> = match functions {
        JointFunctions::Curve { orders: [first, last], .. } => {
            vec![((last + 1 - first) as f64).sqrt().recip(); functions.count()]
        }
        JointFunctions::Angles { .. } => of_waves().flat_map(|a| of_waves().map(move |b| a * b)).collect(),
        JointFunctions::Load { .. } => {
            let of_angle = || std::iter::once(LOAD_ALONE.sqrt()).chain(of_waves());
            [1.0, SQUARE.sqrt()].into_iter().flat_map(|load| of_angle().map(move |angle| load * angle)).collect()
        }
    };
    shares.into_iter().map(|share| ORDINARY * share).collect()
}

/// The groups of one joint, in the order of their functions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct JointGroups {
    pub joint: usize,
    pub groups: Vec<JointFunctions>,
    /// Size of each function, rad.
    scales: Vec<f64>,
}

impl JointGroups {
    /// The functions of each group.
    pub fn spans(&self) -> impl Iterator<Item = Range<usize>> {
        self.groups.iter().scan(0, |first, group| {
            let span = *first..*first + group.count();
            *first = span.end;
            Some(span)
        })
    }

    /// Number of all functions.
    pub fn width(&self) -> usize {
        self.scales.len()
    }
}

/// What the basis needs to know of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct JointFacts {
    /// True if it turns: the field knows no functions of a length.
    pub turns: bool,
    /// Root mean square displacement per angle, in any unit.
    pub lever: f64,
    /// Root mean square load, N·m.
    pub load: f64,
}

/// The functions of all joints.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Basis {
    pub joints: Vec<JointGroups>,
    /// Root mean square load of each joint, N·m.
    pub load: Vec<f64>,
}

/// Shares of the variance of a curve within a pair, by order from 1.
pub(super) fn pair_weights() -> [f64; PAIR_ORDERS] {
    let of = |order: usize| LENGTHS.iter().map(|l| l * (-0.5 * (l * order as f64).powi(2)).exp()).sum::<f64>();
    let all: [f64; PAIR_ORDERS] = std::array::from_fn(|k| of(k + 1));
    let sum: f64 = all.iter().sum();
    all.map(|w| w / sum)
}

impl Basis {
    /// The groups of a robot with these joints.
    pub fn of(joints: &[JointFacts]) -> Self {
        let turning = || joints.iter().enumerate().filter(|(_, j)| j.turns);
        let most = turning().map(|(_, j)| j.lever).fold(0.0, f64::max);
        let most_load = turning().map(|(_, j)| j.load).fold(0.0, f64::max);
        // The last joint turns the tool about itself: nothing of the arm stands differently.
        let variables: Vec<usize> = turning().map(|(j, _)| j).filter(|&j| j + 1 < joints.len()).collect();
        let groups_of = |(joint, facts): (usize, &JointFacts)| {
            if facts.lever <= CURVE_LEVER * most {
                return None;
            }
            let mut groups: Vec<JointFunctions> = BANDS.iter().map(|&orders| JointFunctions::Curve { joint, orders }).collect();
            if facts.lever > PAIR_LEVER * most {
                let pairs = variables.iter().enumerate().flat_map(|(k, &a)| variables[k + 1..].iter().map(move |&b| [a, b]));
                groups.extend(pairs.map(|of| JointFunctions::Angles { joint, of }));
                if facts.load > LEAST_LOAD * most_load {
                    groups.extend(variables.iter().map(|&angle| JointFunctions::Load { joint, angle }));
                }
            }
            let scales = groups.iter().flat_map(|&g| scales(g)).collect();
            Some(JointGroups { joint, groups, scales })
        };
        Basis { joints: turning().filter_map(groups_of).collect(), load: joints.iter().map(|j| j.load).collect() }
    }

    /// Writes the functions of one joint's groups at joint angles `q` (rad) and loads `tau` (N·m) into `to`, rad: one-sigma of
    /// the joint's error at plausible size.
    pub fn write(&self, of: &JointGroups, q: &[f64], tau: &[f64], to: &mut [f64]) {
        for (group, span) in of.groups.iter().zip(of.spans()) {
            let mut next = to[span].iter_mut();
            group.values(q, tau, &self.load, &mut |value| next.next().into_iter().for_each(|to| *to = value));
        }
        to.iter_mut().zip(&of.scales).for_each(|(value, scale)| *value *= scale);
    }
}
