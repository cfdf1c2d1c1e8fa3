//! Batched arithmetic on several postures, in the lanes of a processor's registers; a single posture is the instance with
//! one lane.
//!
//! Closures must not be used in code that calls these: they would be compiled for the baseline instruction set. A product
//! is fused with a sum only where documented, so that a lane holds exactly the bytes of its posture computed alone.

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use nalgebra::Vector3;
use pulp::{Arch, Scalar, Simd, WithSimd};

/// Lanes of the widest registers; this number of postures fills registers of any kind.
const WIDEST: usize = 8;

/// True if `L` postures fill the widest registers; otherwise they are processed one after another.
pub(crate) const fn fill_registers<const L: usize>() -> bool {
    L.is_multiple_of(WIDEST)
}

/// Runs `work` on `L` postures with the full instruction set of the processor, one lane at a time if they would not fill
/// its registers.
#[inline(always)]
pub(crate) fn in_lanes<const L: usize, W: WithSimd>(work: W) -> W::Output {
    // A fused operation is a single instruction only if compiled for a processor that has it.
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

/// One register of numbers.
#[derive(Clone, Copy)]
pub(crate) struct F64s<S: Simd>(S, S::f64s);

impl<S: Simd> Add for F64s<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        F64s(self.0, self.0.add_f64s(self.1, other.1))
    }
}

impl<S: Simd> Sub for F64s<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        F64s(self.0, self.0.sub_f64s(self.1, other.1))
    }
}

impl<S: Simd> Mul for F64s<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        F64s(self.0, self.0.mul_f64s(self.1, other.1))
    }
}

impl<S: Simd> Neg for F64s<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        F64s(self.0, self.0.neg_f64s(self.1))
    }
}

impl<S: Simd> F64s<S> {
    /// The same number in all lanes.
    #[inline(always)]
    pub fn splat(self, x: f64) -> Self {
        F64s(self.0, self.0.splat_f64s(x))
    }

    /// This plus the product of two others, rounded once. WebAssembly has no instruction for that, and a function would take
    /// longer than everything else: there it is rounded twice.
    #[inline(always)]
    pub fn add_mul(self, a: Self, b: Self) -> Self {
        if cfg!(target_family = "wasm") {
            return self + a * b;
        }
        F64s(self.0, self.0.mul_add_f64s(a.1, b.1, self.1))
    }

    /// This minus the product of two others, rounded as by [`F64s::add_mul`].
    #[inline(always)]
    pub fn sub_mul(self, a: Self, b: Self) -> Self {
        if cfg!(target_family = "wasm") {
            return self - a * b;
        }
        F64s(self.0, self.0.negate_mul_add_f64s(a.1, b.1, self.1))
    }

    /// The lanes in which this bit is set.
    #[inline(always)]
    pub fn bit(self, bit: u32) -> LaneMask<S> {
        let simd = self.0;
        let (mask, bits) = (simd.splat_u64s(1 << bit), simd.transmute_u64s_f64s(self.1));
        LaneMask(simd, simd.equal_u64s(simd.and_u64s(bits, mask), mask))
    }

    /// Wraps a register.
    #[inline(always)]
    pub fn new(simd: S, numbers: S::f64s) -> Self {
        F64s(simd, numbers)
    }

    /// The register.
    #[inline(always)]
    pub fn held(self) -> S::f64s {
        self.1
    }
}

/// A selection of lanes.
#[derive(Clone, Copy)]
pub(crate) struct LaneMask<S: Simd>(S, S::m64s);

impl<S: Simd> LaneMask<S> {
    /// Selects one number in these lanes, the other elsewhere.
    #[inline(always)]
    pub fn of(self, here: F64s<S>, elsewhere: F64s<S>) -> F64s<S> {
        F64s(self.0, self.0.select_f64s(self.1, here.1, elsewhere.1))
    }

    /// The lanes in exactly one of the two selections.
    #[inline(always)]
    pub fn xor(self, other: Self) -> Self {
        LaneMask(self.0, self.0.xor_m64s(self.1, other.1))
    }
}

/// The postures that fill a register, beginning at `first`.
#[derive(Clone, Copy)]
pub(crate) struct Group<S: Simd> {
    simd: S,
    first: usize,
}

impl Group<Scalar> {
    /// A single posture.
    #[inline(always)]
    pub fn lane(lane: usize) -> Self {
        Group { simd: Scalar::new(), first: lane }
    }
}

impl From<F64s<Scalar>> for f64 {
    #[inline(always)]
    fn from(number: F64s<Scalar>) -> f64 {
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
    /// The group beginning at `first`.
    #[inline(always)]
    pub fn new(simd: S, first: usize) -> Self {
        Group { simd, first }
    }

    /// The same number for all.
    #[inline(always)]
    pub fn splat(self, x: f64) -> F64s<S> {
        F64s(self.simd, self.simd.splat_f64s(x))
    }

    /// The group's numbers.
    #[inline(always)]
    pub fn of<const L: usize>(self, list: &[f64; L]) -> F64s<S> {
        F64s(self.simd, S::as_simd_f64s(&list[self.first..]).0[0])
    }

    /// Replaces the group's numbers.
    #[inline(always)]
    pub fn put<const L: usize>(self, list: &mut [f64; L], numbers: F64s<S>) {
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
pub(crate) struct Vector<S: Simd> {
    pub x: F64s<S>,
    pub y: F64s<S>,
    pub z: F64s<S>,
}

impl<S: Simd> Vector<S> {
    /// Dot product, fused.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F64s<S> {
        (self.x * other.x).add_mul(self.y, other.y).add_mul(self.z, other.z)
    }

    /// This plus a multiple of another, fused.
    #[inline(always)]
    pub fn add_mul(self, other: Self, by: F64s<S>) -> Self {
        Vector { x: self.x.add_mul(other.x, by), y: self.y.add_mul(other.y, by), z: self.z.add_mul(other.z, by) }
    }

    /// This minus a multiple of another, fused.
    #[inline(always)]
    pub fn sub_mul(self, other: Self, by: F64s<S>) -> Self {
        Vector { x: self.x.sub_mul(other.x, by), y: self.y.sub_mul(other.y, by), z: self.z.sub_mul(other.z, by) }
    }

    /// The cross product, its second products fused.
    #[inline(always)]
    pub fn cross_fused(self, other: Self) -> Self {
        Vector {
            x: (self.y * other.z).sub_mul(self.z, other.y),
            y: (self.z * other.x).sub_mul(self.x, other.z),
            z: (self.x * other.y).sub_mul(self.y, other.x),
        }
    }

    /// The cross product, not fused: for single postures in code compiled for the baseline instruction set.
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

impl<S: Simd> Mul<F64s<S>> for Vector<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: F64s<S>) -> Self {
        Vector { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}

/// A frame in each lane: axes and origin in the world.
#[derive(Clone, Copy)]
pub(crate) struct Axes<S: Simd> {
    pub x: Vector<S>,
    pub y: Vector<S>,
    pub z: Vector<S>,
    pub o: Vector<S>,
}

impl<S: Simd> Axes<S> {
    /// World coordinates of a point given in this frame, products fused.
    #[inline(always)]
    pub fn point(&self, p: Vector<S>) -> Vector<S> {
        self.o.add_mul(self.x, p.x).add_mul(self.y, p.y).add_mul(self.z, p.z)
    }
}
