//! The steps that reduce the error: from the nominal model to the calibration, and up the ladder.

use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::Use;
use calibench::measure::dataset::{Measured, NamedDataset};
use calibench::prediction::WorkspacePoses;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::ladder;
use nalgebra::Vector3;

use crate::subject::Subject;

/// A residual with its position.
pub struct Residual {
    /// Position of the ball or point, world, m.
    pub at: Vector3<f64>,
    /// Measured minus predicted, world, m.
    pub residual: Vector3<f64>,
}

/// Residuals of a model.
pub struct Left {
    /// Name of the model, in a word or two.
    pub name: String,
    /// Residuals by sample.
    pub residuals: Vec<Residual>,
    /// Root mean square of their lengths, m.
    pub rms: f64,
}

/// Residuals of all models.
pub struct Steps {
    /// Residuals of the nominal arm, of the calibration, and of every step of the ladder above it.
    pub models: Vec<Left>,
    /// Residuals of the recommended model if it is none of the steps: error curves, or the whole library at once,
    /// compared with the calibration.
    pub other: Option<Left>,
}

impl Steps {
    /// Residuals before and after every step: each step of the ladder after the previous one, the recommended model
    /// after the calibration.
    pub fn pairs(&self) -> impl Iterator<Item = (&Left, &Left)> {
        let other = self.models.get(1).zip(self.other.as_ref());
        self.models.iter().zip(self.models.iter().skip(1)).chain(other)
    }
}

/// Computes the steps of a calibration; with `whole_ladder`, those of the ladder too.
///
/// # Errors
/// When the data do not match the model or do not determine it.
pub fn steps(subject: &Subject, whole_ladder: bool) -> Result<Steps, IdentifyError> {
    let (calibration, dataset) = (&subject.calibration, &subject.dataset);
    let named = [NamedDataset::new(&subject.name, dataset)];
    let left = |name: String, of: &Calibration| Left::new(name, of, &named);
    let models = vec![left("nominal".into(), &calibration.nominal())?, left("calibrated".into(), calibration)?];
    let mut steps = Steps { models, other: None };
    if whole_ladder {
        let poses = WorkspacePoses::of(&named);
        let ground = HoldOut { poses: &poses, checks: &[], worker: None };
        let ladder = ladder(&named, &calibration.model, ground)?;
        for ladder_step in ladder.steps.iter().skip(1) {
            steps.models.push(left(format!("+ {}", ladder_step.added.join(", ")), &ladder_step.calibration)?);
        }
        let other = ladder
            .other
            .as_ref()
            .map(|other| left(format!("recommended, {} effects at once", other.added.len()), &other.calibration));
        steps.other = other.transpose()?;
    }
    Ok(steps)
}

impl Left {
    fn new(name: String, calibration: &Calibration, named: &[NamedDataset<'_>]) -> Result<Self, IdentifyError> {
        let prediction = calibration.predict(named, Use::Fit)?;
        let samples =
            named.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s)).map(move |s| (d.dataset, s)));
        let residuals: Vec<Residual> = samples
            .zip(&prediction.residuals)
            .filter_map(|((d, sample), &residual)| {
                let at = match &sample.measured {
                    Measured::Ball { ball, .. } => d.balls[*ball].position,
                    Measured::Point(point) => *point,
                    // A distance has no direction to draw.
                    Measured::Distance { .. } => return None,
                };
                Some(Residual { at, residual })
            })
            .collect();
        let squares: f64 = residuals.iter().map(|r| r.residual.norm_squared()).sum();
        Ok(Left { name, rms: (squares / residuals.len().max(1) as f64).sqrt(), residuals })
    }

    /// The longest residual, m.
    pub fn longest(&self) -> f64 {
        self.residuals.iter().map(|r| r.residual.norm()).fold(0.0, f64::max)
    }
}
