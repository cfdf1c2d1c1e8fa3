//! `joint_compliance`, `joint_compliance:J`: the gearbox twists under gravity, `theta_J += c_J tau_J` (paper section 5).
//!
//! tau_J is the moment of the load about +z_J, so a gearbox that gives way has c_J > 0; a negative estimate is not physical.

use super::{Effect, EffectError, Family, Id, Needs, ParameterSpec, Situation, Subject};
use crate::robot::{MdhEntry, Site};
use crate::units::Unit;

pub(super) const FAMILY: Family = Family {
    id: "joint_compliance",
    arguments: ":J",
    what: "gearboxes twist under gravity",
    equation: "theta_J += c_J tau_J",
    build,
};

/// Plausible size: a few thousandths of a degree per newton metre (paper Table 8 spans 3 to 28), SI.
const PRIOR_MDEG_PER_NM: f64 = 10.0;

struct JointCompliance {
    id: String,
    joints: Vec<usize>,
    parameters: Vec<ParameterSpec>,
}

fn build(id: &Id<'_>, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    let joints = id.joints(subject)?;
    let unit = Unit::MDEG_PER_NM;
    let parameters =
        joints.iter().map(|j| ParameterSpec::new(format!("c{}", j + 1), unit, unit.to_si(PRIOR_MDEG_PER_NM))).collect();
    Ok(Box::new(JointCompliance { id: id.whole.into(), joints, parameters }))
}

impl Effect for JointCompliance {
    fn id(&self) -> &str {
        &self.id
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn needs(&self) -> &[Needs] {
        &[Needs::Masses]
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut dyn FnMut(usize, Site, f64)) {
        for (k, &j) in self.joints.iter().enumerate() {
            emit(k, Site::Mdh(j, MdhEntry::Theta), at.loads.tau[j]);
        }
    }
}
