//! `harmonic1:J`, `harmonic2:J`, `harmonic:J:k`: periodic transmission error, `theta_J += s sin(k q_J) + c cos(k q_J)`.
//!
//! Once per turn is eccentricity of a gear or of the encoder, twice is ovality; k at once or twice the gear ratio is the ripple of
//! the wave generator of a strain-wave gear, of which accuracy classes of about 1 arcmin peak to peak allow tens of microradians.

use super::{Effect, EffectError, Family, Id, ParameterSpec, Situation, Subject};
use crate::robot::{MdhEntry, Site};
use crate::units::{URAD, Unit};

pub(super) const ONCE: Family = Family {
    id: "harmonic1",
    arguments: ":J",
    what: "a joint's transmission errs once per turn (eccentricity)",
    equation: "theta_J += s sin(q_J) + c cos(q_J)",
    build: |id, subject| build(id, subject, 1),
};

pub(super) const TWICE: Family = Family {
    id: "harmonic2",
    arguments: ":J",
    what: "a joint's transmission errs twice per turn (ovality)",
    equation: "theta_J += s sin(2 q_J) + c cos(2 q_J)",
    build: |id, subject| build(id, subject, 2),
};

pub(super) const ANY: Family = Family {
    id: "harmonic",
    arguments: ":J:k",
    what: "a joint's transmission errs k times per turn (gear teeth, strain-wave ripple)",
    equation: "theta_J += s sin(k q_J) + c cos(k q_J)",
    build: |id, subject| build(id, subject, 0),
};

struct Harmonic {
    id: String,
    joints: Vec<usize>,
    order: f64,
    parameters: Vec<ParameterSpec>,
}

/// `order` 0 is read from the id.
fn build(id: &Id<'_>, subject: &Subject<'_>, order: u32) -> Result<Box<dyn Effect>, EffectError> {
    let (joints, order) = if order > 0 {
        (id.joints(subject)?, order)
    } else {
        let k = id.arguments.get(1).and_then(|a| a.parse().ok()).filter(|k| (1..=1000).contains(k));
        id.at_most(2)?;
        (vec![id.joint(0, subject)?], k.ok_or_else(|| id.wrong("ends in a whole number of periods per turn, 1 to 1000"))?)
    };
    let prior = match order {
        1 => 70.0 * URAD,
        2 => 50.0 * URAD,
        _ => 40.0 * URAD,
    };
    let family = id.whole.split(':').next().unwrap_or_default();
    let suffix = if family == "harmonic" { format!(":{order}") } else { String::new() };
    let parameters = joints
        .iter()
        .flat_map(|j| {
            ["sin", "cos"].map(|part| ParameterSpec::new(format!("{family}:{}{suffix}.{part}", j + 1), Unit::URAD, prior))
        })
        .collect();
    Ok(Box::new(Harmonic { id: id.whole.into(), joints, order: f64::from(order), parameters }))
}

impl Effect for Harmonic {
    fn id(&self) -> &str {
        &self.id
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut dyn FnMut(usize, Site, f64)) {
        for (k, &j) in self.joints.iter().enumerate() {
            let (sin, cos) = (self.order * at.q[j]).sin_cos();
            let site = Site::Mdh(j, MdhEntry::Theta);
            emit(2 * k, site, sin);
            emit(2 * k + 1, site, cos);
        }
    }
}
