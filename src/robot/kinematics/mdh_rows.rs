//! MDH rows of several postures, with the sines and cosines of rarely changing angles kept from the last evaluation.

use pulp::Simd;

use crate::math::simd::{Axes, F64s, Group};
use crate::robot::MdhLink;

/// Sine and cosine of an angle in each lane.
#[derive(Clone, Copy)]
pub(super) struct Turn<S: Simd> {
    pub sin: F64s<S>,
    pub cos: F64s<S>,
}

/// Sine and cosine of an angle in each posture, kept from the last evaluation: twists hardly ever change between samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct CachedSinCos<const L: usize> {
    pub angle: [f64; L],
    pub sin: [f64; L],
    pub cos: [f64; L],
}

impl<const L: usize> CachedSinCos<L> {
    pub const ZERO: Self = CachedSinCos { angle: [0.0; L], sin: [0.0; L], cos: [1.0; L] };

    #[inline(always)]
    pub fn of<S: Simd>(&self, group: Group<S>) -> Turn<S> {
        Turn { sin: group.of(&self.sin), cos: group.of(&self.cos) }
    }

    #[inline(always)]
    pub fn differ(&self, angle: &[f64; L]) -> bool {
        // All bits at once: one comparison per lane would be one branch per lane.
        (0..L).fold(0, |bits, l| bits | (angle[l].to_bits() ^ self.angle[l].to_bits())) != 0
    }

    #[inline(always)]
    pub fn turn(&mut self, angle: &[f64; L]) {
        if self.differ(angle) {
            self.evaluate(angle);
        }
    }

    #[cold]
    fn evaluate(&mut self, angle: &[f64; L]) {
        for l in 0..L {
            // Usually all postures share it.
            (self.sin[l], self.cos[l]) = if l > 0 && angle[l].to_bits() == angle[l - 1].to_bits() {
                (self.sin[l - 1], self.cos[l - 1])
            } else {
                angle[l].sin_cos()
            };
        }
        self.angle = *angle;
    }
}

/// An MDH row in each posture, `theta` being the joint's angle plus its offsets, or `d` a prismatic joint's length.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))] // So that a register of eight numbers does not straddle two cache lines.
pub(super) struct MdhRows<const L: usize> {
    pub alpha: CachedSinCos<L>,
    pub a: [f64; L],
    pub beta: CachedSinCos<L>,
    pub skewed: bool,
    pub theta: CachedSinCos<L>,
    pub d: [f64; L],
    /// True if the joint is prismatic: its position is in `d`.
    pub slides: bool,
}

impl<const L: usize> MdhRows<L> {
    pub const ZERO: Self = {
        let (alpha, beta, theta) = (CachedSinCos::ZERO, CachedSinCos::ZERO, CachedSinCos::ZERO);
        MdhRows { alpha, a: [0.0; L], beta, skewed: false, theta, d: [0.0; L], slides: false }
    };

    /// Moves a prismatic joint to `q` (m); `deviations` are those of the row.
    pub fn slide(&mut self, mdh: &MdhLink, q: &[f64; L], deviations: &[[f64; L]]) {
        for l in 0..L {
            self.theta.angle[l] = mdh.theta + deviations[3][l];
            self.d[l] = mdh.d + deviations[4][l] + q[l];
        }
    }

    /// The frames at the end of this row, from those at its beginning.
    #[inline(always)]
    pub fn next<S: Simd>(&self, group: Group<S>, frame: &Axes<S>) -> Axes<S> {
        let (alpha, theta) = (self.alpha.of(group), self.theta.of(group));
        let y = (frame.y * alpha.cos).add_mul(frame.z, alpha.sin);
        let mut z = (frame.z * alpha.cos).sub_mul(frame.y, alpha.sin);
        let mut x = frame.x;
        // Few rows are skewed, and each product here would wait for the one before.
        if self.skewed {
            let beta = self.beta.of(group);
            (x, z) = ((x * beta.cos).sub_mul(z, beta.sin), (x * beta.sin).add_mul(z, beta.cos));
        }
        let o = frame.o.add_mul(frame.x, group.of(&self.a)).add_mul(z, group.of(&self.d));
        Axes { x: (x * theta.cos).add_mul(y, theta.sin), y: (y * theta.cos).sub_mul(x, theta.sin), z, o }
    }
}
