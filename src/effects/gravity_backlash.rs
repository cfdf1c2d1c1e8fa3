//! `gravity_backlash:J`: lost motion that the load takes up on its side, `theta_J += b tanh(tau_J / tau_0)`.

use super::reference_torque::reference_torque;
use super::{Effect, EffectError, Family, Id, Needs, ParameterSpec, Situation, Subject};
use crate::robot::{MdhEntry, Site};
use crate::units::{URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "gravity_backlash",
    arguments: ":J",
    what: "lost motion is taken up on the side of the load",
    equation: "theta_J += b tanh(tau_J / tau_0)",
    build,
};

/// tau_0 as a share of the largest torque: how much load it takes to close the play.
const CLOSING_SHARE: f64 = 0.05;

struct GravityBacklash {
    id: String,
    joints: Vec<usize>,
    closing: Vec<f64>,
    parameters: Vec<ParameterSpec>,
}

fn build(id: &Id<'_>, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    let joints = id.joints(subject)?;
    let closing = reference_torque(subject.robot).into_iter().map(|t| CLOSING_SHARE * t).collect();
    let parameters =
        joints.iter().map(|j| ParameterSpec::new(format!("gravity_backlash:{}.b", j + 1), Unit::URAD, 60.0 * URAD)).collect();
    Ok(Box::new(GravityBacklash { id: id.whole.into(), joints, closing, parameters }))
}

impl Effect for GravityBacklash {
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
            emit(k, Site::Mdh(j, MdhEntry::Theta), (at.loads.tau[j] / self.closing[j]).tanh());
        }
    }
}
