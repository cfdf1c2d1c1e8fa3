//! Prior knowledge of a parameter, as a row of the least-squares problem.

use super::{Parameter, Prior};
use crate::identify::Model;
use crate::identify::fleet::FleetPrior;

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
    /// The rows of a fleet's prior; the parameters that have one are marked so.
    pub fn of(parameters: &mut [Parameter], model: &Model) -> Vec<PriorRow> {
        let Some(prior) = &model.fleet else { return Vec::new() };
        let FleetPrior { noise, .. } = **prior;
        let row = |(k, p): (usize, &mut Parameter)| {
            // An effect that not every model holds has its size, not its value, from the fleet.
            let of_arm = p.owner == crate::effects::Owner::Robot && model.is_unregularised(&p.effect);
            let [mean, sigma] = prior.about(&p.spec).filter(|_| of_arm && p.knowledge == Prior::Uninformative)?;
            p.knowledge = Prior::Fleet(sigma);
            Some(PriorRow { parameter: k, mean, weight: noise / sigma })
        };
        parameters.iter_mut().enumerate().filter_map(row).collect()
    }
}
