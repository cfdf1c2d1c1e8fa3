//! A fleet as the prior of a fit: every parameter of the arm as if measured, at the mean of its type.

use super::{Fleet, FleetParameter};
use crate::effects::ParameterSpec;
use crate::robot::Robot;

/// A prior of the parameters of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetPrior {
    /// The fleet; `None` for the sizes of the catalogue, about nominal.
    pub fleet: Option<Fleet>,
    /// Factor by which every sigma is widened.
    pub widened: f64,
    /// The noise by which data are weighed, in units of that stated.
    pub noise: f64,
}

impl FleetPrior {
    /// The prior of the next robot of a fleet.
    pub fn of(fleet: &Fleet) -> FleetPrior {
        FleetPrior { fleet: Some(fleet.clone()), widened: 1.0, noise: 1.0 }
    }

    /// The sizes of the catalogue, about nominal.
    pub fn catalogue() -> FleetPrior {
        FleetPrior { fleet: None, widened: 1.0, noise: 1.0 }
    }

    /// Mean and sigma of the deviation of a parameter, SI; `None` if it has no prior. A parameter that no robot of the fleet
    /// determines has none.
    pub(in crate::identify) fn about(&self, spec: &ParameterSpec) -> Option<[f64; 2]> {
        match &self.fleet {
            None => Some([0.0, self.widened * spec.prior]),
            Some(fleet) => fleet.parameter(&spec.name).map(|p| [p.mean, self.widened * p.sigma]),
        }
    }

    /// The size of a parameter of an effect that not every model holds, SI: as large as it is in robots of this type.
    pub(in crate::identify) fn size(&self, name: &str) -> Option<f64> {
        let FleetParameter { mean, sigma, .. } = self.fleet.as_ref()?.parameter(name)?;
        Some(self.widened * mean.hypot(*sigma))
    }

    /// True if it is of this type of robot.
    pub fn is_of(&self, robot: &Robot) -> bool {
        self.fleet.as_ref().is_none_or(|fleet| fleet.is_of(robot))
    }
}
