//! A model that holds a field, judged: what it predicts of left-out postures is found without them.

use nalgebra::DVectorView;

use super::conditional::Conditional;
use super::forecast::{Forecast, Poses};
use super::rows::Groups;
use super::{Field, FieldError, Worth, digests, mean_length};
use crate::diagnosis::Examination;
use crate::diagnosis::library::{Candidate, Library};
use crate::effects::{self, EffectId, Needs};
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::prediction::expected_error::WorkspaceError;
use crate::prediction::poses::WorkspacePoses;

/// A fitted model and its field, found from these very data: its table would know what is left out.
pub(crate) struct HeldField {
    field: Field,
    base: Examination,
}

impl HeldField {
    /// The field beyond a model.
    ///
    /// # Errors
    /// As [`Field::of`], and when the data do not fit the model.
    pub fn of(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Self, FieldError> {
        let base = Examination::with(datasets, model, candidates(datasets, model))?;
        Ok(HeldField { field: Field::of(datasets, &base)?, base })
    }

    /// The field that a model holds; `None` if it holds none, or one that was found from other data, to which these are new.
    pub fn of_model(datasets: &[NamedDataset<'_>], model: &Model) -> Option<Self> {
        let is_listed = model.lists(EffectId::ERROR_FIELD);
        let table = model.field.as_ref().filter(|f| is_listed && f.datasets == digests(datasets))?;
        let mut base = table.beside.iter().fold(model.without(EffectId::ERROR_FIELD), |model, effect| model.without(effect));
        base.field = None;
        HeldField::of(datasets, &base).ok()
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

    /// The error to expect at joint angles `poses` (rad, N) of the first set-up; `None` without poses, or if the data do not
    /// determine the set-up itself.
    ///
    /// # Errors
    /// When the postures do not go with the examined fit.
    pub fn workspace(
        &self,
        datasets: &[NamedDataset<'_>],
        poses: &WorkspacePoses,
    ) -> Result<Option<WorkspaceError>, IdentifyError> {
        let HeldField { field: Field { campaign, rows_alone, alone, with_field, divisions, mean, draws }, base } = self;
        let Some(there) = Poses::of(datasets, base, campaign, &poses.q)? else { return Ok(None) };
        let of_alone = alone.variances(rows_alone, &Groups::default(), &there.at.rows.of_model());
        let of_field = with_field.variances(&campaign.rows, &campaign.groups, &there.at.rows);
        let predicted = there.at.rows.applied(mean);
        let truths = there.at.rows.applied_all(draws);
        let largest = |truth: DVectorView<'_, f64>| {
            let missed = truth - &predicted;
            let lengths = (0..poses.q.len()).map(|p| missed.fixed_rows::<3>(3 * p).norm());
            lengths.fold(0.0, f64::max) / mean_length(&missed).max(f64::MIN_POSITIVE)
        };
        let largest = truths.column_iter().map(largest).sum::<f64>() / truths.ncols().max(1) as f64;
        let noise2 = |model: &Conditional| model.sizes.noise * campaign.noise_m.powi(2);
        let forecast = Forecast {
            divisions,
            which: 1,
            far: &of_alone,
            far_noise2: noise2(alone),
            own: &of_field,
            own_noise2: noise2(with_field),
            noise: if campaign.stated.is_some() { noise2(with_field).sqrt() } else { 0.0 },
            each: of_field.iter().map(|variance| variance.sqrt()).collect(),
            largest,
        };
        Ok(forecast.over(&there, poses))
    }
}

/// The effects of the library beside which a field is found. What acts through an unknown compliance is left out: only the
/// product of the two is seen.
fn candidates(datasets: &[NamedDataset<'_>], model: &Model) -> Vec<Candidate> {
    let Some(NamedDataset { dataset: first, .. }) = datasets.first() else { return Vec::new() };
    let balls = first.ball_ids();
    let subject = model.subject(&first.robot, &balls);
    let is_linear = |c: &Candidate| effects::build(&c.id, &subject).is_ok_and(|e| !e.needs().contains(&Needs::Compliance));
    Library::new(datasets, model).candidates.into_iter().filter(is_linear).collect()
}
