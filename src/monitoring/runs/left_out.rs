//! Every run predicted by the robot of the others.

use nalgebra::Vector3;

use crate::diagnosis::Examination;
use crate::diagnosis::folds::postures;
use crate::diagnosis::library::Candidate;
use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::problem::Use;
use crate::identify::{Model, identify};
use crate::math::rms;
use crate::measure::dataset::{NamedDataset, SampleSet};
use crate::measure::poses::Postures;
use crate::selection::recommend::curves::{bands, curve_model};

/// Parts of a run's postures, each predicted with base and tool from the other parts.
const PARTS: usize = 10;

/// Errors at a run that was not fitted, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Root mean square of the 3-D error.
    pub rms: f64,
    /// Mean 3-D error.
    pub mean: f64,
    /// Largest 3-D error.
    pub max: f64,
    /// Number of samples.
    pub samples: usize,
}

/// A model without those changes that the named datasets cannot show: of which all of them, or none, have the same.
pub(super) fn changes_shown_by(model: &Model, names: &[&str]) -> Model {
    let mut model = model.clone();
    model.changes.retain(|change| {
        let first = names.first().map_or(0.0, |name| change.weight(name));
        names.iter().any(|name| (change.weight(name) - first).abs() > 1e-9)
    });
    model
}

/// The model with the error curves of all joints, each regularised by the size that these data give it.
///
/// # Errors
/// When the data do not determine the model.
pub(super) fn with_curves(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Model, IdentifyError> {
    let plain = Examination::with(datasets, model, Vec::new())?;
    let ids = bands(plain.problem().robot(), postures(&plain.contexts).count());
    let ids = ids.into_iter().filter(|id| !model.lists(id));
    let beside = plain.beside(datasets, ids.map(Candidate::new).collect())?;
    Ok(curve_model(datasets, &beside, model)?)
}

/// Errors of a robot, identified on other runs, at one: base, tool and free balls of each part of its postures are those of the
/// other parts.
///
/// # Errors
/// When the run does not determine its set-up.
pub(super) fn predicted(
    robot: &Calibration,
    NamedDataset { name, dataset: run }: NamedDataset<'_>,
) -> Result<LeftOut, IdentifyError> {
    let postures = Postures::of(&[NamedDataset::new(name, run)], |_| true);
    let parts = PARTS.min(postures.count());
    let refitted = robot.set_up_anew();
    let mut errors: Vec<Vector3<f64>> = Vec::new();
    if parts < 2 {
        errors = refitted.predict(&[NamedDataset::new(name, run)], Use::All)?.residuals;
    }
    for part in 0..if parts < 2 { 0 } else { parts } {
        let mut divided = run.clone();
        for (sample, posture) in divided.samples.iter_mut().zip(postures.of_samples()) {
            sample.set = if posture % parts == part { SampleSet::Validation } else { SampleSet::Fit };
        }
        errors.extend(refitted.predict(&[NamedDataset::new(name, &divided)], Use::Validation)?.residuals);
    }
    let lengths: Vec<f64> = errors.iter().map(|e| e.norm()).collect();
    Ok(LeftOut {
        rms: rms(&errors),
        mean: lengths.iter().sum::<f64>() / lengths.len().max(1) as f64,
        max: lengths.iter().copied().fold(0.0, f64::max),
        samples: lengths.len(),
    })
}

/// The errors at run `k` of the robot of all others; with error curves if `curves`.
///
/// # Errors
/// When the others do not determine the robot, or the run not its set-up.
pub(super) fn left_out(datasets: &[NamedDataset<'_>], model: &Model, k: usize, curves: bool) -> Result<LeftOut, IdentifyError> {
    let others: Vec<NamedDataset<'_>> = datasets.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, d)| *d).collect();
    let names: Vec<&str> = others.iter().map(|d| d.name).collect();
    let model = changes_shown_by(model, &names);
    let model = if curves { with_curves(&others, &model)? } else { model };
    predicted(&identify(&others, &model)?, datasets[k])
}
