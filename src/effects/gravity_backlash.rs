//! `gravity_backlash:J`: lost motion that the load takes up on its side, `theta_J += b tanh(tau_J / tau_0)`.

use super::family::each_joint;
use super::reference_torque::reference_torque;
use super::shape::{per_joint, theta};
use super::{Family, Needs, Origin, ParameterSpec, Scan};
use crate::units::{URAD, Unit};

pub(super) const FAMILY: Family = Family {
    id: "gravity_backlash",
    arguments: ":J",
    what: "lost motion by the side of the load",
    equation: "theta_J += b tanh(tau_J / tau_0)",
    origin: Origin::Arm,
    scan: Scan::None,
    members: each_joint,
    build: |id, subject| {
        let closing: Vec<f64> = reference_torque(subject.robot).into_iter().map(|t| CLOSING_SHARE * t).collect();
        per_joint(
            id,
            id.joints(subject)?,
            |_, name| vec![ParameterSpec::new(format!("{name}.b"), Unit::URAD, 60.0 * URAD)],
            move |at, j, emit| emit(0, theta(j), (at.loads.tau[j] / closing[j]).tanh()),
        )
        .needs(&[Needs::Torques])
        .built()
    },
};

/// tau_0 as a share of the largest torque: how much load it takes to close the play.
const CLOSING_SHARE: f64 = 0.05;
