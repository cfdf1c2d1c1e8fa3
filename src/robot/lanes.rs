//! Arithmetic on several postures at once, in the lanes of a processor's registers; one posture is the instance of one lane.
//!
//! No closure may stand where these are used: it would be compiled for the registers that all processors have.
//! Nothing is contracted into fused operations, so that a lane holds the bytes that its posture has alone.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use nalgebra::Vector3;
use pulp::{Arch, Scalar, Simd, WithSimd};

/// Lanes of the widest registers; as many postures fill registers of any kind.
const WIDEST: usize = 8;

/// Does work on `L` postures in the widest registers that the processor has, one lane at a time where they would not be filled.
#[inline(always)]
pub(super) fn in_lanes<const L: usize, W: WithSimd>(work: W) -> W::Output {
    if L.is_multiple_of(WIDEST) { Arch::new().dispatch(work) } else { work.with_simd(Scalar::new()) }
}

/// As many numbers as a register holds.
#[derive(Clone, Copy)]
pub(super) struct Numbers<S: Simd>(S, S::f64s);

impl<S: Simd> Add for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Numbers(self.0, self.0.add_f64s(self.1, other.1))
    }
}

impl<S: Simd> Sub for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Numbers(self.0, self.0.sub_f64s(self.1, other.1))
    }
}

impl<S: Simd> Mul for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Numbers(self.0, self.0.mul_f64s(self.1, other.1))
    }
}

impl<S: Simd> Neg for Numbers<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Numbers(self.0, self.0.neg_f64s(self.1))
    }
}

impl<S: Simd> Numbers<S> {
    /// The same number in all lanes.
    #[inline(always)]
    pub fn splat(self, x: f64) -> Self {
        Numbers(self.0, self.0.splat_f64s(x))
    }

    /// In each lane this number where that bit of the number in `bits` is set, and `other` where it is not.
    #[inline(always)]
    pub fn where_bit(self, bit: u32, bits: Self, other: Self) -> Self {
        let simd = self.0;
        let (mask, bits) = (simd.splat_u64s(1 << bit), simd.transmute_u64s_f64s(bits.1));
        let set = simd.equal_u64s(simd.and_u64s(bits, mask), mask);
        Numbers(simd, simd.select_f64s(set, self.1, other.1))
    }

    /// As many numbers as a register holds.
    #[inline(always)]
    pub fn new(simd: S, numbers: S::f64s) -> Self {
        Numbers(simd, numbers)
    }

    /// What the register holds.
    #[inline(always)]
    pub fn held(self) -> S::f64s {
        self.1
    }
}

/// Which of the postures fill a register: those from `first` on.
#[derive(Clone, Copy)]
pub(super) struct Group<S: Simd> {
    simd: S,
    first: usize,
}

impl Group<Scalar> {
    /// One posture alone.
    #[inline(always)]
    pub fn lane(lane: usize) -> Self {
        Group { simd: Scalar::new(), first: lane }
    }
}

impl From<Numbers<Scalar>> for f64 {
    #[inline(always)]
    fn from(number: Numbers<Scalar>) -> f64 {
        number.1
    }
}

impl From<Vector<Scalar>> for Vector3<f64> {
    #[inline(always)]
    fn from(v: Vector<Scalar>) -> Vector3<f64> {
        Vector3::new(v.x.1, v.y.1, v.z.1)
    }
}

impl<S: Simd> Group<S> {
    /// Those from `first` on.
    #[inline(always)]
    pub fn new(simd: S, first: usize) -> Self {
        Group { simd, first }
    }

    /// The same number for all.
    #[inline(always)]
    pub fn splat(self, x: f64) -> Numbers<S> {
        Numbers(self.simd, self.simd.splat_f64s(x))
    }

    /// Their numbers.
    #[inline(always)]
    pub fn of<const L: usize>(self, list: &[f64; L]) -> Numbers<S> {
        Numbers(self.simd, S::as_simd_f64s(&list[self.first..]).0[0])
    }

    /// Replaces their numbers.
    #[inline(always)]
    pub fn put<const L: usize>(self, list: &mut [f64; L], numbers: Numbers<S>) {
        S::as_mut_simd_f64s(&mut list[self.first..]).0[0] = numbers.1;
    }

    /// The same vector for all.
    #[inline(always)]
    pub fn vector(self, v: &Vector3<f64>) -> Vector<S> {
        Vector { x: self.splat(v.x), y: self.splat(v.y), z: self.splat(v.z) }
    }
}

/// A vector in each lane.
#[derive(Clone, Copy)]
pub(super) struct Vector<S: Simd> {
    pub x: Numbers<S>,
    pub y: Numbers<S>,
    pub z: Numbers<S>,
}

impl<S: Simd> Vector<S> {
    #[inline(always)]
    pub fn dot(self, other: Self) -> Numbers<S> {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Vector {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }
}

impl<S: Simd> Add for Vector<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Vector { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<S: Simd> AddAssign for Vector<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<S: Simd> Sub for Vector<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Vector { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<S: Simd> Neg for Vector<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Vector { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<S: Simd> Mul<Numbers<S>> for Vector<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: Numbers<S>) -> Self {
        Vector { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}

/// A frame in each lane: axes and origin in the world.
#[derive(Clone, Copy)]
pub(super) struct Axes<S: Simd> {
    pub x: Vector<S>,
    pub y: Vector<S>,
    pub z: Vector<S>,
    pub o: Vector<S>,
}

impl<S: Simd> Axes<S> {
    /// World coordinates of a point given in this frame.
    #[inline(always)]
    pub fn point(&self, p: Vector<S>) -> Vector<S> {
        self.o + (self.x * p.x + self.y * p.y + self.z * p.z)
    }
}
