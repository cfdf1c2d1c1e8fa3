//! A wrist with a compliant housing: the torque at joint 5 twists joints 3 and 4.

use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::URAD;
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, scale_to, theta, torques_at};

/// `theta_4 += k tau_5`, `theta_3 += k tau_5 / 2`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CrossCoupledWrist {
    /// Size at joint 4, urad.
    pub rms_urad: f64,
}

/// Ratio of joint 3 to joint 4: the forearm's gear is the stiffer one.
const AT_JOINT_3: f64 = 0.5;

struct Twist {
    compliance: f64,
}

impl Hidden for CrossCoupledWrist {
    const NAME: &'static str = "cross_coupled_wrist";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        Self::needs_joints(cell, 5)?;
        let mut torques = torques_at(cell);
        let compliance = scale_to(self.rms_urad * URAD, &cell.robot, |q| torques(q, 4));
        Ok(Arc::new(Twist { compliance }))
    }
}

impl Flaw for Twist {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        let twist = self.compliance * at.loads.tau[4];
        moved(theta(3), twist);
        moved(theta(2), AT_JOINT_3 * twist);
    }
}
