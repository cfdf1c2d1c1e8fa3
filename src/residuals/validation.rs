//! Position errors of a calibrated robot: the figures of the paper's Table 9 and the bars of its Figure 9.

use nalgebra::Vector3;

use crate::identify::Prediction;
use crate::math::quantile;

/// Statistics of position errors over poses, m.
///
/// ```
/// use calibench::identify::Prediction;
/// use calibench::nalgebra::Vector3;
/// use calibench::residuals::Validation;
///
/// // Errors of 1, 2 and 6 m.
/// let prediction = Prediction {
///     residuals: [1.0, 2.0, 6.0].map(|error| Vector3::new(0.0, error, 0.0)).to_vec(),
/// #     sample_ids: Vec::new(),
/// #     orientations: Vec::new(),
/// #     refitted: Vec::new(),
/// #     from_fit_rows: Vec::new(),
///     // ...
/// };
/// let errors = Validation::of(&prediction).ok_or("three residuals")?;
/// assert_eq!((errors.mean, errors.max, errors.quantiles[2]), (3.0, 6.0, 2.0));
/// assert!((errors.std - 7f64.sqrt()).abs() < 1e-15);
/// assert_eq!(errors.histogram(3).iter().map(|bar| bar.count).collect::<Vec<_>>(), [1, 1, 1]);
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Validation {
    /// Number of poses.
    pub samples: usize,
    /// Mean of the errors.
    pub mean: f64,
    /// Largest error.
    pub max: f64,
    /// Standard deviation of the errors about their mean (n - 1); zero for one pose.
    pub std: f64,
    /// Root mean square of the errors.
    pub rms: f64,
    /// Errors below which 5, 25, 50, 75 and 95 % of the poses lie.
    pub quantiles: [f64; 5],
    /// All errors, ascending.
    pub errors: Vec<f64>,
    /// Errors of the orientations, if some were measured.
    pub orientation: Option<OrientationErrors>,
    /// Set-up parameters that were fitted to the judged poses themselves.
    pub refitted: Vec<String>,
    /// Set-up parameters that were fitted to other rows of these data.
    pub from_fit_rows: Vec<String>,
}

/// Statistics of orientation errors over poses: angles of rotation, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrientationErrors {
    /// Number of poses with an orientation.
    pub samples: usize,
    /// Mean of the errors.
    pub mean: f64,
    /// Largest error.
    pub max: f64,
    /// Standard deviation of the errors about their mean (n - 1); zero for one pose.
    pub std: f64,
    /// Root mean square of the errors.
    pub rms: f64,
}

impl OrientationErrors {
    /// Computes the statistics of residuals, rotation vectors; `None` if none were measured.
    pub fn of(residuals: &[Option<Vector3<f64>>]) -> Option<Self> {
        let angles: Vec<f64> = residuals.iter().flatten().map(|r| r.norm()).collect();
        let [mean, std, rms] = moments(&angles)?;
        Some(OrientationErrors { samples: angles.len(), mean, max: angles.iter().copied().fold(0.0, f64::max), std, rms })
    }
}

/// Mean, standard deviation and root mean square; `None` of nothing.
fn moments(errors: &[f64]) -> Option<[f64; 3]> {
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let squares = errors.iter().map(|e| e * e).sum::<f64>() / n;
    let about_mean = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>();
    let std = if errors.len() > 1 { (about_mean / (n - 1.0)).sqrt() } else { 0.0 };
    (!errors.is_empty()).then(|| [mean, std, squares.sqrt()])
}

/// One bar of a histogram.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistogramBin {
    /// Lower edge, m.
    pub from: f64,
    /// Upper edge, m.
    pub to: f64,
    /// Number of poses in it.
    pub count: usize,
}

/// The quantiles reported.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.50, 0.75, 0.95];

impl Validation {
    /// Number of poses whose error is at most `tolerance`, m.
    #[must_use]
    pub fn within(&self, tolerance: f64) -> usize {
        self.errors.iter().filter(|error| **error <= tolerance).count()
    }

    /// Computes the statistics of predictions; `None` if there are none.
    pub fn of(prediction: &Prediction) -> Option<Self> {
        let errors: Vec<f64> = prediction.residuals.iter().map(|r| r.norm()).collect();
        Some(Validation {
            orientation: OrientationErrors::of(&prediction.orientations),
            refitted: prediction.refitted.clone(),
            from_fit_rows: prediction.from_fit_rows.clone(),
            ..Validation::of_lengths(&errors)?
        })
    }

    /// The statistics of position errors, m, in any order; `None` of nothing.
    pub(crate) fn of_lengths(errors: &[f64]) -> Option<Self> {
        let mut errors = errors.to_vec();
        errors.sort_by(f64::total_cmp);
        let [mean, std, rms] = moments(&errors)?;
        Some(Validation {
            samples: errors.len(),
            mean,
            max: errors[errors.len() - 1],
            std,
            rms,
            quantiles: QUANTILES.map(|p| quantile(&errors, p)),
            errors,
            orientation: None,
            refitted: Vec::new(),
            from_fit_rows: Vec::new(),
        })
    }

    /// Sorts the errors into equal bins from zero to the largest error.
    pub fn histogram(&self, bins: usize) -> Vec<HistogramBin> {
        let width = self.max.max(f64::MIN_POSITIVE) / bins.max(1) as f64;
        (0..bins.max(1))
            .map(|k| {
                let (from, to) = (k as f64 * width, (k + 1) as f64 * width);
                let last = k + 1 == bins.max(1);
                let count = self.errors.iter().filter(|&&e| e >= from && (e < to || last)).count();
                HistogramBin { from, to, count }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn statistics_of_errors_known_by_heart() {
        let residuals = [1.0, 2.0, 3.0, 4.0, 10.0].map(|x| Vector3::new(x, 0.0, 0.0)).to_vec();
        let prediction = Prediction {
            sample_ids: Vec::new(),
            residuals,
            orientations: Vec::new(),
            refitted: Vec::new(),
            from_fit_rows: Vec::new(),
        };
        let v = Validation::of(&prediction).expect("there are errors");
        assert_eq!((v.samples, v.mean, v.max, v.quantiles[2]), (5, 4.0, 10.0, 3.0));
        assert!((v.std - 12.5f64.sqrt()).abs() < 1e-12);
        assert!((v.rms - 26f64.sqrt()).abs() < 1e-12);
        let bars: Vec<usize> = v.histogram(5).iter().map(|b| b.count).collect();
        assert_eq!(bars, [1, 2, 1, 0, 1]);
    }
}
