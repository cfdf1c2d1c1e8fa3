//! Campaigns that stop when they are enough, beside campaigns of fixed length: probings, and the error that the robot truly has.

use calibench::identify::calibration::IdentifyError;
use calibench::identify::identify;
use calibench::identify::problem::Use;
use calibench::measure::campaign::CampaignObserver;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample, SampleSet};
use calibench::measure::poses::PlannedPose;
use calibench::planning::Adaptive;
use calibench::residuals::Validation;
use calibench::units::MM;
use rayon::prelude::*;
use thiserror::Error;

use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::RunError;
use calibench_sim::scenario::Scenario;
use calibench_sim::session::Session;

/// Reasons why a campaign could not be judged.
#[derive(Debug, Error)]
pub enum AdaptiveError {
    /// The cell was not measured.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The robot was not identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// One campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Campaign {
    /// Number of probings.
    pub probings: usize,
    /// Mean true position error over the validation poses, m.
    pub error: f64,
    /// True if an adaptive campaign held its error to be as small as requested.
    pub enough: bool,
}

/// Chooses as it goes.
struct Choosing(Adaptive);

impl CampaignObserver for Choosing {
    fn choose(&mut self, waiting: &[&PlannedPose], samples: &[Sample]) -> Option<usize> {
        self.0.next(waiting, samples).unwrap_or(Some(0))
    }
}

/// Measures that many robots of a scenario, each until the mean error is below `wanted` (m) with a probability of 90 %.
///
/// # Errors
/// When a cell cannot be measured or calibrated.
pub fn adaptive(scenario: &Scenario, robots: usize, wanted: f64, seed: u64) -> Result<Vec<Campaign>, AdaptiveError> {
    let plans = Plans::new(scenario, seed).map_err(RunError::from)?;
    let cell = Dataset { contact_force: scenario.indicators.contact_force(), ..scenario.dataset() };
    let first = Adaptive::new(&cell, &scenario.model, wanted);
    let one = |k: usize| {
        let mut choosing = Choosing(first.clone());
        let campaign = campaign(scenario, &plans, Streams { seed, trial: 1 + k as u64 }, &mut choosing)?;
        Ok(Campaign { enough: choosing.0.is_enough(), ..campaign })
    };
    (0..robots).into_par_iter().map(one).collect()
}

/// Measures that many robots of a scenario by its whole plan.
///
/// # Errors
/// When a cell cannot be measured or calibrated.
pub fn fixed(scenario: &Scenario, robots: usize, seed: u64) -> Result<Vec<Campaign>, AdaptiveError> {
    let plans = Plans::new(scenario, seed).map_err(RunError::from)?;
    let one = |k: usize| campaign(scenario, &plans, Streams { seed, trial: 1 + k as u64 }, &mut ());
    (0..robots).into_par_iter().map(one).collect()
}

fn campaign(
    scenario: &Scenario,
    plans: &Plans,
    streams: Streams,
    observer: &mut dyn CampaignObserver,
) -> Result<Campaign, AdaptiveError> {
    let session = Session::begin(scenario, streams, plans.session_s(scenario)).map_err(RunError::from)?;
    let cell = Dataset { contact_force: scenario.indicators.contact_force(), ..scenario.dataset() };
    let record = session.probe(&plans.plan.probing, None, observer);
    if let Some(abort) = record.aborted {
        return Err(RunError::from(abort).into());
    }
    let probings = record.samples.len();
    let measured = Dataset { samples: record.samples, ..cell.clone() };
    let calibration = identify(&[NamedDataset::new("campaign", &measured)], &scenario.model)?;
    let tracker = session.set_up_tracker().map_err(RunError::from)?;
    let points = session.points(&tracker, &plans.tracker.validation, "v", SampleSet::Validation).map_err(RunError::from)?;
    let at_truth = |(sample, at): (Sample, _)| Sample { measured: Measured::Point(at), ..sample };
    let truth = Dataset { samples: points.samples.into_iter().zip(points.truth).map(at_truth).collect(), ..cell };
    let prediction = calibration.predict(&[NamedDataset::new("campaign", &truth)], Use::Validation)?;
    let error = Validation::of(&prediction).map_or(f64::NAN, |v| v.mean);
    Ok(Campaign { probings, error, enough: false })
}

/// Campaigns in figures: mean number of probings, mean error (mm), and the share whose error is below `wanted` (m).
pub fn figures(campaigns: &[Campaign], wanted: f64) -> [f64; 3] {
    let count = campaigns.len().max(1) as f64;
    let mean = |of: fn(&Campaign) -> f64| campaigns.iter().map(of).sum::<f64>() / count;
    let below = campaigns.iter().filter(|c| c.error <= wanted).count() as f64 / count;
    [mean(|c| c.probings as f64), mean(|c| c.error / MM), below]
}
