//! A gear whose stiffness depends on its angle: its wave generator is out of round, so equal torques twist it by
//! unequal angles.

use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::{DEG, URAD};
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, scale_to, theta, torques_at};

/// `theta_J += k tau_J sin(2 q_A + phase)`: a function of an angle and a torque.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PostureSpring {
    /// Size, urad.
    pub rms_urad: f64,
    /// Joint with the error, from 2.
    #[serde(default = "three")]
    pub joint: usize,
    /// The joint whose angle sets the stiffness.
    #[serde(default = "three")]
    pub of: usize,
    /// Phase at angle zero, deg.
    #[serde(default)]
    pub phase_deg: f64,
}

fn three() -> usize {
    3
}

struct Spring {
    joint: usize,
    of: usize,
    phase: f64,
    /// rad/(N·m)
    compliance: f64,
}

impl Spring {
    fn twist(&self, q: &[f64], torque: f64) -> f64 {
        self.compliance * torque * (2.0 * q[self.of] + self.phase).sin()
    }
}

impl Hidden for PostureSpring {
    const NAME: &'static str = "posture_spring";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        let joints = cell.robot.joints();
        let joint = Self::joint("joint", self.joint, 2..=joints)?;
        let of = Self::joint("of", self.of, 1..=joints)?;
        let mut spring = Spring { joint, of, phase: self.phase_deg * DEG, compliance: 1.0 };
        let mut torques = torques_at(cell);
        spring.compliance = scale_to(self.rms_urad * URAD, &cell.robot, |q| spring.twist(q, torques(q, joint)));
        Ok(Arc::new(spring))
    }
}

impl Flaw for Spring {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        moved(theta(self.joint), self.twist(at.q, at.loads.tau[self.joint]));
    }
}
