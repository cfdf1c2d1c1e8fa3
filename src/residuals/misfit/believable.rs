//! Implausible corrections in an identified model.

use crate::effects::EffectId;
use crate::effects::{self, Subject};
use crate::identify::calibration::{Calibration, Estimate};
use crate::units::Unit;

use super::expected::{REACH_OF_CATALOGUE, reach};

/// A link correction of more than this many plausible sizes is a mistake in the data, not geometry: 10 deg, or 60 mm on
/// an arm with a reach of 0.7 m.
const MOST_SIZES: f64 = 200.0;
/// Number of standard deviations by which it must exceed that size.
const SIGMAS: f64 = 3.0;

/// A correction of implausible size.
#[derive(Debug, Clone, PartialEq)]
pub struct Unbelievable {
    /// Name of the parameter.
    pub parameter: String,
    /// Deviation from nominal, SI.
    pub deviation: f64,
    /// Absolute deviation in plausible sizes of this robot.
    pub sizes: f64,
    /// Unit in which it is shown.
    pub unit: Unit,
}

/// Lists corrections of the links' geometry that no real arm has, largest first: the model has absorbed the data
/// instead of explaining them.
///
/// Directions that the data hardly determine may deviate far, so a correction counts only if it exceeds the limit by
/// three standard deviations.
pub fn unbelievable(calibration: &Calibration) -> Vec<Unbelievable> {
    let subject = Subject::new(&calibration.robot, &[]);
    let Ok(mdh) = effects::build(EffectId::MDH, &subject) else { return Vec::new() };
    let lengths = (reach(&calibration.robot) / REACH_OF_CATALOGUE).max(1.0);
    let judge = |e: &Estimate| {
        let spec = mdh.parameters().iter().find(|p| p.name == e.name)?;
        let size = if spec.unit == Unit::MM { spec.prior * lengths } else { spec.prior };
        let deviation = e.value - e.nominal;
        let beyond = deviation.abs() - SIGMAS * e.sigma > MOST_SIZES * size;
        let (parameter, sizes) = (e.name.clone(), deviation.abs() / size);
        beyond.then_some(Unbelievable { parameter, deviation, sizes, unit: e.unit })
    };
    let mut all: Vec<Unbelievable> =
        calibration.estimates.iter().filter(|e| e.effect == EffectId::MDH).filter_map(judge).collect();
    all.sort_by(|a, b| b.sizes.total_cmp(&a.sizes));
    all
}
