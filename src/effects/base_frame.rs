//! `base_frame`: where the robot stands in the world. `T_W0(chi) = Tr(x, y, z) Rz Ry Rx` (paper Eq. 2), six numbers.

use super::{Effect, EffectError, Family, Id, Owner, ParameterSpec, Situation, Subject};
use crate::robot::{Axis6, Site};
use crate::units::{DEG, MM, Unit};

pub(super) const FAMILY: Family = Family {
    id: "base_frame",
    arguments: "",
    what: "the robot stands elsewhere than on the drawing of the cell",
    equation: "chi_B += (x, y, z, rz, ry, rx)",
    build,
};

struct BaseFrame {
    parameters: Vec<ParameterSpec>,
}

fn build(id: &Id<'_>, _: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    id.at_most(0)?;
    let parameters = Axis6::ALL
        .iter()
        .map(|axis| {
            let (unit, prior) = if (*axis as usize) < 3 { (Unit::MM, MM) } else { (Unit::DEG, 0.1 * DEG) };
            ParameterSpec::new(format!("base_{}", axis.name()), unit, prior)
        })
        .collect();
    Ok(Box::new(BaseFrame { parameters }))
}

impl Effect for BaseFrame {
    fn id(&self) -> &str {
        "base_frame"
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn owner(&self) -> Owner {
        Owner::Session
    }

    fn terms(&self, _: &Situation<'_>, emit: &mut dyn FnMut(usize, Site, f64)) {
        for (k, axis) in Axis6::ALL.into_iter().enumerate() {
            emit(k, Site::Base(axis), 1.0);
        }
    }
}
