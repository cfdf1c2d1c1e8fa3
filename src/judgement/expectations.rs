//! The error to expect of a calibrated robot, at named places.

use crate::diagnosis::Examination;
use crate::effects::EffectId;
use crate::identify::calibration::{Calibration, Estimate, IdentifyError};
use crate::measure::dataset::NamedDataset;
use crate::prediction::{PoseSource, WorkspaceError, WorkspacePoses};
use crate::selection::ladder::LadderStep;
use crate::units::Unit;

/// The error to expect at three kinds of places; each `None` if it cannot be predicted there.
#[derive(Debug, Clone)]
pub struct Expectations {
    /// At the poses that are held out; `None` also without any.
    pub held_out: Option<WorkspaceError>,
    /// Where every joint is in the range in which it was measured.
    pub inside: Option<WorkspaceError>,
    /// Over the limits of the joints; `None` also if a joint never moved.
    pub over_limits: Option<WorkspaceError>,
    /// Joints that were measured in one place, counted from 1: what the arm does elsewhere is not in the data.
    pub still: Vec<usize>,
    /// Parameters of the set-up that the data do not determine: with any, nothing can be predicted.
    pub undetermined: Vec<String>,
    /// Lengths of the tool and places of the base that the data hardly determine, where they are why far more is to be expected
    /// elsewhere than at the poses held out.
    pub loose: Vec<Loose>,
}

/// A length that the data hardly determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Loose {
    /// Name of the parameter.
    pub name: String,
    /// Its standard uncertainty, m.
    pub sigma: f64,
}

/// What is expected elsewhere is far more than at the poses held out if it is that many times as much.
const FAR_MORE: f64 = 5.0;

/// A standard uncertainty above this share of an expected error explains it.
const GOOD_PART: f64 = 1.0 / 3.0;

/// The lengths of tool and base that explain why more is expected elsewhere: those as uncertain as a good part of it.
fn loose(calibration: &Calibration, held_out: Option<&WorkspaceError>, elsewhere: Option<&WorkspaceError>) -> Vec<Loose> {
    let (Some(here), Some(there)) = (held_out, elsewhere) else { return Vec::new() };
    if there.mean.expected < FAR_MORE * here.mean.expected {
        return Vec::new();
    }
    let is_length =
        |e: &&Estimate| (e.effect == EffectId::TOOL_FRAME || e.effect == EffectId::BASE_FRAME) && e.unit == Unit::MM;
    let is_loose = |e: &&Estimate| e.sigma > GOOD_PART * there.mean.expected;
    let all = calibration.estimates.iter().filter(is_length).filter(is_loose);
    all.map(|e| Loose { name: e.name.clone(), sigma: e.sigma }).collect()
}

impl Expectations {
    /// What is to be expected of a model fitted to these data. The figure that the step has is taken from it.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn of(datasets: &[NamedDataset<'_>], step: &LadderStep) -> Result<Self, IdentifyError> {
        // The step was judged by its positions; what is used may have been fitted to orientations too.
        let by_positions = step.calibration.model.only_weighed_orientations;
        let known = |at: PoseSource| step.workspace.clone().filter(|error| by_positions && error.at == at);
        let still = still_joints(&step.calibration);
        let examination = match by_positions {
            true => Examination::new(datasets, &step.model)?,
            false => Examination::as_identified(datasets, &step.calibration.model)?,
        };
        let predicted = |poses: WorkspacePoses| match known(poses.source) {
            Some(error) => Ok(Some(error)),
            None => WorkspaceError::predict(datasets, &examination, &poses),
        };
        let held_out = match Some(WorkspacePoses::of(datasets)).filter(|poses| poses.source == PoseSource::Validation) {
            Some(poses) => predicted(poses)?,
            None => None,
        };
        let inside = predicted(WorkspacePoses::inside(datasets, &step.calibration.joint_ranges))?;
        Ok(Expectations {
            loose: loose(&step.calibration, held_out.as_ref(), inside.as_ref()),
            held_out,
            inside,
            over_limits: if still.is_empty() { predicted(WorkspacePoses::over_limits(datasets))? } else { None },
            still,
            undetermined: step.undetermined.clone(),
        })
    }
}

/// Share of its limits in which a joint moves at least where it is told from one that stands still.
const MOVES: f64 = 0.01;

/// The joints that were measured in one place, counted from 1.
fn still_joints(calibration: &Calibration) -> Vec<usize> {
    let is_still = |j: &usize| {
        let ([low, high], [least, most]) = (calibration.robot.links[*j].limits, calibration.joint_ranges[*j]);
        most - least < MOVES * (high - low)
    };
    (0..calibration.robot.joints()).filter(is_still).map(|j| j + 1).collect()
}
