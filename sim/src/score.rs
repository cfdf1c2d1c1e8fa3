//! Comparison of estimates with the ground truth: the only place where they meet.

use std::collections::BTreeMap;

use calibench::identify::calibration::Calibration;

use crate::scenario::{Scenario, StatedEffect};

/// A parameter with true value and estimate, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoredParameter {
    /// Name.
    pub name: String,
    /// True value.
    pub truth: f64,
    /// Estimate.
    pub estimate: f64,
    /// Its one-sigma.
    pub sigma: f64,
}

impl ScoredParameter {
    /// Error in units of sigma.
    pub fn z(&self) -> f64 {
        (self.estimate - self.truth) / self.sigma
    }
}

/// Accuracy of the estimated parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// All estimated parameters stated by the scenario's truth; the others are nominal.
    pub parameters: Vec<ScoredParameter>,
}

impl Score {
    /// Compares a calibration with the sizes stated by the scenario (sampled ones are not compared).
    pub fn of(calibration: &Calibration, scenario: &Scenario) -> Self {
        let truth: BTreeMap<&str, Option<f64>> = scenario.truth().effects().iter().flat_map(StatedEffect::parameters).collect();
        let parameters = calibration
            .estimates
            .iter()
            .filter(|e| e.stated_sigma.is_none())
            .filter_map(|e| {
                let size = truth.get(e.name.as_str()).copied().unwrap_or(Some(0.0))?;
                Some(ScoredParameter { name: e.name.clone(), truth: e.nominal + size, estimate: e.value, sigma: e.sigma })
            })
            .collect();
        Score { parameters }
    }

    /// Compares a calibration by tracker alone with the stated sizes. The tracker's world is the frame of its nests as
    /// measured, whose error the stated noise does not include: its base differs from that of the truth, and is not
    /// compared.
    pub fn of_tracker(calibration: &Calibration, scenario: &Scenario) -> Self {
        let mut score = Score::of(calibration, scenario);
        score.parameters.retain(|p| !p.name.starts_with("base_"));
        score
    }

    /// Share of the parameters within this many sigma of the truth.
    pub fn within(&self, sigmas: f64) -> f64 {
        let inside = self.parameters.iter().filter(|p| p.z().abs() <= sigmas).count();
        inside as f64 / self.parameters.len().max(1) as f64
    }
}
