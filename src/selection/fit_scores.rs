//! Scores of a fit that need no diagnosis: its residual, and its errors in cross-validation.

use crate::diagnosis::Examination;
use crate::diagnosis::Symptom;
use crate::diagnosis::cross_validation::{cross_validated_positions, folds};
use crate::diagnosis::folds::postures;
use crate::identify::calibration::Calibration;
use crate::identify::fit::FitError;
use crate::identify::problem::Use;
use crate::identify::{Model, identify};
use crate::measure::dataset::NamedDataset;
use crate::measure::poses::Postures;
use crate::prediction::field::HeldField;

/// Cross-validated error of one session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionError {
    /// Name of the dataset, with the session if sessions are named.
    pub name: String,
    /// Root mean square of its 3-D residual in blocked cross-validation, m.
    pub cross_validated: f64,
    /// Rms of the 3-D error predicted by a robot calibrated on the other campaigns only, with its own base and tool
    /// refitted, m; `None` with one campaign, or if the others do not determine the robot.
    pub from_others: Option<f64>,
    /// Squared errors of that prediction, m², in the order of its rows, and the posture index of each.
    pub(crate) squares: Vec<f64>,
    pub(crate) posture: Vec<usize>,
}

/// A fitted model with the scores of its fit.
#[derive(Debug, Clone)]
pub struct FitScores {
    /// The model.
    pub model: Model,
    /// The fit as a calibration.
    pub calibration: Calibration,
    /// Residual, rms in 3-D, m.
    pub fit: f64,
    /// Residual in blocked cross-validation, rms in 3-D, m.
    pub cross_validated: f64,
    /// Name of each sample, and its squared residual in blocked cross-validation, m².
    pub blocks: Vec<(String, f64)>,
    /// Posture index of each sample, counted from 0.
    pub posture: Vec<usize>,
    /// One entry per session.
    pub sessions: Vec<SessionError>,
    /// Parameter values that are physically impossible.
    pub symptoms: Vec<Symptom>,
}

impl FitScores {
    /// Scores an examined model; `field` is the field that it holds, if that was found from these data.
    ///
    /// # Errors
    /// When an inner product is not finite.
    pub(crate) fn of(
        datasets: &[NamedDataset<'_>],
        model: &Model,
        examination: &Examination,
        field: Option<&HeldField>,
    ) -> Result<Self, FitError> {
        let calibration = examination.calibration(datasets);
        let blocks = match field {
            Some(field) => blocks_of_field(examination, field),
            None => blocks(examination)?,
        };
        Ok(FitScores {
            model: model.clone(),
            fit: examination.fit.rms,
            // A sample that is excluded no longer counts.
            cross_validated: rms(blocks.iter().filter(|(id, _)| !model.excludes(id)).map(|(_, squares)| *squares)),
            posture: postures(&examination.contexts).of_samples().to_vec(),
            sessions: sessions(datasets, model, examination, &blocks, field.is_some()),
            symptoms: Symptom::of(&calibration, datasets),
            blocks,
            calibration,
        })
    }
}

/// The errors of each session.
fn sessions(
    datasets: &[NamedDataset<'_>],
    model: &Model,
    examination: &Examination,
    blocks: &[(String, f64)],
    of_all: bool,
) -> Vec<SessionError> {
    let setup_of = examination.contexts.iter().map(|at| at.setup);
    let of_session =
        |s: usize| rms(blocks.iter().zip(setup_of.clone()).filter(|(_, setup)| *setup == s).map(|((_, squares), _)| *squares));
    let names = examination.problem.setups().iter().map(|s| s.name());
    let names =
        names.map(|[dataset, session]| if session.is_empty() { dataset.to_owned() } else { format!("{dataset}/{session}") });
    let mut sessions: Vec<SessionError> = names
        .enumerate()
        .map(|(s, name)| SessionError {
            name,
            cross_validated: of_session(s),
            from_others: None,
            squares: Vec::new(),
            posture: Vec::new(),
        })
        .collect();
    // A field was found from all campaigns: none of them can judge it.
    if datasets.len() > 1 && sessions.len() == datasets.len() && !of_all {
        for (k, session) in sessions.iter_mut().enumerate() {
            if let Some((squares, posture)) = from_others(datasets, model, k) {
                session.from_others = Some(rms(squares.iter().copied()));
                (session.squares, session.posture) = (squares, posture);
            }
        }
    }
    sessions
}

/// Name of each sample, and its squared residual in blocked cross-validation, m².
fn blocks(examination: &Examination) -> Result<Vec<(String, f64)>, FitError> {
    let Examination { contexts, rows, fit, .. } = examination;
    let setups = contexts.iter().map(|c| c.setup + 1).max().unwrap_or(0);
    let predicted = cross_validated_positions(examination, &folds(contexts))?;
    let (mut fitted, mut residual) = (vec![0.0; setups], vec![0.0; setups]);
    let last = rows.nrows() - 1;
    for (at, r) in contexts.iter().zip(examination.problem.residuals(&fit.values)) {
        fitted[at.setup] += (0..at.positions).map(|k| rows[(last, at.first_row + k)].powi(2)).sum::<f64>();
        residual[at.setup] += r.norm_squared();
    }
    // The squares are computed whitened; the ratio of residual to whitened squares of the set-up converts them to m².
    let unit = |s: usize| residual[s] / fitted[s].max(f64::MIN_POSITIVE);
    let squares = contexts.iter().zip(predicted).map(|(at, squares)| squares * unit(at.setup));
    Ok(examination.problem.sample_ids().iter().cloned().zip(squares).collect())
}

/// The same of a model with a field, which was not found from what is predicted. Samples that took no part in finding it count
/// as the mean of their block.
fn blocks_of_field(examination: &Examination, field: &HeldField) -> Vec<(String, f64)> {
    let folds = folds(&examination.contexts);
    let [_, squares] = field.squares(&folds);
    let mut means = vec![(0.0, 0.0); folds.iter().max().map_or(0, |f| f + 1)];
    for (fold, square) in folds.iter().zip(&squares) {
        if let Some(square) = square {
            means[*fold] = (means[*fold].0 + square, means[*fold].1 + 1.0);
        }
    }
    let mean = |fold: usize| means[fold].0 / f64::max(means[fold].1, 1.0);
    let squares = folds.iter().zip(squares).map(|(&fold, square)| square.unwrap_or_else(|| mean(fold)));
    examination.problem.sample_ids().iter().cloned().zip(squares).collect()
}

/// Root mean square, from squared values.
pub(crate) fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
    if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
}

/// Squared errors of dataset `k` predicted by a robot calibrated on the other datasets, and the posture index of each
/// row; `None` if the others do not determine it.
fn from_others(datasets: &[NamedDataset<'_>], model: &Model, k: usize) -> Option<(Vec<f64>, Vec<usize>)> {
    let others: Vec<NamedDataset<'_>> = datasets.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, d)| *d).collect();
    let calibration = identify(&others, model).ok()?;
    let predicted = calibration.predict(&datasets[k..=k], Use::Fit).ok()?;
    let postures = Postures::of(&datasets[k..=k], |s| Use::Fit.takes(s));
    Some((predicted.residuals.iter().map(|r| r.norm_squared()).collect(), postures.of_samples().to_vec()))
}
