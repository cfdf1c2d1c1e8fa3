//! `bearing_tilt:J`: the axis tips under the moment across it, `phi = k (M_J - z_J (z_J . M_J))`, about the origin of frame J.

use super::{Effect, EffectError, Family, Id, Needs, ParameterSpec, Situation, Subject};
use crate::robot::{Axis6, Site};
use crate::units::{URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "bearing_tilt",
    arguments: ":J",
    what: "a joint's axis tips under the moment across it",
    equation: "phi = k (M_J - z_J (z_J . M_J)), about o_J",
    build,
};

struct BearingTilt {
    id: String,
    joints: Vec<usize>,
    parameters: Vec<ParameterSpec>,
}

fn build(id: &Id<'_>, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    let joints = id.joints(subject)?;
    // Cross-roller bearings of a small arm: about 0.3 MN·m/rad near the base, 0.06 in the wrist.
    let prior = |j: usize| if 2 * j < subject.robot.joints() { 3.0 * URAD } else { 15.0 * URAD };
    let parameters =
        joints.iter().map(|&j| ParameterSpec::new(format!("bearing_tilt:{}.k", j + 1), Unit::URAD_PER_NM, prior(j))).collect();
    Ok(Box::new(BearingTilt { id: id.whole.into(), joints, parameters }))
}

impl Effect for BearingTilt {
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
            let moment = at.posture.frame(j + 1).components(&at.loads.moment[j + 1]);
            emit(k, Site::Flex(j + 1, Axis6::Rx), moment.x);
            emit(k, Site::Flex(j + 1, Axis6::Ry), moment.y);
        }
    }
}
