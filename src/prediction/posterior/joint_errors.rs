//! Joint angle errors of any shape: curves of a joint's own angle, and smooth functions of two variables (two joint
//! angles, or the joint's load and an angle).
//!
//! A function of two variables is a Gaussian process by random features (Rahimi & Recht 2007). Its uncertainty grows
//! again where there are no data, so that a dependence that looked like one on a single variable is not extrapolated
//! with certainty.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::linear_model::{Kind, Outer};
use crate::identify::problem::SampleContext;
use crate::units::URAD;

/// Bands of orders per turn; each band has one size (up to order 20, as decision 0026 says).
const BANDS: [RangeInclusive<usize>; 3] = [1..=4, 5..=10, 11..=20];

/// With fewer samples than this, only the first band is used.
const FOR_HIGH_ORDERS: usize = 20;

/// Length scales of a function of two variables, rad or multiples of the usual load.
const LENGTHS: [f64; 2] = [0.5, 1.5];

/// Number of random features per length scale.
const FEATURES: usize = 3;

/// One-sigma of a joint's error at plausible size, of a band or of a pair, rad.
const ORDINARY: f64 = 50.0 * URAD;

/// A variable on which a joint's error depends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Variable {
    Angle(usize),
    Load(usize),
}

/// A cosine wave in two variables.
struct Feature {
    frequency: [f64; 2],
    phase: f64,
}

/// Error of a joint as a function of two variables.
struct Pair {
    joint: usize,
    of: [Variable; 2],
    features: Vec<Feature>,
}

/// Shapes of joint errors.
pub(super) struct JointErrors {
    curves: Vec<(usize, RangeInclusive<usize>)>,
    pairs: Vec<Pair>,
    /// Root mean square load of each joint, N·m.
    load: Vec<f64>,
}

impl JointErrors {
    /// Shapes that have an effect at `contexts`; without curves if the model contains them.
    pub fn of(contexts: &[SampleContext], has_curves: bool) -> Self {
        let joints = contexts.first().map_or(0, |c| c.joints.len());
        let moves = |j: usize| contexts.iter().map(|c| c.joints[j].norm()).fold(0.0, f64::max);
        let most = (0..joints).map(moves).fold(0.0, f64::max);
        let moving: Vec<usize> = (0..joints).filter(|&j| moves(j) > 1e-6 * most).collect();
        let bands = if contexts.len() < FOR_HIGH_ORDERS { 1 } else { BANDS.len() };
        let of_joint = |&j: &usize| BANDS[..bands].iter().map(move |band| (j, band.clone()));
        let curves = if has_curves { Vec::new() } else { moving.iter().flat_map(of_joint).collect() };
        let mean_square = |j: usize| contexts.iter().map(|c| c.tau[j].powi(2)).sum::<f64>() / contexts.len() as f64;
        let load: Vec<f64> = (0..joints).map(|j| mean_square(j).sqrt()).collect();
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut wave = |length: f64| {
            let mut frequency = || <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random) / length;
            let frequency = [frequency(), frequency()];
            Feature { frequency, phase: TAU * random.random::<f64>() }
        };
        let angles: Vec<Variable> = (0..joints).map(Variable::Angle).collect();
        let mut pairs = Vec::new();
        for &joint in &moving {
            let of_angles = (0..joints).flat_map(|i| (i + 1..joints).map(move |k| [i, k].map(Variable::Angle)));
            let of_load = angles.iter().filter(|_| load[joint] > 0.0).map(|angle| [Variable::Load(joint), *angle]);
            for of in of_angles.chain(of_load) {
                // The dependence on a joint's own angle may be rougher than that on others.
                let lengths = if of.contains(&Variable::Angle(joint)) { &LENGTHS[..] } else { &LENGTHS[1..] };
                let each = lengths.iter().flat_map(|&length| (0..FEATURES).map(move |_| length));
                pairs.push(Pair { joint, of, features: each.map(&mut wave).collect() });
            }
        }
        JointErrors { curves, pairs, load }
    }

    /// Kind of each group, and its number of columns.
    pub fn groups(&self) -> impl Iterator<Item = (Kind, usize)> {
        let curves = self.curves.iter().map(|(_, band)| (Kind::Curves, 2 * band.clone().count()));
        curves.chain(self.pairs.iter().map(|pair| (Kind::Pairs, pair.features.len())))
    }

    /// The columns of all shapes at plausible size, joint by joint; the first one has the index `first`, in the order of
    /// [`groups`](Self::groups). The `rows` are those of the contexts in order, whitened in the same way, and others after
    /// them, which no shape moves.
    pub fn factors(&self, contexts: &[SampleContext], first: usize, rows: usize) -> Vec<Outer> {
        let mut joints = Vec::new();
        contexts.iter().take(1).for_each(|at| self.errors(at, &mut |j, _| joints.push(j)));
        let mut own = joints.clone();
        own.sort_unstable();
        own.dedup();
        let of_joint = |&j: &usize| {
            let columns: Vec<usize> = (0..joints.len()).filter(|&c| joints[c] == j).map(|c| first + c).collect();
            Outer { lever: DVector::zeros(rows), shapes: DMatrix::zeros(contexts.len(), columns.len()), columns }
        };
        let mut outers: Vec<Outer> = own.iter().map(of_joint).collect();
        let mut row = 0;
        let mut sizes = Vec::with_capacity(joints.len());
        for (s, at) in contexts.iter().enumerate() {
            sizes.clear();
            self.errors(at, &mut |_, size| sizes.push(size));
            for (Outer { lever, shapes, columns }, &j) in outers.iter_mut().zip(&own) {
                columns.iter().enumerate().for_each(|(c, &k)| shapes[(s, c)] = sizes[k - first]);
                (0..at.height).for_each(|k| lever[row + k] = at.joints[j][k]);
            }
            row += at.height;
        }
        outers
    }

    /// Passes the error of each shape in this context to `each`: the joint, and its angle error, rad.
    fn errors(&self, at: &SampleContext, each: &mut dyn FnMut(usize, f64)) {
        for (j, band) in &self.curves {
            let unit = ORDINARY / (band.clone().count() as f64).sqrt();
            for order in band.clone() {
                let (sin, cos) = (order as f64 * at.q[*j]).sin_cos();
                each(*j, unit * sin);
                each(*j, unit * cos);
            }
        }
        let value = |v: Variable| match v {
            Variable::Angle(j) => at.q[j],
            Variable::Load(j) => at.tau[j] / self.load[j],
        };
        for Pair { joint, of, features } in &self.pairs {
            let unit = ORDINARY * (2.0 / features.len() as f64).sqrt();
            let [a, b] = of.map(value);
            for Feature { frequency, phase } in features {
                each(*joint, unit * (frequency[0] * a + frequency[1] * b + phase).cos());
            }
        }
    }
}
