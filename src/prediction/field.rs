//! The field of joint errors: everything by which the joints of an arm may err that no named effect describes, and what it is
//! worth at given postures.
//!
//! The residual is explained by the model's own parameters about their nominal values, by the effects of the catalogue, and by
//! errors of the joints' angles: curves of a joint's own angle, functions of two angles, and functions of a joint's load and
//! an angle. Every group has one size. Its posterior mean is a correction; whether that is to be used is decided by what is
//! measured at left-out postures as far from the data as those where the robot works (decision 0045).

mod basis;
mod campaign;
mod condensed;
mod conditional;
mod divisions;
mod evidence;
mod expected;
mod forecast;
mod gate;
mod gibbs;
mod held;
mod kernels;
mod left_out;
#[cfg(test)]
mod oracle;
mod rows;
mod table;
#[cfg(test)]
mod tests;

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use thiserror::Error;

use self::campaign::Campaign;
use self::condensed::mean_of_all;
use self::conditional::Conditional;
pub use self::divisions::Parting;
use self::divisions::{Divided, Measured, divisions, measure};
use self::expected::{Expected, leverage};
pub(crate) use self::forecast::expected_of_model;
pub use self::gate::{Condition, Gate, Matter};
pub(crate) use self::held::HeldField;
use self::left_out::left_out;
use self::rows::{Coefficients, Groups, Rows};
pub use self::table::{FieldPart, FieldShare};
use self::table::{beside, kept, shares};
use super::poses::{SEED, at_poses};
use crate::diagnosis::Examination;
use crate::effects::EffectId;
use crate::effects::error_field::ErrorField;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::{FitError, Outcome};
use crate::math::linalg::Cholesky;
use crate::measure::dataset::NamedDataset;

/// Largest number of samples whose sizes are sampled; of more, they are found by evidence.
const MOST_SAMPLED: usize = 200;

/// Draws of a field whose sizes were found by evidence.
const DRAWS: usize = 100;

