//! Hold-out: poses and campaigns that a model is judged on and not fitted to.

use std::sync::Arc;

use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::problem::Use;
use crate::measure::dataset::{Dataset, NamedDataset, SampleSet};
use crate::measure::poses::Postures;
use crate::prediction::WorkspacePoses;
use crate::prediction::worker::Worker;
use crate::residuals::Validation;

/// The poses and campaigns on which a model is judged, besides the rows that it is fitted to.
#[derive(Debug, Clone, Copy)]
pub struct HoldOut<'a> {
    /// Poses at which the error is predicted.
    pub poses: &'a WorkspacePoses,
    /// Campaigns that are not fitted, by name. The robot is calibrated without them, and only its set-up is re-fitted
    /// for each. They are judged on their rows of set `validation`, or on all rows if there are none.
    pub checks: &'a [NamedDataset<'a>],
    /// Computes a part of the prediction where threads cannot be had.
    pub worker: Option<&'a dyn Worker>,
}

/// The reason why a campaign cannot be judged.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum NotJudged {
    /// Its rows cannot be predicted.
    #[error("{0}")]
    Unpredictable(Arc<IdentifyError>),
    /// It has no rows.
    #[error("it has no samples")]
    Empty,
}

/// Result for a campaign that was not fitted.
#[derive(Debug, Clone)]
pub struct Check {
    /// Name of the campaign.
    pub name: String,
    /// Position errors in it, or the reason why it cannot be judged.
    pub result: Result<Validation, NotJudged>,
    /// Squared errors, m², in the order of its rows, and the posture index of each.
    pub(crate) squares: Vec<f64>,
    pub(crate) posture: Vec<usize>,
}

impl Check {
    pub(crate) fn of(calibration: &Calibration, name: &str, dataset: &Dataset) -> Self {
        let held_out = dataset.samples.iter().any(|s| s.set == SampleSet::Validation);
        let which = if held_out { Use::Validation } else { Use::All };
        let predicted = calibration
            .set_up_anew()
            .predict(&[NamedDataset::new(name, dataset)], which)
            .map_err(|e| NotJudged::Unpredictable(Arc::new(e)));
        let squares = predicted.as_ref().map_or(Vec::new(), |p| p.residuals.iter().map(|r| r.norm_squared()).collect());
        let posture = Postures::of(&[NamedDataset::new(name, dataset)], |s| which.takes(s)).of_samples().to_vec();
        let result = predicted.and_then(|p| Validation::of(&p).ok_or(NotJudged::Empty));
        Check { name: name.into(), result, squares, posture }
    }
}
