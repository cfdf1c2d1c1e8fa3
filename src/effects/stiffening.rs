//! `stiffening:J`: compliance that is not linear, `theta_J += k sign(tau_J) |tau_J / tau_ref|³`.
//!
//! Strain-wave gears are stiffer at high torque than at low (catalogues give three slopes), so k is negative for a physical joint.

use super::reference_torque::reference_torque;
use super::{Effect, EffectError, Family, Id, Needs, ParameterSpec, Situation, Subject};
use crate::robot::{MdhEntry, Site};
use crate::units::{DEG, Unit};

pub(super) const FAMILY: Family = Family {
    id: "stiffening",
    arguments: ":J",
    what: "gearboxes grow stiffer (or softer) under load",
    equation: "theta_J += k sign(tau_J) |tau_J / tau_ref|^3",
    build,
};

/// Plausible: 0.15 of the linear deflection at the reference torque, for a compliance of 5 mdeg/(N·m).
const SHARE_OF_LINEAR: f64 = 0.15;
const TYPICAL_COMPLIANCE: f64 = 5e-3 * DEG;

struct Stiffening {
    id: String,
    joints: Vec<usize>,
    reference: Vec<f64>,
    parameters: Vec<ParameterSpec>,
}

fn build(id: &Id<'_>, subject: &Subject<'_>) -> Result<Box<dyn Effect>, EffectError> {
    let joints = id.joints(subject)?;
    let reference = reference_torque(subject.robot);
    let parameters = joints
        .iter()
        .map(|&j| {
            let prior = SHARE_OF_LINEAR * TYPICAL_COMPLIANCE * reference[j];
            ParameterSpec::new(format!("stiffening:{}.k", j + 1), Unit::URAD, prior)
        })
        .collect();
    Ok(Box::new(Stiffening { id: id.whole.into(), joints, reference, parameters }))
}

impl Effect for Stiffening {
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
            let ratio = at.loads.tau[j] / self.reference[j];
            emit(k, Site::Mdh(j, MdhEntry::Theta), ratio * ratio * ratio);
        }
    }
}
