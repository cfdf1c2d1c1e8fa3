//! Expected length of a normally distributed vector.

use nalgebra::Matrix3;

/// Expected length of a normal vector of mean zero: `2 sqrt(2 / pi) R_G(l1, l2, l3)`, with the eigenvalues l of its
/// covariance S. Carlson's R_G is the mean of `sqrt(n^T S n)` over all directions n; the factor is the mean length of a
/// vector of three standard normal numbers.
pub(super) fn expected_length(covariance: &Matrix3<f64>) -> f64 {
    let scale = covariance.trace();
    if scale <= 0.0 {
        return 0.0;
    }
    let mut unit = (covariance / scale).symmetric_eigenvalues().map(|l| l.max(0.0));
    unit.as_mut_slice().sort_by(f64::total_cmp);
    2.0 * (2.0 * scale / std::f64::consts::PI).sqrt() * carlson_g(unit.x, unit.z, unit.y)
}

/// Carlson's symmetric elliptic integral of the second kind, `R_G(x, y, z)`, with z between x and y to avoid
/// cancellation. Computed by duplication from `2 R_G = z R_F - (x - z)(y - z) R_D / 3 + sqrt(x y / z)` (Carlson,
/// Numerical Algorithms 10 (1995) 13; both series to fifth order).
fn carlson_g(x: f64, y: f64, z: f64) -> f64 {
    // With two zero arguments R_F diverges, but R_G is finite: sqrt(y) / 2.
    if z <= 1e-30 * x.max(y) {
        return 0.5 * x.max(y).sqrt();
    }
    let (mut a, mut b, mut c) = (x, y, z);
    let (mut part, mut sum) = (1.0, 0.0);
    // The first omitted term is of sixth order in the spread, below 1e-16 of the result; each iteration reduces the
    // spread fourfold.
    loop {
        let (mean_f, mean_d) = ((a + b + c) / 3.0, (a + b + 3.0 * c) / 5.0);
        if (c - a).abs().max((c - b).abs()) < 1e-3 * mean_f {
            let series_f = {
                let (u, v) = (1.0 - a / mean_f, 1.0 - b / mean_f);
                let w = -(u + v);
                let (e2, e3) = (u * v - w * w, u * v * w);
                (1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0) / mean_f.sqrt()
            };
            let series_d = {
                let (u, v) = (1.0 - a / mean_d, 1.0 - b / mean_d);
                let w = -(u + v) / 3.0;
                let (uv, w2) = (u * v, w * w);
                let e2 = uv - 6.0 * w2;
                let e3 = (3.0 * uv - 8.0 * w2) * w;
                let e4 = 3.0 * (uv - w2) * w2;
                let e5 = uv * w2 * w;
                let series = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0 - 3.0 * e4 / 22.0 - 9.0 * e2 * e3 / 52.0;
                part * (series + 3.0 * e5 / 26.0) / (mean_d * mean_d.sqrt()) + 3.0 * sum
            };
            return 0.5 * (z * series_f - (x - z) * (y - z) * series_d / 3.0 + (x * y / z).sqrt());
        }
        let (ra, rb, rc) = (a.sqrt(), b.sqrt(), c.sqrt());
        let lambda = ra * rb + rb * rc + rc * ra;
        sum += part / (rc * (c + lambda));
        part *= 0.25;
        (a, b, c) = (0.25 * (a + lambda), 0.25 * (b + lambda), 0.25 * (c + lambda));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_of_normal_vectors() {
        let one = Matrix3::from_diagonal(&[1.0, 0.0, 0.0].into());
        let three = Matrix3::identity() * 4.0;
        let pi = std::f64::consts::PI;
        assert!((expected_length(&one) - (2.0 / pi).sqrt()).abs() < 1e-15);
        assert!((expected_length(&three) - 2.0 * (8.0 / pi).sqrt()).abs() < 1e-14);
        let two = Matrix3::from_diagonal(&[9.0, 0.0, 9.0].into());
        assert!((expected_length(&two) - 3.0 * (pi / 2.0).sqrt()).abs() < 1e-14);
        // Carlson's own check values.
        assert!((carlson_g(0.0, 16.0, 16.0) - pi).abs() < 1e-14);
        assert!((carlson_g(2.0, 4.0, 3.0) - 1.725_503_028_069_2).abs() < 1e-12);
        assert!((carlson_g(0.0, 4.0, 0.0796) - 1.028_475_809_028_8).abs() < 1e-12);
    }

    /// From `sqrt(x) = 1/(2 sqrt(pi)) integral (1 - exp(-x t)) t^(-3/2) dt`, where the mean of `exp(-x t)` is
    /// `det(1 + 2 t S)^(-1/2)`; trapezoidal rule in `ln t`, with a truncation error of 1e-10.
    #[test]
    fn lengths_agree_with_their_integral() {
        for lambda in [[1.0, 0.3, 0.02], [1.0, 1e-6, 1e-9], [1.0, 0.9, 0.8]] {
            /// Step of the integral, in the logarithm of its variable.
            const STEP: f64 = 0.25;
            let at = |k: i32| {
                let u = STEP * f64::from(k);
                let log: f64 = lambda.iter().map(|l| (2.0 * u.exp() * l).ln_1p()).sum();
                -(-0.5 * log).exp_m1() * (-0.5 * u).exp()
            };
            let integral = (-180..=180).map(at).sum::<f64>() * STEP / (2.0 * std::f64::consts::PI.sqrt());
            let turned = nalgebra::Rotation3::from_euler_angles(0.3, -1.0, 2.0);
            let covariance = turned * Matrix3::from_diagonal(&lambda.into()) * turned.inverse();
            assert!((expected_length(&covariance) - integral).abs() < 1e-8, "{lambda:?}");
        }
    }
}
