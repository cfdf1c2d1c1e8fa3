//! The error to expect at given poses, by what the campaign itself measures as far from its postures as these.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::Alone;
use super::campaign::{Campaign, There};
use super::divisions::{Measured, measure};
use super::expected::{Expected, leverage};
use super::rows::Groups;
use crate::diagnosis::Examination;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::prediction::chance::normal;
use crate::prediction::expected_error::{Banded, WorkspaceError, expected_errors};
use crate::prediction::level::MEAN_LENGTH;
use crate::prediction::poses::{SEED, WorkspacePoses, at_poses, seen, undetermined};

/// Standard deviations from the median to the 90 % quantile of a normal distribution.
const TO_90: f64 = 1.281_551_565_544_6;

/// Least share of a squared level that is not noise: noise is not known better.
const LEAST_SHARE: f64 = 0.05;

/// Fewest postures by which the level is measured at a distance; of fewer, nothing is far from the others and enough remains
/// (decision 0045).
const LEAST_POSTURES: usize = 40;

/// Draws by which the largest error is found from the mean one.
const DRAWS: usize = 100;

/// The error to expect without the noise of the instrument, m.
struct Level {
    error: f64,
    spread: f64,
    at_least: bool,
}

impl Level {
    fn of(expected: &Expected, noise: f64) -> Self {
        let square = expected.level().powi(2);
        let error = (square - (MEAN_LENGTH * noise).powi(2)).max(LEAST_SHARE * square).sqrt();
        Level { error, spread: expected.spread, at_least: expected.is_refused() }
    }

    /// The level times a factor, with its band.
    fn banded(&self, factor: f64) -> Banded {
        let expected = factor * self.error;
        let by = (TO_90 * self.spread).exp();
        Banded { expected, low: expected / by, high: expected * by }
    }
}

/// Poses at which an error is expected, as samples, and what the campaign's columns do there.
pub(super) struct Poses {
    cell: Dataset,
    /// For each pose, true if it lies inside the ranges of the campaign.
    seen: Vec<bool>,
    pub at: There,
}

impl Poses {
    /// `None` without poses, or if the data do not determine the set-up itself.
    pub fn of(
        datasets: &[NamedDataset<'_>],
        examination: &Examination,
        campaign: &Campaign,
        poses: &[Vec<f64>],
    ) -> Result<Option<Self>, IdentifyError> {
        let Some(first) = datasets.first().filter(|_| !poses.is_empty() && undetermined(examination).is_empty()) else {
            return Ok(None);
        };
        let cell = at_poses(first.dataset, examination, poses, &mut ChaCha8Rng::seed_from_u64(SEED));
        Ok(Some(Poses { seen: seen(examination, &cell, poses), at: campaign.there(&cell, examination)?, cell }))
    }
}

/// What the level at any of the poses is found from.
pub(super) struct Forecast<'a> {
    pub divisions: &'a [Measured],
    /// Which error of the divisions: without the field (0) or with it (1).
    pub which: usize,
    /// Variances of the predictions of the model alone, m², which say how far the poses are, and of its noise.
    pub far: &'a [f64],
    pub far_noise2: f64,
    /// The same of the model that is judged.
    pub own: &'a [f64],
    pub own_noise2: f64,
    /// Noise of the instrument per axis, m; zero if unknown.
    pub noise: f64,
    /// How the error is spread over the poses, in any unit.
    pub each: Vec<f64>,
    /// Largest error over the mean one.
    pub largest: f64,
}

impl Forecast<'_> {
    fn level(&self, of: &[usize]) -> Option<Level> {
        let [far, own] = [self.far, self.own].map(|all| of.iter().map(|&p| all[p]).collect::<Vec<f64>>());
        let far = leverage(&far, self.far_noise2);
        (!of.is_empty()).then(|| Level::of(&Expected::of(self.divisions, self.which, far, &own, self.own_noise2), self.noise))
    }

    /// The error over these poses; `None` without poses.
    pub fn over(&self, there: &Poses, poses: &WorkspacePoses) -> Option<WorkspaceError> {
        let places = |which: fn(bool) -> bool| (0..poses.q.len()).filter(|&p| which(there.seen[p])).collect::<Vec<usize>>();
        let all = self.level(&places(|_| true))?;
        let mean = self.each.iter().sum::<f64>() / self.each.len().max(1) as f64;
        let of_pose = |p: usize| all.error * self.each[p] / mean.max(f64::MIN_POSITIVE);
        Some(WorkspaceError {
            at: poses.source,
            mean: all.banded(1.0),
            max: all.banded(self.largest),
            ranges_seen: self.level(&places(|seen| seen)).map(|level| level.banded(1.0)),
            elsewhere: self.level(&places(|seen| !seen)).map(|level| level.banded(1.0)),
            poses: expected_errors(&there.cell, &poses.q, of_pose),
            noise: self.noise,
            at_least: all.at_least,
        })
    }
}

/// The error to expect of an examined model alone at these poses of the first set-up; `None` if the campaign is
/// too small to measure it at a distance, or its fit did not converge.
///
/// # Errors
/// When the postures do not go with the examined fit.
pub(crate) fn expected_of_model(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    poses: &WorkspacePoses,
) -> Result<Option<WorkspaceError>, IdentifyError> {
    if crate::diagnosis::folds::postures(&examination.contexts).count() < LEAST_POSTURES {
        return Ok(None);
    }
    let Ok(Alone { campaign, rows, model, divided }) = Alone::of(datasets, examination) else { return Ok(None) };
    let Some(there) = Poses::of(datasets, examination, &campaign, &poses.q)? else { return Ok(None) };
    let variances = model.variances(&rows, &Groups::default(), &there.at.rows.of_model());
    let divisions = measure(&divided, &campaign, [&model, &model]);
    let noise2 = model.sizes.noise * campaign.noise_m.powi(2);
    let noise = if campaign.stated.is_some() { campaign.noise_m } else { 0.0 };
    // What the model cannot explain beyond the noise of the instrument may be anywhere.
    let beyond = 3.0 * (noise2 - noise * noise).max(0.0);
    let each: Vec<f64> = variances.iter().map(|variance| (variance + beyond).sqrt()).collect();
    let forecast = Forecast {
        divisions: &divisions,
        which: 0,
        far: &variances,
        far_noise2: noise2,
        own: &variances,
        own_noise2: noise2,
        noise,
        largest: largest(&each),
        each,
    };
    Ok(forecast.over(&there, poses))
}

/// Largest length over the mean one of vectors whose components have standard deviations in proportion to `each`.
fn largest(each: &[f64]) -> f64 {
    let random = &mut ChaCha8Rng::seed_from_u64(SEED);
    let mut draw = || {
        let lengths: Vec<f64> =
            each.iter().map(|sd| sd * [0; 3].map(|_| normal(random)).iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        lengths.iter().copied().fold(0.0, f64::max) / mean.max(f64::MIN_POSITIVE)
    };
    (0..DRAWS).map(|_| draw()).sum::<f64>() / DRAWS as f64
}
