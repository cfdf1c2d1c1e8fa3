//! Truth against estimate: the only place where they meet.

use std::collections::BTreeMap;

use calibench::identify::Calibration;

use crate::scenario::Scenario;

/// One parameter, as it is and as it was found, SI.
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

/// How well the parameters were found.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// Every estimated parameter that the scenario's truth states, the rest being as drawn.
    pub parameters: Vec<ScoredParameter>,
}

impl Score {
    /// Compares a calibration with the sizes that the scenario states (drawn ones are not compared).
    pub fn of(calibration: &Calibration, scenario: &Scenario) -> Self {
        // Checked when the scenario was read.
        let effects = scenario.true_effects(&mut |_, _| f64::NAN).unwrap_or_default();
        let truth: BTreeMap<String, f64> = effects
            .iter()
            .flat_map(|e| e.effect.parameters().iter().map(|p| p.name.clone()).zip(e.sizes.iter().copied()))
            .collect();
        let parameters = calibration
            .estimates
            .iter()
            .filter(|e| e.stated_sigma.is_none())
            .map(|e| ScoredParameter {
                name: e.name.clone(),
                truth: e.nominal + truth.get(&e.name).copied().unwrap_or(0.0),
                estimate: e.value,
                sigma: e.sigma,
            })
            .filter(|p| p.truth.is_finite())
            .collect();
        Score { parameters }
    }

    /// Share of the parameters within so many sigma of the truth.
    pub fn within(&self, sigmas: f64) -> f64 {
        let inside = self.parameters.iter().filter(|p| p.z().abs() <= sigmas).count();
        inside as f64 / self.parameters.len().max(1) as f64
    }
}
