//! Arithmetic on several postures at once, in the lanes of a processor's registers; one posture is the instance of one lane.
//!
//! No closure may stand where these are used: it would be compiled for the registers that all processors have.
//! A product is fused with a sum where this says so and nowhere else, so that a lane holds the bytes that its posture has alone.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use nalgebra::Vector3;
use pulp::{Arch, Scalar, Simd, WithSimd};

/// Lanes of the widest registers; as many postures fill registers of any kind.
const WIDEST: usize = 8;

/// Whether `L` postures fill the widest registers, or are worked on one after another.
pub(super) const fn fill_registers<const L: usize>() -> bool {
    L.is_multiple_of(WIDEST)
}

/// Does work on `L` postures with all that the processor has, one lane at a time where they would not fill its registers.
#[inline(always)]
pub(super) fn in_lanes<const L: usize, W: WithSimd>(work: W) -> W::Output {
    // What is fused is a single instruction only where it is compiled for a processor that has it.
    if fill_registers::<L>() { Arch::new().dispatch(work) } else { Arch::new().dispatch(OneAfterAnother(work)) }
}

struct OneAfterAnother<W>(W);

impl<W: WithSimd> WithSimd for OneAfterAnother<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> W::Output {
        self.0.with_simd(Scalar::new())
    }
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

    /// This and the product of two others, rounded once.
    #[inline(always)]
    pub fn plus(self, a: Self, b: Self) -> Self {
        Numbers(self.0, self.0.mul_add_f64s(a.1, b.1, self.1))
    }

    /// This less the product of two others, rounded once.
    #[inline(always)]
    pub fn less(self, a: Self, b: Self) -> Self {
        Numbers(self.0, self.0.negate_mul_add_f64s(a.1, b.1, self.1))
    }

    /// Where that bit of these numbers is set.
    #[inline(always)]
    pub fn bit(self, bit: u32) -> Choice<S> {
        let simd = self.0;
        let (mask, bits) = (simd.splat_u64s(1 << bit), simd.transmute_u64s_f64s(self.1));
        Choice(simd, simd.equal_u64s(simd.and_u64s(bits, mask), mask))
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

/// Some of the lanes.
#[derive(Clone, Copy)]
pub(super) struct Choice<S: Simd>(S, S::m64s);

impl<S: Simd> Choice<S> {
    /// One number in these lanes, another in the rest.
    #[inline(always)]
    pub fn of(self, here: Numbers<S>, elsewhere: Numbers<S>) -> Numbers<S> {
        Numbers(self.0, self.0.select_f64s(self.1, here.1, elsewhere.1))
    }

    /// The lanes that are either of these or of the others, not of both.
    #[inline(always)]
    pub fn xor(self, other: Self) -> Self {
        Choice(self.0, self.0.xor_m64s(self.1, other.1))
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
    /// Products fused.
    #[inline(always)]
    pub fn dot(self, other: Self) -> Numbers<S> {
        (self.x * other.x).plus(self.y, other.y).plus(self.z, other.z)
    }

    /// This and a multiple of another, fused.
    #[inline(always)]
    pub fn plus(self, other: Self, by: Numbers<S>) -> Self {
        Vector { x: self.x.plus(other.x, by), y: self.y.plus(other.y, by), z: self.z.plus(other.z, by) }
    }

    /// This less a multiple of another, fused.
    #[inline(always)]
    pub fn less(self, other: Self, by: Numbers<S>) -> Self {
        Vector { x: self.x.less(other.x, by), y: self.y.less(other.y, by), z: self.z.less(other.z, by) }
    }

    /// The cross product, its second products fused.
    #[inline(always)]
    pub fn cross_fused(self, other: Self) -> Self {
        Vector {
            x: (self.y * other.z).less(self.z, other.y),
            y: (self.z * other.x).less(self.x, other.z),
            z: (self.x * other.y).less(self.y, other.x),
        }
    }

    /// The cross product, nothing fused: for what is asked of single postures in code compiled for all processors.
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
    /// World coordinates of a point given in this frame, products fused.
    #[inline(always)]
    pub fn point(&self, p: Vector<S>) -> Vector<S> {
        self.o.plus(self.x, p.x).plus(self.y, p.y).plus(self.z, p.z)
    }
}
