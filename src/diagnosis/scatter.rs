//! Scatter of the data.

use super::Examination;
use crate::identify::problem::{Problem, Use};
use crate::measure::dataset::{NamedDataset, Sample};
use crate::measure::poses::Postures;
use crate::residuals::noise::{JointSteps, RepeatScatter, SerialCorrelation, Suspect, rows};
use crate::residuals::noise_floor::{FEWEST_REPLICATES, NoiseFloor, NoiseSource, chi2_chance, fisher_chance};
use crate::residuals::views::SeenSample;

/// Scatter of the data: noise, suspects, repeats, serial correlation.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// The noise, with its source.
    pub noise: NoiseFloor,
    /// Probability of a larger chi-square under that noise; `None` if it is unknown, or if it is known from replicates
    /// and no degrees of freedom remain beyond those of the replicates.
    pub lack_of_fit_p: Option<f64>,
    /// Factor by which the noise is larger than stated; `None` if it is not.
    pub larger_than_stated: Option<f64>,
    /// Number of postures.
    pub postures: usize,
    /// Number of samples that count as one, on average (Kish's design effect).
    pub repetition: f64,
    /// Samples that disagree with all others.
    pub suspects: Vec<Suspect>,
    /// Correlation of the residuals in the order of measurement.
    pub serial: SerialCorrelation,
    /// Resolution to which the joint angles were rounded.
    pub joint_steps: Option<JointSteps>,
    /// Samples in a row with one posture and one target, which are too few to tell the noise: one seating recorded twice.
    pub seatings: Vec<[String; 2]>,
    /// Variance components of the scatter of repeats.
    pub repeats: Option<RepeatScatter>,
}

impl Scatter {
    pub(crate) fn of(datasets: &[NamedDataset<'_>], examination: &Examination) -> Self {
        let (problem, fit) = (&examination.problem, &examination.fit);
        let noise = examination.noise_scale.noise.clone();
        let postures = Postures::of(datasets, |s| Use::Fit.takes(s));
        let rows = rows(problem, &fit.values);
        let repeats = noise.replicates.is_some().then(|| {
            let samples: Vec<&Sample> =
                datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s))).collect();
            RepeatScatter::of(&SeenSample::all(problem, &fit.values, &samples, datasets))
        });
        Scatter {
            seatings: seatings(datasets, problem, &noise),
            lack_of_fit_p: lack_of_fit(&noise, fit.chi2, fit.dof as f64),
            larger_than_stated: noise.larger_than_stated(),
            postures: postures.count(),
            repetition: examination.noise_scale.repetition,
            suspects: Vec::new(),
            serial: SerialCorrelation::of(&rows, postures.of_samples()),
            joint_steps: JointSteps::of(datasets, problem, &fit.values),
            repeats: repeats.flatten(),
            noise,
        }
    }

    /// Variance of the residuals due to noise alone, in units of the variance by which they were weighted; `None` if
    /// the noise is unknown.
    pub(crate) fn unit(&self) -> Option<f64> {
        let relative = match (self.noise.source, self.larger_than_stated) {
            (NoiseSource::Unknown, _) => return None,
            (_, Some(factor)) => factor,
            _ => self.noise.level.map_or(1.0, |l| l.relative),
        };
        Some(relative * relative)
    }
}

/// Pairs of samples in a row that are replicates, where the replicates are too few to count and nobody says that they are some.
fn seatings(datasets: &[NamedDataset<'_>], problem: &Problem, noise: &NoiseFloor) -> Vec<[String; 2]> {
    if noise.replicates.is_none_or(|r| r.dof >= FEWEST_REPLICATES) {
        return Vec::new();
    }
    let takes = |s: &Sample| Use::Fit.takes(s);
    let groups = Postures::replicates(datasets, takes);
    let is_said = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| takes(s)).map(|s| s.repeat.is_some()));
    let rows: Vec<_> = groups.of_samples().iter().zip(is_said).zip(problem.sample_ids()).collect();
    let pairs = rows.windows(2).filter(|pair| pair[0].0.0 == pair[1].0.0 && !pair[0].0.1);
    pairs.map(|pair| [pair[0].1.clone(), pair[1].1.clone()]).collect()
}

/// Probability of a larger chi-square: under the stated noise, or by Fisher's F test against the replicates.
fn lack_of_fit(noise: &NoiseFloor, chi2: f64, dof: f64) -> Option<f64> {
    match (noise.source, noise.replicates) {
        (NoiseSource::Unknown, _) => None,
        (NoiseSource::Replicates, Some(pure)) => {
            let above = dof - pure.dof;
            if above < 1.0 {
                return None;
            }
            let ratio = ((chi2 - pure.squares).max(0.0) / above) / (pure.squares / pure.dof);
            Some(fisher_chance(ratio, above, pure.dof).unwrap_or(f64::NAN))
        }
        _ => Some(chi2_chance(chi2, dof.max(1.0)).unwrap_or(f64::NAN)),
    }
}
