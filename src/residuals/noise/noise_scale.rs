//! NoiseScale of a diagnosis: the size of the noise, and the number of samples of one posture that count as one.

use nalgebra::Vector3;

use super::rows;
use crate::identify::fit::Fit;
use crate::identify::problem::{Problem, Use};
use crate::measure::dataset::NamedDataset;
use crate::measure::poses::Postures;
use crate::residuals::noise_floor::{NoiseFloor, NoisySample, fisher_chance};

/// Significance level at which residuals of one posture are regarded as correlated.
const ALIKE: f64 = 0.01;

/// Size of the noise in the data, and their repetition.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoiseScale {
    /// Size of the noise, and its source.
    pub noise: NoiseFloor,
    /// Number of samples that count as one (Kish's design effect): 1 if all are independent.
    pub repetition: f64,
}

impl NoiseScale {
    /// Noise as stated, with all samples independent.
    pub fn as_stated(stated: bool) -> Self {
        NoiseScale { noise: NoiseFloor::of(&[], stated), repetition: 1.0 }
    }

    /// Computes the noise_scale of a problem fitted to the rows of set `fit`.
    pub fn of(datasets: &[NamedDataset<'_>], problem: &Problem, fit: &Fit) -> Self {
        let rows = rows(problem, &fit.values);
        let replicates = Postures::replicates(datasets, |s| Use::Fit.takes(s));
        let noisy = rows.iter().zip(replicates.of_samples()).map(|(r, &group)| NoisySample {
            group,
            whitened: r.whitened,
            height: r.height,
            variance: r.variance,
        });
        let noise = NoiseFloor::of(&noisy.collect::<Vec<_>>(), problem.noise_stated());
        let postures = Postures::of(datasets, |s| Use::Fit.takes(s));
        let whitened: Vec<Vector3<f64>> = rows.iter().map(|r| r.whitened).collect();
        NoiseScale { noise, repetition: repetition(&whitened, &postures) }
    }

    /// True if the size of the noise is known.
    pub fn is_known(&self) -> bool {
        self.noise.level.is_some()
    }

    /// Factor by which whitened rows are multiplied, so that they have unit variance and samples that are not
    /// independent count less.
    pub fn weight(&self) -> f64 {
        let relative = self.noise.level.map_or(1.0, |l| l.relative);
        1.0 / (relative.max(f64::MIN_POSITIVE) * self.repetition.sqrt())
    }
}

/// Design effect `1 + (m - 1) rho`, with m samples per posture and the intraclass correlation rho of their residuals,
/// from an analysis of variance; 1 if the correlation is not significant.
fn repetition(whitened: &[Vector3<f64>], postures: &Postures) -> f64 {
    let (n, k) = (whitened.len() as f64, postures.count() as f64);
    if postures.of_samples().len() != whitened.len() || n < k + 2.0 || k < 2.0 {
        return 1.0;
    }
    let (mut within, mut between, mut sizes) = (0.0, 0.0, 0.0);
    let all: f64 = whitened.iter().map(|w| w.norm_squared()).sum();
    for members in postures.members() {
        let count = members.len() as f64;
        let sum: Vector3<f64> = members.iter().map(|&i| whitened[i]).sum();
        between += sum.norm_squared() / count;
        sizes += count * count;
    }
    within += all - between;
    let (above, below) = (3.0 * k, 3.0 * (n - k));
    let (between, within) = (between / above, (within / below).max(f64::MIN_POSITIVE));
    if fisher_chance(between / within, above, below).is_none_or(|p| p > ALIKE) {
        return 1.0;
    }
    let each = (n - sizes / n) / (k - 1.0);
    let alike = (between - within) / (between + (each - 1.0) * within);
    (1.0 + (sizes / n - 1.0) * alike.clamp(0.0, 1.0)).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_count_once_and_independent_rows_all() {
        let joints: Vec<[f64; 1]> = (0..120).map(|i| [f64::from(i / 3)]).collect();
        let joints: Vec<&[f64]> = joints.iter().map(|q| &q[..]).collect();
        let postures = Postures::of_joints(&joints, &[0; 120]);
        let of = |i: usize| Vector3::from_fn(|k, _| (((i * 7919 + k * 104_729) % 1009) as f64 / 1009.0 - 0.5) * 3.46);
        let copies: Vec<Vector3<f64>> = (0..120).map(|i| of(i / 3)).collect();
        assert!((repetition(&copies, &postures) - 3.0).abs() < 1e-6);
        let own: Vec<Vector3<f64>> = (0..120).map(of).collect();
        assert!(repetition(&own, &postures) < 1.2);
    }
}
