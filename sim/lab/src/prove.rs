//! Tests of the advice: measured campaigns are divided, the whole procedure is carried out on one part as a user would, and its
//! recommendation is judged on the other part, which it has not seen.

mod divisions;
mod rows;

use std::path::PathBuf;
use std::time::Instant;

use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{NamedDataset, Sample};
use calibench::measure::poses::Postures;
use calibench::prediction::{PoseSource, WorkspaceError, WorkspacePoses};
use calibench::residuals::Validation;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::ladder;
use calibench::units::MM;
use serde::Serialize;

pub use divisions::{Case, Division, by_blocks, by_campaigns, by_places, by_postures, by_short_campaigns};
pub use rows::{Part, Row, csv};

/// Least number of judged postures for this ratio: a mean of n postures scatters by 0.42/sqrt(n).
pub const LEAST_JUDGED: usize = 15;

/// One division of the data, and its result.
#[derive(Debug, Clone, Serialize)]
pub struct Proof {
    /// Name of the data.
    pub robot: String,
    /// Name of the division.
    pub fold: String,
    /// Kind of division.
    pub division: Division,
    /// Numbers of postures fitted and judged.
    pub postures: [usize; 2],
    /// Rms of the 3-D error on held-out rows, mm: base, tool and links alone; the default model; the recommended model.
    pub geometry_mm: Option<f64>,
    #[allow(missing_docs)]
    pub default_mm: f64,
    #[allow(missing_docs)]
    pub recommended_mm: f64,
    /// Kind of the recommended model.
    pub kind: &'static str,
    /// Predicted over measured mean error of the default and the recommended model on these rows; the prediction includes the
    /// instrument's noise.
    pub predicted_over_measured: [Option<f64>; 2],
    /// The verdict on the default model.
    pub verdict: &'static str,
    /// Time of the whole ladder, s.
    pub seconds: f64,
    /// File of its rows, if kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<PathBuf>,
}

/// The outcome of a division: its figures, and the two calibrations that they are of.
#[derive(Debug, Clone)]
pub struct Proven {
    /// The figures.
    pub proof: Proof,
    /// The default model, identified on the fitted rows.
    pub default: Calibration,
    /// The recommended model, identified on them.
    pub recommended: Calibration,
}

impl Proof {
    /// Ratio of the recommended to the default model's error.
    pub fn ratio(&self) -> f64 {
        self.recommended_mm / self.default_mm
    }
}

impl Case<'_> {
    fn fitted(&self) -> Vec<NamedDataset<'_>> {
        self.fitted.iter().map(|(name, dataset)| NamedDataset::new(name, dataset.as_ref())).collect()
    }

    fn judged(&self) -> [NamedDataset<'_>; 1] {
        [NamedDataset::new(self.robot, &self.judged)]
    }

    /// The calibration as compared with the judged rows.
    fn as_judged(&self, calibration: &Calibration) -> Calibration {
        if self.anew { calibration.set_up_anew() } else { calibration.clone() }
    }

    /// Time to identify the default model alone on the fitted rows, s.
    ///
    /// # Errors
    /// If the default model does not match the data.
    pub fn seconds_of_default(&self) -> Result<f64, IdentifyError> {
        let fitted = self.fitted();
        let began = Instant::now();
        identify(&fitted, &Model::default_for(fitted[0].dataset))?;
        Ok(began.elapsed().as_secs_f64())
    }

    /// Runs the ladder on the fitted rows, as a user would, and judges its advice on the others.
    ///
    /// # Errors
    /// If the default model does not match the data.
    pub fn prove(&self) -> Result<Proven, IdentifyError> {
        let (fitted, judged) = (self.fitted(), self.judged());
        let model = Model::default_for(fitted[0].dataset);
        let takes = |s: &Sample| Use::Validation.takes(s);
        let q = self.judged.samples.iter().filter(|s| takes(s)).map(|s| s.q.clone()).collect();
        let poses = WorkspacePoses { q, source: PoseSource::Validation };
        let began = Instant::now();
        let ladder = ladder(&fitted, &model, HoldOut { poses: &poses, checks: &[], worker: None })?;
        let seconds = began.elapsed().as_secs_f64();
        let errors = |c: &Calibration| -> Result<Option<Validation>, IdentifyError> {
            Ok(Validation::of(&self.as_judged(c).predict(&judged, Use::Validation)?))
        };
        let (first, advised) = (ladder.first(), ladder.recommended());
        let measured = [errors(&first.calibration)?, errors(&advised.calibration)?];
        let geometry = identify(&fitted, &Model::geometry()).and_then(|c| errors(&c)).ok().flatten();
        let rms = |v: &Option<Validation>| v.as_ref().map_or(f64::NAN, |v| v.rms / MM);
        let postures = [Postures::of(&fitted, |s| Use::Fit.takes(s)).count(), Postures::of(&judged, takes).count()];
        let predicted =
            [first, advised].map(|r| r.workspace.as_ref().filter(|w| !w.at_least).map(WorkspaceError::mean_as_measured));
        let over = |k: usize| {
            let measured = measured[k].as_ref().filter(|_| postures[1] >= LEAST_JUDGED)?;
            Some(predicted[k]? / measured.mean)
        };
        let proof = Proof {
            robot: self.robot.into(),
            fold: self.fold.clone(),
            division: self.division,
            postures,
            geometry_mm: geometry.map(|v| v.rms / MM),
            default_mm: rms(&measured[0]),
            recommended_mm: rms(&measured[1]),
            kind: ladder.kind().name(),
            predicted_over_measured: [over(0), over(1)],
            verdict: first.diagnosis.verdict.name(),
            seconds,
            rows: None,
        };
        Ok(Proven { proof, default: first.calibration.clone(), recommended: advised.calibration.clone() })
    }
}

/// Summary of all proofs.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Number of divisions.
    pub proofs: usize,
    /// Mean ratio of recommended to default.
    pub mean_ratio: f64,
    /// Largest ratio.
    pub worst_ratio: f64,
    /// Share of ratios of at most 1.02.
    pub harmless: f64,
    /// Share of predicted over measured from 0.8 to 1.25: default model, recommended model.
    pub predictions_fair: [f64; 2],
}

impl Summary {
    /// Summarises proofs.
    pub fn of(proofs: &[Proof]) -> Self {
        let ratios: Vec<f64> = proofs.iter().map(Proof::ratio).filter(|r| r.is_finite()).collect();
        let n = ratios.len().max(1) as f64;
        let fair = |k: usize| {
            let known: Vec<f64> = proofs.iter().filter_map(|p| p.predicted_over_measured[k]).collect();
            known.iter().filter(|r| (0.8..=1.25).contains(*r)).count() as f64 / known.len().max(1) as f64
        };
        Summary {
            proofs: proofs.len(),
            mean_ratio: ratios.iter().sum::<f64>() / n,
            worst_ratio: ratios.iter().copied().fold(0.0, f64::max),
            harmless: ratios.iter().filter(|r| **r <= 1.02).count() as f64 / n,
            predictions_fair: [fair(0), fair(1)],
        }
    }
}
