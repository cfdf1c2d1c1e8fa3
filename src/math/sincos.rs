//! Sines and cosines, batched over all joints of an arm, or over a joint of several arms.
//!
//! Branch-free and without tables, to use all lanes of a processor's registers. Products are fused with sums only where
//! documented, so that the bytes do not depend on the lanes.

use pulp::Simd;

use super::simd::F64s;

/// Number of angles of one posture computed together; most arms have six or seven joints.
pub(crate) const BATCH: usize = 8;

/// Beyond this (rad), some 160,000 revolutions, the C library is used.
const LARGEST: f64 = 1e6;

/// A right angle, and the error of its floating-point value: multiples of both are subtracted from an angle with one
/// rounding each (Cody & Waite 1980); multiples below 2^20 leave an error of 2^-86 plus the roundings.
#[cfg(not(target_family = "wasm"))]
const RIGHT: [f64; 2] = [std::f64::consts::FRAC_PI_2, 6.123_233_995_736_766e-17];

/// The same in parts of 33 bits, whose multiples are exact, where products are not fused with sums (FDLIBM's `e_rem_pio2.c`,
/// Sun 1993).
#[cfg(target_family = "wasm")]
const RIGHT: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

/// Sine minus its argument, divided by its cube, as a polynomial of `z = r²`, `|r| <= pi / 4`, to 2^-58 (FDLIBM's `k_sin.c`,
/// Sun 1993).
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
/// Cosine minus `1 - z / 2`, divided by `z²`, as a polynomial of the same `z`, to 2^-58 (FDLIBM's `k_cos.c`, Sun 1993).
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Added to a number below 2^51, it leaves no bits for a fraction: the sum is rounded to an integer, held in its last bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// True if the C library has to be used.
#[inline(always)]
pub(crate) fn is_far(angle: f64) -> bool {
    angle.abs() > LARGEST
}

/// Sines and cosines of angles (rad) that are not [far](is_far), each to an absolute error of 3e-16.
#[inline(always)]
pub(crate) fn sincos<S: Simd>(angle: F64s<S>) -> (F64s<S>, F64s<S>) {
    let whole = angle.splat(WHOLE);
    let counted = whole.add_mul(angle, angle.splat(std::f64::consts::FRAC_2_PI));
    let rights = counted - whole;
    let mut r = angle;
    for part in RIGHT {
        r = r.sub_mul(rights, angle.splat(part));
    }
    let z = r * r;
    let s = r.add_mul(z * r, polynomial(z, SINE));
    let c = z.splat(1.0).add_mul(z, z.splat(-0.5).add_mul(z, polynomial(z, COSINE)));
    // Every odd right angle swaps the two, and two of them change the sign.
    let (odd, two) = (counted.bit(0), counted.bit(1));
    let (sin, cos) = (odd.of(c, s), odd.of(s, c));
    (two.of(-sin, sin), two.xor(odd).of(-cos, cos))
}

#[inline(always)]
fn polynomial<S: Simd>(z: F64s<S>, coefficients: [f64; 6]) -> F64s<S> {
    let [a0, a1, a2, a3, a4, a5] = coefficients;
    // Estrin's scheme: with Horner's each operation would wait for the one before.
    let zz = z * z;
    let low = z.splat(a0).add_mul(z, z.splat(a1)).add_mul(zz, z.splat(a2).add_mul(z, z.splat(a3)));
    low.add_mul(zz * zz, z.splat(a4).add_mul(z, z.splat(a5)))
}

/// Sines and cosines of several angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SinCos {
    pub sin: [f64; BATCH],
    pub cos: [f64; BATCH],
    /// True if any angle is [far](is_far), so that its sine and cosine are still to be computed.
    pub far: bool,
}

/// Sines and cosines of angles (rad).
#[inline(always)]
pub(crate) fn sincos_batch<S: Simd>(simd: S, angles: &[f64; BATCH]) -> SinCos {
    let mut of = SinCos { sin: [0.0; BATCH], cos: [0.0; BATCH], far: any_far(angles) };
    let registers = S::as_mut_simd_f64s(&mut of.sin).0.iter_mut().zip(S::as_mut_simd_f64s(&mut of.cos).0);
    for ((sin, cos), angles) in registers.zip(S::as_simd_f64s(angles).0) {
        let (sines, cosines) = sincos(F64s::new(simd, *angles));
        (*sin, *cos) = (sines.held(), cosines.held());
    }
    of
}

/// True if any of them is [far](is_far).
#[inline(always)]
pub(crate) fn any_far<const N: usize>(angles: &[f64; N]) -> bool {
    let mut any = false;
    for angle in angles {
        any |= is_far(*angle);
    }
    any
}

#[cfg(test)]
mod tests {
    use pulp::{Arch, Scalar, WithSimd};

    use super::*;

    struct OfAll<'a>(&'a [f64; BATCH]);

    impl WithSimd for OfAll<'_> {
        type Output = SinCos;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> SinCos {
            sincos_batch(simd, self.0)
        }
    }

    fn both(angles: &[f64; BATCH]) -> ([f64; BATCH], [f64; BATCH]) {
        let SinCos { sin, cos, .. } = Arch::new().dispatch(OfAll(angles));
        (sin, cos)
    }

    /// One rounding each of sine and cosine near one, plus half of one of the C library, which is accurate to 0.55 of one.
    const TOLERANCE: f64 = 3e-16;

    fn largest_error(angles: impl Iterator<Item = f64>) -> f64 {
        let angles: Vec<f64> = angles.collect();
        let of_eight = |eight: &[f64]| {
            let (sin, cos) = both(eight.try_into().unwrap());
            let off = |k: usize| (sin[k] - eight[k].sin()).abs().max((cos[k] - eight[k].cos()).abs());
            (0..BATCH).map(off).fold(0.0, f64::max)
        };
        angles.chunks_exact(BATCH).map(of_eight).fold(0.0, f64::max)
    }

    #[test]
    fn turns_agree_with_the_c_library() {
        let dense = (-400_000..400_000).map(|k| f64::from(k) * 1.7e-5);
        assert!(largest_error(dense) < TOLERANCE);
        let far = (0..400_000).map(|k| (f64::from(k) - 2e5) * 4.999_7);
        assert!(largest_error(far) < TOLERANCE);
        // Either side of every quarter, where cancellation is strongest.
        let quarters =
            (-200_000..200_000).map(|k| f64::from(k / 4) * std::f64::consts::FRAC_PI_2 * (1.0 + f64::from(k % 4) * 2e-16));
        assert!(largest_error(quarters) < TOLERANCE);
    }

    #[test]
    fn nothing_is_turned_by_nothing() {
        let (sin, cos) = both(&[0.0; BATCH]);
        assert_eq!((sin, cos), ([0.0; BATCH], [1.0; BATCH]));
        let (sin, cos) = both(&[f64::NAN; BATCH]);
        assert!(sin.iter().chain(&cos).all(|x| x.is_nan()));
    }

    /// Vector lanes and scalar code give the same bytes.
    #[test]
    fn lanes_change_no_byte() {
        for k in 0..10_000 {
            let angles = std::array::from_fn(|i| (f64::from(k) * 8.0 + i as f64).sin() * 400.0);
            assert_eq!(sincos_batch(Scalar::new(), &angles), Arch::new().dispatch(OfAll(&angles)));
        }
    }
}
