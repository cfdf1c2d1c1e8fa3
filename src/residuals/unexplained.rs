//! Part of a fit's residual that noise explains, and the part that it does not.

/// The part of a noise that a fit leaves in its residual, m: `noise` is its 3-D rms in m, `dof` the degrees of freedom, `rows` the
/// number of scalar residuals. The parameters absorb the rest.
///
/// ```
/// assert_eq!(calibench::residuals::noise_left(2.0, 25.0, 100), 1.0);
/// ```
pub fn noise_left(noise: f64, dof: f64, rows: usize) -> f64 {
    noise * (dof / rows.max(1) as f64).clamp(0.0, 1.0).sqrt()
}

/// The residual that noise does not explain, m: `rms` without the `noise` that a fit leaves in it, in quadrature (both m, 3-D);
/// zero where noise alone would leave as much.
///
/// ```
/// assert_eq!(calibench::residuals::unexplained(5.0, 3.0), 4.0);
/// assert_eq!(calibench::residuals::unexplained(3.0, 5.0), 0.0);
/// ```
pub fn unexplained(rms: f64, noise: f64) -> f64 {
    mean_square_beyond(rms, noise).max(0.0).sqrt()
}

/// The difference of the mean squares, m²; negative by chance where there is noise only.
pub(crate) fn mean_square_beyond(rms: f64, noise: f64) -> f64 {
    rms * rms - noise * noise
}
