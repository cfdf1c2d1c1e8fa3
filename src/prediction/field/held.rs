//! A model that holds a field, judged: what it predicts of left-out postures is found without them.

use nalgebra::DVectorView;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::conditional::Conditional;
use super::expected::{Expected, leverage};
use super::rows::Groups;
use super::{Field, FieldError, Worth, digests, mean_length};
use crate::diagnosis::Examination;
use crate::effects::EffectId;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::prediction::level::MEAN_LENGTH;
use crate::prediction::workspace::{Banded, SEED, WorkspaceError, at_poses, expected_errors, seen, undetermined};

/// Standard deviations from the median to the 90 % quantile of a normal distribution.
const TO_90: f64 = 1.281_551_565_544_6;

/// Least share of a squared level that is not noise: noise is not known better.
const LEAST_SHARE: f64 = 0.05;

/// A fitted model and its field, found from these very data: its table would know what is left out.
pub(crate) struct HeldField {
    field: Field,
    base: Examination,
}

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

impl HeldField {
    /// The field of an examined model.
    ///
    /// # Errors
    /// As [`Field::of`].
    pub fn of(datasets: &[NamedDataset<'_>], base: Examination) -> Result<Self, FieldError> {
        Ok(HeldField { field: Field::of(datasets, &base)?, base })
    }

    /// The field that a model holds; `None` if it holds none, or one that was found from other data, to which these are new.
    pub fn of_model(datasets: &[NamedDataset<'_>], model: &Model) -> Option<Self> {
        let is_listed = model.lists(EffectId::ERROR_FIELD);
        let table = model.field.as_ref().filter(|f| is_listed && f.datasets == digests(datasets))?;
        let mut base = table.beside.iter().fold(model.without(EffectId::ERROR_FIELD), |model, effect| model.without(effect));
        base.field = None;
        HeldField::of(datasets, Examination::new(datasets, &base).ok()?).ok()
    }

    /// As [`Field::added_to`].
    pub fn model(&self, datasets: &[NamedDataset<'_>]) -> Model {
        self.field.added_to(datasets, &self.base)
    }

    /// As [`Field::worth`].
    ///
    /// # Errors
    /// As there.
    pub fn worth(&self, datasets: &[NamedDataset<'_>], poses: &[Vec<f64>]) -> Result<Worth, FieldError> {
        self.field.worth(datasets, &self.base, poses)
    }

    /// As [`Field::squares`].
    pub fn squares(&self, folds: &[usize]) -> [Vec<Option<f64>>; 2] {
        self.field.squares(folds)
    }

    /// The examined model without the field.
    pub fn base(&self) -> &Examination {
        &self.base
    }

    /// The error to expect at joint angles `poses` (rad, N) of the first set-up, without the field (`which` 0) or with it (1);
    /// `None` without poses, or if the data do not determine the set-up itself.
    ///
    /// # Errors
    /// When the postures do not go with the examined fit.
    pub fn workspace(
        &self,
        datasets: &[NamedDataset<'_>],
        poses: &[Vec<f64>],
        which: usize,
    ) -> Result<Option<WorkspaceError>, IdentifyError> {
        let HeldField { field: Field { campaign, rows_alone, alone, with_field, divisions, mean, draws }, base } = self;
        let Some(first) = datasets.first().filter(|_| !poses.is_empty() && undetermined(base).is_empty()) else {
            return Ok(None);
        };
        let random = &mut ChaCha8Rng::seed_from_u64(SEED);
        let there = at_poses(first.dataset, base, poses, random);
        let seen = seen(base, &there, poses);
        let at = campaign.there(&there, base)?;
        let noise2 = |model: &Conditional| model.sizes.noise * campaign.noise_m.powi(2);
        let of_alone = alone.variances(rows_alone, &Groups::default(), &at.rows.of_model());
        let of_field = with_field.variances(&campaign.rows, &campaign.groups, &at.rows);
        let (own, own_noise2) = if which == 0 { (&of_alone, noise2(alone)) } else { (&of_field, noise2(with_field)) };
        let noise = if campaign.stated.is_some() { own_noise2.sqrt() } else { 0.0 };
        let level = |of: &[usize]| -> Option<Level> {
            let [far, own] = [&of_alone, own].map(|all| of.iter().map(|&p| all[p]).collect::<Vec<f64>>());
            let far = leverage(&far, noise2(alone));
            (!of.is_empty()).then(|| Level::of(&Expected::of(divisions, which, far, &own, own_noise2), noise))
        };
        let places = |which: fn(bool) -> bool| (0..poses.len()).filter(|&p| which(seen[p])).collect::<Vec<usize>>();
        let Some(all) = level(&places(|_| true)) else { return Ok(None) };
        let predicted = at.rows.applied(mean);
        let truths = at.rows.applied_all(draws);
        let largest = |truth: DVectorView<'_, f64>| {
            let missed = truth - &predicted;
            let lengths = (0..poses.len()).map(|p| missed.fixed_rows::<3>(3 * p).norm());
            lengths.fold(0.0, f64::max) / mean_length(&missed).max(f64::MIN_POSITIVE)
        };
        let largest = truths.column_iter().map(largest).sum::<f64>() / truths.ncols().max(1) as f64;
        // How the error is spread over the poses, by all that may err.
        let each: Vec<f64> = of_field.iter().map(|variance| variance.sqrt()).collect();
        let of_all = each.iter().sum::<f64>() / each.len().max(1) as f64;
        Ok(Some(WorkspaceError {
            mean: all.banded(1.0),
            max: all.banded(largest),
            ranges_seen: level(&places(|seen| seen)).map(|level| level.banded(1.0)),
            elsewhere: level(&places(|seen| !seen)).map(|level| level.banded(1.0)),
            poses: expected_errors(&there, poses, |p| all.error * each[p] / of_all.max(f64::MIN_POSITIVE)),
            noise,
            at_least: all.at_least,
        }))
    }
}
