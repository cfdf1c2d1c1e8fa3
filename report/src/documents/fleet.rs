//! `calibench-fleet/1`, printed by `keep fleet`; and what other documents say of a fleet.

use calibench::identify;
use calibench::identify::fleet::FleetJudged;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::format_tag;

format_tag!(FleetFormat, "calibench-fleet/1");

/// Mean and spread of the parameters over robots of one type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fleet {
    /// `calibench-fleet/1`.
    pub format: FleetFormat,
    /// Name of the type.
    pub robot: String,
    /// Number of robots.
    pub robots: usize,
    /// The parameters of their arms.
    pub parameters: Vec<FleetParameter>,
}

/// A parameter of the arm in robots of one type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FleetParameter {
    /// Name.
    pub name: String,
    /// Effect to which it belongs.
    pub effect: String,
    /// Unit of all numbers.
    pub unit: String,
    /// Mean deviation from nominal.
    pub mean: f64,
    /// One sigma of the next robot's deviation about it.
    pub sigma: f64,
    /// Standard deviation from robot to robot.
    pub between: f64,
    /// Plausible size of the catalogue.
    pub plausible: f64,
    /// Number of robots of which it was estimated.
    pub robots: usize,
}

/// Agreement of a robot with its fleet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FleetUsed {
    /// The prior that was used: `fleet`, `none` (the robot is not like it) or `catalogue` (nor do the data suffice alone).
    pub used: String,
    /// Chi-square of the fleet's prior for this robot, as a ratio to its mean over robots of the fleet.
    pub ratio: f64,
    /// Probability of more if the robot is of the fleet.
    pub chance: f64,
    /// Noise of the data in units of that stated.
    pub noise: f64,
}

impl Fleet {
    /// Converts a fleet.
    #[must_use]
    pub fn of(fleet: &identify::fleet::Fleet) -> Self {
        let parameter = |p: &identify::fleet::FleetParameter| {
            let unit = p.unit.si;
            FleetParameter {
                name: p.name.clone(),
                effect: p.effect.clone(),
                unit: p.unit.symbol.into(),
                mean: p.mean / unit,
                sigma: p.sigma / unit,
                between: p.between / unit,
                plausible: p.plausible / unit,
                robots: p.robots,
            }
        };
        let parameters = fleet.parameters.iter().map(parameter).collect();
        Fleet { format: FleetFormat::Current, robot: fleet.robot.clone(), robots: fleet.robots, parameters }
    }
}

impl FleetUsed {
    /// Converts a judgement.
    #[must_use]
    pub fn of(judged: &FleetJudged) -> Self {
        FleetUsed { used: judged.used.name().into(), ratio: judged.ratio, chance: judged.chance, noise: judged.noise }
    }
}
