//! Many residuals in one figure: root mean square, quantiles.

use nalgebra::Vector3;

/// Median of chi-square with one, two, three degrees of freedom.
pub(crate) const CHI2_MEDIAN: [f64; 3] = [0.4549, 1.3863, 2.3660];

/// Root mean square of the lengths of vectors, in their unit; zero of none.
///
/// ```
/// use calibench::nalgebra::Vector3;
///
/// let errors = [Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 7.0, 0.0)];
/// assert_eq!(calibench::math::rms(&errors), 5.0);
/// ```
pub fn rms(vectors: &[Vector3<f64>]) -> f64 {
    (vectors.iter().map(Vector3::norm_squared).sum::<f64>() / vectors.len().max(1) as f64).sqrt()
}

/// The value of which the rank comes nearest to this share of all ranks, 0 for the least and 1 for the largest; NaN of none.
///
/// ```
/// use calibench::math::nearest_rank;
///
/// assert_eq!(nearest_rank(vec![3.0, 1.0, 2.0, 10.0], 0.5), 3.0);
/// assert!(nearest_rank(Vec::new(), 0.5).is_nan());
/// ```
pub fn nearest_rank(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((last as f64 * share).round() as usize).copied().unwrap_or(f64::NAN)
}

/// Quantile of ascending values, of which there is at least one, by linear interpolation between order statistics (Hyndman & Fan
/// 1996, type 7).
pub(crate) fn quantile(ascending: &[f64], share: f64) -> f64 {
    let at = share * (ascending.len() - 1) as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    ascending[low] + (at - low as f64) * (ascending[high] - ascending[low])
}
