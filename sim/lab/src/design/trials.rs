//! Verification of a prediction: the simulated cell with the artifact in it, measured and calibrated repeatedly.

use calibench::identify::identify;
use calibench::identify::problem::Use;
use calibench::measure::dataset::{Measured, NamedDataset};
use calibench::units::UM;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde::Serialize;

use super::place_information::{Predicted, Workspace};
use calibench_sim::planning::{Plan, Tour, TrackerPlan};
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{RunError, measure_all};
use calibench_sim::scenario::Scenario;

/// Half-width of a 95 % interval, in standard errors.
const HALF_WIDTH: f64 = 1.96;

/// Predicted and measured rms over trials, um: distance of the calibrated robot's TCP from the true one, which also includes
/// the momentary joint errors invisible to the encoders.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Held {
    /// Predicted from the uncertainty of the calibration and the joint errors invisible to the encoders.
    pub predicted_um: f64,
    /// Measured in the trials.
    pub measured_um: f64,
    /// 95 % band of the measured rms for infinitely many trials.
    pub band_um: [f64; 2],
}

impl Held {
    /// Computes both rms values from the predicted mean square and the mean squares of the trials, m².
    fn of(predicted: f64, squares: &[f64]) -> Self {
        let n = squares.len() as f64;
        let mean = squares.iter().sum::<f64>() / n;
        let variance = squares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        let half = HALF_WIDTH * (variance / n).sqrt();
        let root = |square: f64| square.max(0.0).sqrt() / UM;
        Held { predicted_um: root(predicted), measured_um: root(mean), band_um: [root(mean - half), root(mean + half)] }
    }
}

/// Trials of one artifact.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verified {
    /// Number of completed trials.
    pub trials: usize,
    /// Number of failed trials.
    pub failed: usize,
    /// Over all poses of the workspace.
    pub rms: Held,
    /// At the pose predicted to be the worst.
    pub worst: Held,
}

/// The trials of a verification.
#[derive(Debug, Clone, Copy)]
pub struct Trials {
    /// Seed of all.
    pub seed: u64,
    /// Their number.
    pub count: u64,
}

/// Runs a scenario `trials.count` times on this plan and judges it at the poses of the workspace; `done` is called after each trial.
/// `None` if no trial was completed.
pub fn verify(
    scenario: &Scenario,
    plan: &Plan,
    workspace: &Workspace,
    predicted: &Predicted,
    trials: Trials,
    done: &(dyn Fn() + Sync),
) -> Option<Verified> {
    // The tracker is used for judging only.
    let (identification, points) = (Tour::default(), Tour::default());
    let validation = Tour::direct(workspace.poses.clone());
    let tracker = TrackerPlan { identification, points, validation, chosen: plan.chosen.clone() };
    // An artifact is designed for the gauge alone.
    let plans = Plans { plan: plan.clone(), tracker, rival: Vec::new() };
    let Trials { seed, count } = trials;
    let errors: Vec<Option<Vec<f64>>> = (0..count)
        .into_par_iter()
        .map(|trial| {
            let errors = squared_errors(scenario, &plans, Streams { seed, trial }).ok();
            done();
            errors
        })
        .collect();
    let errors: Vec<Vec<f64>> = errors.into_iter().flatten().collect();
    if errors.is_empty() {
        return None;
    }
    let variance: Vec<f64> = predicted.sigma.iter().zip(&workspace.unseen).map(|(s, u)| s * s + u).collect();
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let worst = predicted.worst().1;
    Some(Verified {
        trials: errors.len(),
        failed: count as usize - errors.len(),
        rms: Held::of(mean(&variance), &errors.iter().map(|e| mean(e)).collect::<Vec<f64>>()),
        worst: Held::of(variance[worst], &errors.iter().map(|e| e[worst]).collect::<Vec<f64>>()),
    })
}

/// Squared distance of the calibrated TCP from the true one at each validation pose, m².
fn squared_errors(scenario: &Scenario, plans: &Plans, streams: Streams) -> Result<Vec<f64>, RunError> {
    let measured = measure_all(scenario, streams, plans, &mut ())?;
    let calibration = identify(&[NamedDataset::new("trical", &measured.fit)], &scenario.model)?;
    let prediction = calibration.predict(&[NamedDataset::new("validation", &measured.validation)], Use::Validation)?;
    let points = measured.validation.samples.iter().map(|s| match &s.measured {
        Measured::Point(point) => *point,
        _ => Vector3::zeros(),
    });
    let pairs = prediction.residuals.iter().zip(points.zip(&measured.validation_truth));
    Ok(pairs.map(|(residual, (point, truth))| (residual - (point - truth)).norm_squared()).collect())
}
