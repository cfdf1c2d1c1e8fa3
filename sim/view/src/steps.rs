//! The steps by which the error falls: from the drawing to the calibration, and up the ladder.

use calibench::assess::{ProvingGround, WorkspacePoses, ladder};
use calibench::identify::{Calibration, IdentifyError, Use};
use calibench::measure::{Dataset, Measured};
use nalgebra::Vector3;

use crate::subject::Subject;

/// A residual where it was measured.
pub struct Residual {
    /// Ball or point, world, m.
    pub at: Vector3<f64>,
    /// Measured minus predicted, world, m.
    pub residual: Vector3<f64>,
}

/// What a model leaves of the data.
pub struct Left {
    /// The model in a word or two.
    pub name: String,
    /// Sample by sample.
    pub residuals: Vec<Residual>,
    /// Root mean square of their lengths, m.
    pub rms: f64,
}

/// What every model leaves.
pub struct Steps {
    /// By the arm as drawn, by the calibration, and by every rung of the ladder above it.
    pub rungs: Vec<Left>,
    /// By the recommended model, where it is none of the rungs: error curves, or the whole library at once, beside the calibration's.
    pub other: Option<Left>,
}

impl Steps {
    /// Before and after every step: each rung after the one below it, the recommended model after the calibration.
    pub fn pairs(&self) -> impl Iterator<Item = (&Left, &Left)> {
        let other = self.rungs.get(1).zip(self.other.as_ref());
        self.rungs.iter().zip(self.rungs.iter().skip(1)).chain(other)
    }
}

/// The steps of a calibration; where `climb`, up the ladder too.
///
/// # Errors
/// When the data do not go with the model or do not determine it.
pub fn steps(subject: &Subject, climb: bool) -> Result<Steps, IdentifyError> {
    let (calibration, dataset) = (&subject.calibration, &subject.dataset);
    let named = [(subject.name.as_str(), dataset)];
    let left = |name: String, of: &Calibration| Left::new(name, of, &named);
    let rungs = vec![left("as drawn".into(), &calibration.as_drawn())?, left("calibrated".into(), calibration)?];
    let mut steps = Steps { rungs, other: None };
    if climb {
        let poses = WorkspacePoses::of(&named);
        let ground = ProvingGround { poses: &poses.q, checks: &[] };
        let ladder = ladder(&named, &calibration.model, ground, &mut |_| {})?;
        for rung in ladder.rungs.iter().skip(1) {
            steps.rungs.push(left(format!("+ {}", rung.added.join(", ")), &rung.calibration)?);
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
    fn new(name: String, calibration: &Calibration, named: &[(&str, &Dataset)]) -> Result<Self, IdentifyError> {
        let prediction = calibration.predict(named, Use::Fit)?;
        let samples = named.iter().flat_map(|(_, d)| d.samples.iter().filter(|s| Use::Fit.takes(s)).map(move |s| (d, s)));
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

    /// The longest, m.
    pub fn longest(&self) -> f64 {
        self.residuals.iter().map(|r| r.residual.norm()).fold(0.0, f64::max)
    }
}
