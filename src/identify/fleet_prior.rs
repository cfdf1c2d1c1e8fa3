//! Prior of a fit from robots of one type: every parameter of the arm enters as if measured, at the mean of its type.

use sha2::{Digest, Sha256};

use crate::effects::ParameterSpec;
use crate::robot::Robot;
use crate::units::Unit;

/// A parameter of the arm in robots of one type.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetParameter {
    /// Its name.
    pub name: String,
    /// The effect to which it belongs.
    pub effect: String,
    /// Unit for people and files.
    pub unit: Unit,
    /// Mean deviation from nominal, SI.
    pub mean: f64,
    /// One sigma of the next robot's deviation about it, SI.
    pub sigma: f64,
    /// Standard deviation from robot to robot, SI.
    pub between: f64,
    /// Plausible size of the catalogue, SI.
    pub plausible: f64,
    /// Number of robots of which it was estimated.
    pub robots: usize,
}

/// Mean and spread of the parameters over robots of one type.
#[derive(Debug, Clone, PartialEq)]
pub struct Fleet {
    /// Name of the type.
    pub robot: String,
    /// SHA-256 of its nominal geometry, hexadecimal.
    pub geometry: String,
    /// Number of robots.
    pub robots: usize,
    /// The parameters of their arms.
    pub parameters: Vec<FleetParameter>,
}

impl Fleet {
    /// The parameter with this name.
    pub fn parameter(&self, name: &str) -> Option<&FleetParameter> {
        self.parameters.iter().find(|p| p.name == name)
    }

    /// True if it is of this type of robot.
    pub fn is_of(&self, robot: &Robot) -> bool {
        self.geometry == geometry(robot)
    }
}

/// A prior of the parameters of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct FleetPrior {
    /// The fleet; `None` for the sizes of the catalogue, about nominal.
    pub fleet: Option<Fleet>,
    /// Factor by which every sigma is widened.
    pub widened: f64,
    /// The noise by which data are weighted, in units of that stated.
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

/// SHA-256 of the numbers of a nominal geometry, rounded to what files keep.
pub(super) fn geometry(robot: &Robot) -> String {
    let mut hash = Sha256::new();
    for link in &robot.links {
        let mdh = &link.mdh;
        for number in [mdh.alpha, mdh.a, mdh.beta, mdh.theta, mdh.d] {
            // Whole nanometres and nanoradians; no -0.
            hash.update(((number * 1e9).round() as i64).to_le_bytes());
        }
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}