/// The reason why there is no field.
#[derive(Debug, Error)]
#[non_exhaustive]
pub(crate) enum FieldError {
    /// Too few postures.
    #[error("{found} postures are too few for a field of joint errors; measure at least {least}")]
    TooFewPostures {
        /// Postures of the fit.
        found: usize,
        /// Fewest of a field.
        least: usize,
    },
    /// The model lacks what a field would stand in for.
    #[error("the model does not hold '{effect}', whose columns a field of joint errors needs beside it; add it to the model")]
    WithoutColumns {
        /// The effect.
        effect: &'static str,
    },
    /// Only sliding joints.
    #[error("no joint of '{robot}' turns; a field of joint errors is one of angles")]
    NoJointTurns {
        /// Name of the robot.
        robot: String,
    },
    /// The fit about which it would be linear is none.
    #[error("the fit did not converge; a field of joint errors is linear about a fit that did")]
    NotConverged,
    /// No posture to judge at.
    #[error("there is no posture at which the field of joint errors is to be judged; name at least one")]
    NoPosture,
    /// A matrix could not be factored.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The postures do not go with the examined fit.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// A campaign explained by its model alone and by its model with the field.
pub(crate) struct Field {
    campaign: Campaign,
    rows_alone: Rows,
    alone: Conditional,
    with_field: Conditional,
    /// Mean of all coefficients: the correction.
    mean: Coefficients,
    /// Draws of them, of which that is not the mean.
    draws: Vec<Coefficients>,
    divisions: Vec<Measured>,
}

/// What a field is worth at given postures.
#[derive(Debug, Clone)]
pub(crate) struct Worth {
    /// The error to expect of the model alone.
    pub before: Expected,
    /// The error to expect of the model with its field.
    pub after: Expected,
    /// Whether the field is to be used there.
    pub gate: Gate,
    /// Shares of the correction there, the largest first; they sum to 1.
    pub shares: Vec<FieldShare>,
}

/// A campaign explained by its model alone, and the divisions that measure it.
struct Alone {
    campaign: Campaign,
    rows: Rows,
    model: Conditional,
    divided: Vec<Divided>,
}

impl Alone {
    /// Conditions the model of an examined fit.
    ///
    /// # Errors
    /// When the fit did not converge or there are too few postures.
    fn of(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Self, FieldError> {
        if examination.fit.outcome != Outcome::Converged {
            return Err(FieldError::NotConverged);
        }
        let campaign = Campaign::of(datasets, examination)?;
        let rows = campaign.rows.of_model();
        let weights = evidence::weights(&rows, &campaign.y)?;
        let model = evidence::of_model(&rows, &campaign.y, &weights, campaign.stated)?;
        let divided = divisions(datasets, examination, &campaign);
        Ok(Alone { campaign, rows, model, divided })
    }
}

impl Field {
    /// Explains an examined fit; the same data give the same field on any number of threads.
    ///
    /// # Errors
    /// When the fit did not converge or the data do not carry a field.
    pub fn of(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Self, FieldError> {
        let Alone { campaign, rows: rows_alone, model: mut alone, divided } = Alone::of(datasets, examination)?;
        let Campaign { rows, y, groups, stated, .. } = &campaign;
        let weights = &alone.sizes.weights;
        let (with_field, mut mean, draws) = if rows.samples.len() <= MOST_SAMPLED {
            let sampled = gibbs::sample(rows, groups, y, *stated, gibbs::SEED)?;
            (conditioned(&campaign, sampled.sizes)?, sampled.mean, sampled.draws)
        } else {
            let found = evidence::of_groups(rows, groups, y, weights, *stated)?;
            let random = &mut ChaCha8Rng::seed_from_u64(gibbs::SEED);
            let draws = (0..DRAWS).map(|_| found.draw(rows, groups, y, random)).collect();
            let mean = found.mean.clone();
            (found, mean, draws)
        };
        let divisions = measure(&divided, &campaign, [&alone, &with_field]);
        if examination.contexts.len() > rows.samples.len() {
            alone.mean = mean_of_all(examination, &campaign, &rows_alone, &Groups::default(), &alone.sizes)?;
            mean = mean_of_all(examination, &campaign, rows, groups, &with_field.sizes)?;
        }
        Ok(Field { campaign, rows_alone, alone, with_field, mean, draws, divisions })
    }

    /// Judges it at joint angles `poses` (rad, N) of the first set-up.
    ///
    /// # Errors
    /// When there is no posture.
    pub fn worth(
        &self,
        datasets: &[NamedDataset<'_>],
        examination: &Examination,
        poses: &[Vec<f64>],
    ) -> Result<Worth, FieldError> {
        let Some(first) = datasets.first().filter(|_| !poses.is_empty()) else { return Err(FieldError::NoPosture) };
        let Field { campaign, rows_alone, alone, with_field, divisions, .. } = self;
        let random = &mut ChaCha8Rng::seed_from_u64(SEED);
        let there = campaign.there(&at_poses(first.dataset, examination, poses, random), examination)?;
        let there_alone = there.rows.of_model();
        let noise2 = |model: &Conditional| model.sizes.noise * campaign.noise_m.powi(2);
        let of_alone = alone.variances(rows_alone, &Groups::default(), &there_alone);
        let of_field = with_field.variances(&campaign.rows, &campaign.groups, &there.rows);
        let far = leverage(&of_alone, noise2(alone));
        let before = Expected::of(divisions, 0, far, &of_alone, noise2(alone));
        let after = Expected::of(divisions, 1, far, &of_field, noise2(with_field));

        let by_alone = there_alone.applied(&alone.mean);
        let by_field = there.rows.applied(&self.mean);
        let truths = there.rows.applied_all(&self.draws);
        let drawn = truths.column_iter().map(|truth| [&by_alone, &by_field].map(|model| mean_length(&(truth - model))));
        let drawn: Vec<[f64; 2]> = drawn.collect();
        let gate = Gate::of([&before, &after], divisions, &drawn);
        Ok(Worth { before, after, gate, shares: shares(campaign, examination, &there, &self.mean) })
    }

    /// The model of an examined fit with this field: its table, and the effects of the set-up that are fitted beside it.
    pub fn added_to(&self, datasets: &[NamedDataset<'_>], examination: &Examination) -> Model {
        let Field { campaign, alone, with_field, mean, .. } = self;
        let counted = |rows: &Rows, model: &Conditional| {
            let noise = model.sizes.noise_of_rows(rows);
            noise.iter().enumerate().map(|(r, noise)| 1.0 - noise * model.inverse[(r, r)]).sum::<f64>()
        };
        let beside = beside(campaign, examination, mean, &with_field.sizes.groups);
        let field = ErrorField {
            beside: beside.iter().map(|(effect, _)| effect.clone()).collect(),
            datasets: digests(datasets),
            numbers: (counted(&campaign.rows, with_field) - counted(&self.rows_alone, alone)).max(0.0),
            ..kept(campaign, examination, mean)
        };
        let mut model = examination.model.with(EffectId::ERROR_FIELD);
        for (effect, width) in beside {
            model = model.with(&effect);
            model.width.insert(effect.to_string(), width);
        }
        Model { field: Some(std::sync::Arc::new(field)), only_weighed_orientations: false, ..model }
    }

    /// Squared error of every sample predicted without its part (`folds`), without the field and with it, m²; `None` for what
    /// cannot be predicted or was not among the samples by which sizes are found.
    pub fn squares(&self, folds: &[usize]) -> [Vec<Option<f64>>; 2] {
        let Field { campaign, alone, with_field, .. } = self;
        let of_chosen: Vec<usize> = campaign.chosen.iter().map(|&s| folds[s]).collect();
        [alone, with_field].map(|model| {
            let mut all = vec![None; folds.len()];
            for (&s, missed) in campaign.chosen.iter().zip(left_out(model, campaign, &of_chosen)) {
                all[s] = missed.map(|missed| missed.squared);
            }
            all
        })
    }
}

/// The digests by which datasets are recognised.
fn digests(datasets: &[NamedDataset<'_>]) -> Vec<String> {
    datasets.iter().map(|d| d.dataset.hash.clone()).collect()
}

/// Mean length of displacements, three rows each.
fn mean_length(rows: &DVector<f64>) -> f64 {
    let count = rows.len() / 3;
    (0..count).map(|p| rows.fixed_rows::<3>(3 * p).norm()).sum::<f64>() / count.max(1) as f64
}

/// The model with its field of given sizes.
fn conditioned(campaign: &Campaign, sizes: conditional::Sizes) -> Result<Conditional, FieldError> {
    let Campaign { rows, groups, y, .. } = campaign;
    let n = rows.count();
    let kernels = kernels::Kernels::new(rows, groups);
    let (mut factor, mut covariance) = (Cholesky::new(n), nalgebra::DMatrix::zeros(n, n));
    evidence::covariance_of_rows(&kernels, rows, groups, &sizes, &mut kernels::Room::new(rows), &mut covariance);
    factor.factor(&covariance).map_err(FitError::from)?;
    Ok(Conditional::of_factor(rows, y, groups, sizes, factor))
}
