//! The error to expect of a calibrated robot, at named places.

use crate::diagnosis::Examination;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::NamedDataset;
use crate::prediction::{PoseSource, WorkspaceError, WorkspacePoses};
use crate::selection::ladder::LadderStep;

/// The error to expect at three kinds of places; each `None` if it cannot be predicted there.
#[derive(Debug, Clone)]
pub struct Expectations {
    /// At the poses that are held out; `None` also without any.
    pub held_out: Option<WorkspaceError>,
    /// Where every joint is in the range in which it was measured.
    pub inside: Option<WorkspaceError>,
    /// Over the limits of the joints.
    pub over_limits: Option<WorkspaceError>,
    /// Parameters of the set-up that the data do not determine: with any, nothing can be predicted.
    pub undetermined: Vec<String>,
}

impl Expectations {
    /// What is to be expected of a model fitted to these data. The figure that the step has is taken from it.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn of(datasets: &[NamedDataset<'_>], step: &LadderStep) -> Result<Self, IdentifyError> {
        let known = |at: PoseSource| step.workspace.clone().filter(|error| error.at == at);
        let examination = Examination::new(datasets, &step.model)?;
        let predicted = |poses: WorkspacePoses| match known(poses.source) {
            Some(error) => Ok(Some(error)),
            None => WorkspaceError::predict(datasets, &examination, &poses),
        };
        Ok(Expectations {
            held_out: known(PoseSource::Validation),
            inside: predicted(WorkspacePoses::inside(datasets, &step.calibration.joint_ranges))?,
            over_limits: predicted(WorkspacePoses::over_limits(datasets))?,
            undetermined: step.undetermined.clone(),
        })
    }
}
