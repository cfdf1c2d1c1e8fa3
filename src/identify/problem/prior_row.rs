//! Prior knowledge of a parameter, as a row of the least-squares problem.

use super::{Parameter, Prior};
use crate::effects::EffectId;
use crate::effects::Owner;
use crate::effects::error_field::SHARE_SIGMA;
use crate::identify::Model;
use crate::identify::fleet_prior::FleetPrior;

/// A parameter as if measured: `mean - value`, whitened.
#[derive(Debug, Clone)]
pub(super) struct PriorRow {
    pub parameter: usize,
    /// Mean of its deviation from nominal, SI.
    pub mean: f64,
    /// One over the sigma, times the noise by which the data are weighted.
    pub weight: f64,
}

impl PriorRow {
    /// The rows of a fleet's prior and of a field of joint errors; the parameters that have one are marked so.
    pub fn of(parameters: &mut [Parameter], model: &Model) -> Vec<PriorRow> {
        let row = |(k, p): (usize, &mut Parameter)| {
            if p.effect == EffectId::ERROR_FIELD {
                p.knowledge = Prior::Fleet(SHARE_SIGMA);
                return Some(PriorRow { parameter: k, mean: 1.0, weight: 1.0 / SHARE_SIGMA });
            }
            let prior = model.fleet.as_ref()?;
            let FleetPrior { noise, .. } = **prior;
            // An effect that not every model holds has its size, not its value, from the fleet.
            let of_arm = p.owner == Owner::Robot && model.is_unregularised(&p.effect);
            let [mean, sigma] = prior.about(&p.spec).filter(|_| of_arm && p.knowledge == Prior::Uninformative)?;
            p.knowledge = Prior::Fleet(sigma);
            Some(PriorRow { parameter: k, mean, weight: noise / sigma })
        };
        parameters.iter_mut().enumerate().filter_map(row).collect()
    }
}

/// Gives the parameters of the arm the widths about nominal that a field of joint errors was found with.
pub(super) fn hold_about_nominal(parameters: &mut [Parameter], model: &Model) {
    let Some(field) = &model.field else { return };
    for p in parameters.iter_mut().filter(|p| p.owner == Owner::Robot && p.knowledge == Prior::Uninformative) {
        if let Some(width) = field.widths.get(&p.spec.name) {
            p.knowledge = Prior::Plausible(width * p.spec.prior);
        }
    }
}
