//! Numbers that no arm can have: signs by which a fit says that something else is missing.

use crate::effects::{EffectId, Unphysical};
use crate::identify::{Calibration, Estimate};
use crate::measure::Dataset;
use crate::units::Unit;

/// In how many one-sigmas a number has to be beyond what is possible.
const BEYOND: f64 = 2.0;

/// A number that no arm can have.
#[derive(Debug, Clone, PartialEq)]
pub struct Symptom {
    /// Its parameter.
    pub parameter: String,
    /// The effect of the parameter.
    pub effect: String,
    /// Estimate, SI.
    pub value: f64,
    /// One-sigma, SI.
    pub sigma: f64,
    /// Unit to show it in.
    pub unit: Unit,
    /// What is impossible about it.
    pub unphysical: Unphysical,
}

impl Symptom {
    /// The numbers of a calibration that are impossible by more than two one-sigmas.
    pub fn of(calibration: &Calibration, datasets: &[(&str, &Dataset)]) -> Vec<Self> {
        let heaviest = datasets.iter().flat_map(|(_, d)| d.payloads.iter().map(|p| p.mass)).fold(0.0, f64::max);
        let symptom = |e: &Estimate| {
            let family = calibration.model.family(&e.effect)?;
            let unphysical = family.physical.violated(e.value, BEYOND * e.sigma, heaviest)?;
            Some(Symptom {
                parameter: e.name.clone(),
                effect: e.effect.clone(),
                value: e.value,
                sigma: e.sigma,
                unit: e.unit,
                unphysical,
            })
        };
        calibration.estimates.iter().filter_map(symptom).collect()
    }

    /// The joint that the effect belongs to, counted from 1, where it belongs to one.
    pub fn joint(&self) -> Option<usize> {
        let compliance = || self.parameter.split('@').next().unwrap_or_default().strip_prefix('c');
        match EffectId::new(&self.effect).rest() {
            Some(joint) => joint.parse().ok(),
            None if self.effect == "joint_compliance" => compliance().and_then(|j| j.parse().ok()),
            None => None,
        }
    }
}
