//! `pedestal`: the base tips under the overturning moment, `(rx, ry) += (k_x M_x, k_y M_y)` in the base frame.

use super::{Effect, EffectError, Family, Id, Needs, ParameterSpec, Situation, Subject};
use crate::robot::{Axis6, Site};
use crate::units::{URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "pedestal",
    arguments: "",
    what: "the base tips under the overturning moment",
    equation: "base rotation (x, y) += (k_x M_x, k_y M_y)",
    build,
};

struct Pedestal {
    parameters: Vec<ParameterSpec>,
}

fn build(id: &Id<'_>, _: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    id.at_most(0)?;
    let spec = |axis| ParameterSpec::new(format!("pedestal.{axis}"), Unit::URAD_PER_NM, 2.0 * URAD);
    Ok(Box::new(Pedestal { parameters: vec![spec("x"), spec("y")] }))
}

impl Effect for Pedestal {
    fn id(&self) -> &str {
        "pedestal"
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn needs(&self) -> &[Needs] {
        &[Needs::Masses]
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut dyn FnMut(usize, Site, f64)) {
        let moment = at.posture.frame(0).components(&at.loads.moment[0]);
        emit(0, Site::Flex(0, Axis6::Rx), moment.x);
        emit(1, Site::Flex(0, Axis6::Ry), moment.y);
    }
}
