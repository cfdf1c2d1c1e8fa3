//! After an identification: corrections that no real arm has.

use crate::effects::{self, Subject};
use crate::identify::{Calibration, Estimate};
use crate::units::Unit;

use super::expected::{REACH_OF_CATALOGUE, reach};

/// A correction of a link beyond this many plausible sizes is a slip, not a link: 10 deg, 60 mm on an arm that reaches 0.7 m.
const MOST_SIZES: f64 = 200.0;
/// Standard deviations by which it must be beyond.
const SIGMAS: f64 = 3.0;

/// A correction that is not believable at its size.
#[derive(Debug, Clone, PartialEq)]
pub struct Unbelievable {
    /// Name of the parameter.
    pub parameter: String,
    /// Its deviation from nominal, SI.
    pub deviation: f64,
    /// The same in plausible sizes of this robot.
    pub sizes: f64,
    /// Unit for people.
    pub unit: Unit,
}

/// Corrections of the links' geometry that no real arm has: the data were absorbed, not explained. The largest first.
///
/// Directions that the data hardly tell may go far; only what is beyond by three standard deviations counts.
pub fn unbelievable(calibration: &Calibration) -> Vec<Unbelievable> {
    let subject = Subject::new(&calibration.robot, &[]);
    let Ok(mdh) = effects::build("mdh", &subject) else { return Vec::new() };
    let lengths = (reach(&calibration.robot) / REACH_OF_CATALOGUE).max(1.0);
    let judge = |e: &Estimate| {
        let spec = mdh.parameters().iter().find(|p| p.name == e.name)?;
        let size = if spec.unit == Unit::MM { spec.prior * lengths } else { spec.prior };
        let deviation = e.value - e.nominal;
        let beyond = deviation.abs() - SIGMAS * e.sigma > MOST_SIZES * size;
        let (parameter, sizes) = (e.name.clone(), deviation.abs() / size);
        beyond.then_some(Unbelievable { parameter, deviation, sizes, unit: e.unit })
    };
    let mut all: Vec<Unbelievable> = calibration.estimates.iter().filter(|e| e.effect == "mdh").filter_map(judge).collect();
    all.sort_by(|a, b| b.sizes.total_cmp(&a.sizes));
    all
}
