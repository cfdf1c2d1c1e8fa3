//! Parameter values that are physically impossible: symptoms of another effect that is missing.

use crate::effects::EffectId;
use crate::effects::facts::Unphysical;
use crate::identify::calibration::{Calibration, Estimate};
use crate::measure::dataset::NamedDataset;
use crate::units::Unit;

/// Number of standard deviations by which a value must exceed the possible range.
const BEYOND: f64 = 2.0;

/// A parameter value that is physically impossible.
#[derive(Debug, Clone, PartialEq)]
pub struct Symptom {
    /// Name of the parameter.
    pub parameter: String,
    /// The effect of the parameter.
    pub effect: EffectId,
    /// Estimate, SI.
    pub value: f64,
    /// One-sigma, SI.
    pub sigma: f64,
    /// Unit in which it is shown.
    pub unit: Unit,
    /// Reason why it is impossible.
    pub unphysical: Unphysical,
}

impl Symptom {
    /// Finds the values of a calibration that are impossible by more than two one-sigmas.
    pub fn of(calibration: &Calibration, datasets: &[NamedDataset<'_>]) -> Vec<Self> {
        let heaviest = datasets.iter().flat_map(|d| d.dataset.payloads.iter().map(|p| p.mass)).fold(0.0, f64::max);
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

    /// The joint that the effect belongs to, counted from 1; `None` if it belongs to none.
    pub fn joint(&self) -> Option<usize> {
        let compliance = || self.parameter.split('@').next().unwrap_or_default().strip_prefix('c');
        match self.effect.rest() {
            Some(joint) => joint.parse().ok(),
            None if self.effect == EffectId::JOINT_COMPLIANCE => compliance().and_then(|j| j.parse().ok()),
            None => None,
        }
    }
}
