//! Lack of fit: the residual beyond the noise.

use crate::residuals::noise_floor::mean_square_beyond;
use crate::residuals::noise_floor::{NoiseFloor, NoiseSource, fisher_chance};
use crate::residuals::views::Whitened;
use crate::residuals::{noise_left, unexplained};

/// Two-sided 95 % quantile of the normal distribution.
const TWO_SIDED_95: f64 = 1.959_964;

/// Residual compared with the noise: if the noise is known from replicates, by the classic test of lack of fit (Draper
/// and Smith 1998, 2.1); if it is stated, by chi-square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LackOfFit {
    /// Degrees of freedom of the residuals: scalar measurements minus free parameters.
    pub dof: f64,
    /// Residual sum of squares in units of the noise squared, per degree of freedom; `None` if the noise is unknown or
    /// no degree of freedom remains.
    pub chi2_per_dof: Option<f64>,
    /// Probability that noise alone leaves a larger residual; `None` if the noise is unknown, or if it is known from
    /// replicates and no degrees of freedom remain beyond those of the replicates.
    pub p: Option<f64>,
    /// Part of the residual due to noise, 3-D rms, m: `noise sqrt(dof / numbers)` with the number of scalar
    /// measurements, less than the noise itself after a fit; `None` if the noise is unknown.
    pub noise_left: Option<f64>,
    /// Unexplained part of the residual, 3-D rms, m: root of rms² minus `noise_left`²; zero if noise explains all,
    /// `None` if the noise is unknown.
    pub unexplained: Option<f64>,
    /// 95 % confidence interval of `unexplained`, m, over repetitions of the noise with the same unexplained part.
    pub interval: Option<[f64; 2]>,
    /// True if the residual is smaller than the stated noise would leave: it is then too large to judge
    /// anything by.
    pub noise_overstated: bool,
}

impl LackOfFit {
    pub(super) fn of(noise: &NoiseFloor, rms: f64, whitened: &Whitened, numbers: usize) -> Self {
        let Whitened { squares, dof, least_dof, .. } = *whitened;
        let nothing = LackOfFit {
            dof,
            chi2_per_dof: None,
            p: None,
            noise_left: None,
            unexplained: None,
            interval: None,
            noise_overstated: false,
        };
        let Some(level) = noise.level else { return nothing };
        let relative = squares / (level.relative * level.relative);
        let p = match (noise.source, noise.replicates) {
            (NoiseSource::Replicates, Some(pure)) if dof > pure.dof => {
                let above = dof - pure.dof;
                let ratio = ((squares - pure.squares).max(0.0) / above) / (pure.squares / pure.dof);
                fisher_chance(ratio, above, pure.dof)
            }
            (NoiseSource::Replicates, _) => None,
            _ => noise.chance_of(squares, dof),
        };
        let noise_left = noise_left(level.rms, dof, numbers);
        let beyond = mean_square_beyond(rms, noise_left);
        // rms² is noise²/numbers times a non-central chi-square with variance 2 (dof + 2 lambda); its non-centrality
        // lambda stands for the unexplained part. Noise known from replicates adds its own variance.
        let per_number = level.rms * level.rms / numbers.max(1) as f64;
        let lambda = if per_number > 0.0 { beyond.max(0.0) / per_number } else { 0.0 };
        let own = per_number * (2.0 * (dof + 2.0 * lambda)).sqrt();
        let of_noise = level.dof.map_or(0.0, |known| noise_left * noise_left * (2.0 / known).sqrt());
        let reach = TWO_SIDED_95 * own.hypot(of_noise);
        LackOfFit {
            dof,
            chi2_per_dof: (dof > 0.0).then_some(relative / dof),
            p,
            noise_left: Some(noise_left),
            unexplained: Some(unexplained(rms, noise_left)),
            interval: Some([-reach, reach].map(|by| (beyond + by).max(0.0).sqrt())),
            // Parameters with a prior absorb noise too, however wide the prior, so the smaller number of degrees of
            // freedom counts.
            noise_overstated: noise.is_overstated(noise.chance_of(squares, least_dof.min(dof))),
        }
    }
}
