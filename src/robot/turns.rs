//! Sines and cosines of all joints of an arm at once.
//!
//! Written so that a compiler puts four or eight angles into the lanes of a vector: no branch, no table. Nothing is contracted into fused
//! operations, so that the bytes are the same whatever the lanes.

use pulp::Arch;

/// Angles that are turned at once; most arms have six or seven joints.
pub(super) const LANES: usize = 8;

/// Beyond this (rad), some 160,000 turns, the multiples of a right angle below are not exact, and the C library is asked.
const LARGEST: f64 = 1e6;

/// A right angle in three parts, the first two of 33 bits: their products with whole numbers below 2^20 are exact (Cody & Waite 1980;
/// the parts are those of FDLIBM's `e_rem_pio2.c`, Sun 1993).
const RIGHT: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

/// Sine less its argument over its cube, and cosine less `1 - z / 2` over `z²`, as polynomials of `z = r²`, `|r| <= pi / 4`, to 2^-58
/// (FDLIBM's `k_sin.c` and `k_cos.c`, Sun 1993).
const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// Added to a number below 2^51, it leaves no room for a fraction: the sum is rounded to a whole number, whose last bits are its own.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// Sines and cosines of these angles (rad), each to 3e-16 of the true number, absolute.
#[inline]
pub(super) fn sin_cos(angles: &[f64; LANES], sin: &mut [f64; LANES], cos: &mut [f64; LANES]) {
    Arch::new().dispatch(|| lanes(angles, sin, cos));
    if !angles.iter().fold(true, |all, angle| all & (angle.abs() <= LARGEST)) {
        far_turns(angles, sin, cos);
    }
}

#[cold]
fn far_turns(angles: &[f64; LANES], sin: &mut [f64; LANES], cos: &mut [f64; LANES]) {
    for ((sin, cos), angle) in sin.iter_mut().zip(cos).zip(angles).filter(|(_, angle)| angle.abs() > LARGEST) {
        (*sin, *cos) = angle.sin_cos();
    }
}

#[inline(always)]
fn lanes(angles: &[f64; LANES], sin: &mut [f64; LANES], cos: &mut [f64; LANES]) {
    for i in 0..LANES {
        let counted = angles[i] * std::f64::consts::FRAC_2_PI + WHOLE;
        let quarters = counted.to_bits();
        let whole = counted - WHOLE;
        let r = ((angles[i] - whole * RIGHT[0]) - whole * RIGHT[1]) - whole * RIGHT[2];
        let z = r * r;
        let [s0, s1, s2, s3, s4, s5] = SINE;
        let s = r + z * r * (s0 + z * (s1 + z * (s2 + z * (s3 + z * (s4 + z * s5)))));
        let [c0, c1, c2, c3, c4, c5] = COSINE;
        let high = 1.0 - 0.5 * z;
        let c = high + (((1.0 - high) - 0.5 * z) + z * z * (c0 + z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * c5))))));
        // Every odd quarter swaps the two, and two quarters turn the sign.
        let swap = 0u64.wrapping_sub(quarters & 1);
        let (s, c) = (s.to_bits(), c.to_bits());
        let crossed = (s ^ c) & swap;
        sin[i] = f64::from_bits((s ^ crossed) ^ ((quarters & 2) << 62));
        cos[i] = f64::from_bits((c ^ crossed) ^ ((quarters.wrapping_add(1) & 2) << 62));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both(angles: &[f64; LANES]) -> ([f64; LANES], [f64; LANES]) {
        let (mut sin, mut cos) = ([0.0; LANES], [0.0; LANES]);
        sin_cos(angles, &mut sin, &mut cos);
        (sin, cos)
    }

    /// One rounding of each of sine and cosine near one, and half of one of the C library, which is right to 0.55 of it.
    const TOLERANCE: f64 = 3e-16;

    fn largest_error(angles: impl Iterator<Item = f64>) -> f64 {
        let angles: Vec<f64> = angles.collect();
        let of_eight = |eight: &[f64]| {
            let (sin, cos) = both(eight.try_into().unwrap());
            let off = |k: usize| (sin[k] - eight[k].sin()).abs().max((cos[k] - eight[k].cos()).abs());
            (0..LANES).map(off).fold(0.0, f64::max)
        };
        angles.chunks_exact(LANES).map(of_eight).fold(0.0, f64::max)
    }

    #[test]
    fn turns_agree_with_the_c_library() {
        let dense = (-400_000..400_000).map(|k| f64::from(k) * 1.7e-5);
        assert!(largest_error(dense) < TOLERANCE);
        let far = (0..400_000).map(|k| (f64::from(k) - 2e5) * 4.999_7);
        assert!(largest_error(far) < TOLERANCE);
        // Either side of every quarter, where most is cancelled.
        let quarters =
            (-200_000..200_000).map(|k| f64::from(k / 4) * std::f64::consts::FRAC_PI_2 * (1.0 + f64::from(k % 4) * 2e-16));
        assert!(largest_error(quarters) < TOLERANCE);
        let farther = (0..800).map(|k| 1e6 * 1.1_f64.powi(k % 300) * if k % 2 == 0 { 1.0 } else { -1.0 });
        assert_eq!(largest_error(farther), 0.0);
    }

    #[test]
    fn nothing_is_turned_by_nothing() {
        let (sin, cos) = both(&[0.0; LANES]);
        assert_eq!((sin, cos), ([0.0; LANES], [1.0; LANES]));
        let (sin, cos) = both(&[f64::NAN; LANES]);
        assert!(sin.iter().chain(&cos).all(|x| x.is_nan()));
    }

    /// The lanes that the processor has, and none, give the same bytes.
    #[test]
    fn lanes_change_no_byte() {
        for k in 0..10_000 {
            let angles = std::array::from_fn(|i| (f64::from(k) * 8.0 + i as f64).sin() * 400.0);
            let (mut sin, mut cos) = ([0.0; LANES], [0.0; LANES]);
            lanes(&angles, &mut sin, &mut cos);
            assert_eq!((sin, cos), both(&angles));
        }
    }
}
