//! Level of the expected error, scaled to what the campaign itself measures: the error at postures left out of the fit.
//!
//! Draws of physically plausible effects describe the distribution of the error over the workspace. Their level depends
//! on the assumed plausible sizes; for robots with other causes of error it is wrong by a factor in either direction.
//! At the fitted postures both are known: the error that the draws predict, and the error at left-out postures.

use crate::diagnosis::Examination;
use crate::diagnosis::cross_validation::cross_validated_positions;
use crate::diagnosis::folds::{places, random_folds};
use crate::identify::fit::{Fit, FitError};
use crate::measure::dataset::NamedDataset;
use crate::residuals::noise_floor::{chi2_chance, is_too_small};

/// Level to which the draws are scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Level {
    /// Mean length of the error at postures left out of the fit, with the instrument noise removed, m.
    pub left_out: f64,
    /// Mean length of the error at places left out as a whole, with the instrument noise removed, m; `None` with one
    /// place.
    pub places_left_out: Option<f64>,
    /// Share of the squared error at left-out postures that is not instrument noise: 0 to 1.
    pub share: f64,
    /// One-sigma of the instrument noise per axis that was removed, m.
    pub noise: f64,
    /// Standard deviation of the logarithm of the level.
    pub spread: f64,
}

/// Share of the samples that may be outliers.
const FEW: f64 = 0.05;

/// Smallest part of the mean square at left-out postures that is ascribed to the robot and not to the noise.
const LEAST_OF_ROBOT: f64 = 0.05;

/// Standard deviation of the length of a vector of three standard normal components, as a share of its mean:
/// `sqrt(3 pi / 8 - 1)`.
const SPREAD_OF_LENGTH: f64 = 0.42;

/// One-sigma of the level however many the postures, as a share of it (assumed).
const UNKNOWN: f64 = 0.05;

/// Mean length of a vector of three standard normal components: `sqrt(8 / pi)`.
pub(crate) const MEAN_LENGTH: f64 = 1.595_769_121_605_731;

impl Level {
    /// Computes the level from an examined fit.
    ///
    /// # Errors
    /// When an inner product is not finite.
    pub fn of(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Self, FitError> {
        let Examination { contexts, problem, fit, .. } = examination;
        let unit = examination.squared_units();
        let samples = contexts.len().max(1) as f64;
        let noise2 = if problem.noise_stated() && !is_noise_overstated(fit) {
            unit.iter().sum::<f64>() * examination.noise_scale.weight().powi(2) / samples
        } else {
            0.0
        };
        let is_excluded = |s: &usize| examination.model.excludes(&problem.sample_ids()[*s]);
        let judging: Vec<usize> = (0..contexts.len()).filter(|s| !is_excluded(s)).collect();
        let measured2 = |folds: &[usize]| -> Result<f64, FitError> {
            let missed = cross_validated_positions(examination, folds)?;
            let length = |s: usize| (missed[s] * unit[s] * 3.0 / contexts[s].positions as f64).sqrt();
            Ok((clipped_mean(judging.iter().map(|&s| length(s)).collect()) / MEAN_LENGTH).powi(2))
        };
        let of_robot = |measured2: f64| (measured2 - noise2).max(LEAST_OF_ROBOT * measured2);
        let by_postures = measured2(&random_folds(contexts))?;
        let left_out = MEAN_LENGTH * of_robot(by_postures).sqrt();
        let by_places = places(examination, datasets).map(|p| measured2(&p)).transpose()?;
        Ok(Level {
            left_out,
            places_left_out: by_places.map(|measured2| (MEAN_LENGTH * of_robot(measured2).sqrt()).max(left_out)),
            share: of_robot(by_postures) / by_postures.max(f64::MIN_POSITIVE),
            noise: noise2.sqrt(),
            spread: UNKNOWN + SPREAD_OF_LENGTH / (crate::diagnosis::folds::postures(contexts).count().max(1) as f64).sqrt(),
        })
    }
}

/// Mean of lengths, clipped at their 95 % quantile, or five times their median if that is larger: a few bad samples
/// must not determine the level.
pub(crate) fn clipped_mean(mut lengths: Vec<f64>) -> f64 {
    lengths.sort_by(f64::total_cmp);
    let Some(last) = lengths.len().checked_sub(1) else { return 0.0 };
    let most = lengths[(last as f64 * (1.0 - FEW)) as usize].max(5.0 * lengths[last / 2]);
    lengths.iter().map(|l| l.min(most)).sum::<f64>() / lengths.len() as f64
}

/// True if a fit is too good for the noise by which it is weighted. No noise is then removed.
pub(crate) fn is_noise_overstated(fit: &Fit) -> bool {
    is_too_small(chi2_chance(fit.chi2, fit.dof as f64))
}
