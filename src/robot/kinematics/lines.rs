//! MDH lines of several postures, with the sines of what seldom turns kept from the last evaluation.

use pulp::Simd;

use super::super::lanes::{Axes, Group, Numbers};

/// Sine and cosine of an angle in each lane.
#[derive(Clone, Copy)]
pub(super) struct Turn<S: Simd> {
    pub sin: Numbers<S>,
    pub cos: Numbers<S>,
}

/// Sines and cosines of an angle in each posture, kept from the last evaluation: twists hardly ever change between samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trigs<const L: usize> {
    pub angle: [f64; L],
    pub sin: [f64; L],
    pub cos: [f64; L],
}

impl<const L: usize> Trigs<L> {
    pub const ZERO: Self = Trigs { angle: [0.0; L], sin: [0.0; L], cos: [1.0; L] };

    #[inline(always)]
    pub fn of<S: Simd>(&self, group: Group<S>) -> Turn<S> {
        Turn { sin: group.of(&self.sin), cos: group.of(&self.cos) }
    }

    #[inline(always)]
    pub fn differ(&self, angle: &[f64; L]) -> bool {
        // All bits at once: a comparison a lane would be a branch a lane.
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
            // Most often all postures share it.
            (self.sin[l], self.cos[l]) = if l > 0 && angle[l].to_bits() == angle[l - 1].to_bits() {
                (self.sin[l - 1], self.cos[l - 1])
            } else {
                angle[l].sin_cos()
            };
        }
        self.angle = *angle;
    }
}

/// An MDH line in each posture, `theta` being the joint's angle and what is added to it.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))] // A register of eight numbers is then no two lines of the cache.
pub(super) struct Lines<const L: usize> {
    pub alpha: Trigs<L>,
    pub a: [f64; L],
    pub beta: Trigs<L>,
    pub skewed: bool,
    pub theta: Trigs<L>,
    pub d: [f64; L],
}

impl<const L: usize> Lines<L> {
    pub const ZERO: Self = {
        let (alpha, beta, theta) = (Trigs::ZERO, Trigs::ZERO, Trigs::ZERO);
        Lines { alpha, a: [0.0; L], beta, skewed: false, theta, d: [0.0; L] }
    };

    /// The frames at the end of this line, of those where it begins.
    #[inline(always)]
    pub fn next<S: Simd>(&self, group: Group<S>, frame: &Axes<S>) -> Axes<S> {
        let (alpha, theta) = (self.alpha.of(group), self.theta.of(group));
        let y = (frame.y * alpha.cos).plus(frame.z, alpha.sin);
        let mut z = (frame.z * alpha.cos).less(frame.y, alpha.sin);
        let mut x = frame.x;
        // Skewed are few lines, and each product here would wait for the one before.
        if self.skewed {
            let beta = self.beta.of(group);
            (x, z) = ((x * beta.cos).less(z, beta.sin), (x * beta.sin).plus(z, beta.cos));
        }
        let o = frame.o.plus(frame.x, group.of(&self.a)).plus(z, group.of(&self.d));
        Axes { x: (x * theta.cos).plus(y, theta.sin), y: (y * theta.cos).less(x, theta.sin), z, o }
    }
}
