//! A joint error with three periods per turn: three planets or three screws of a flange.

use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::{DEG, URAD};
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, scale_to, theta};

/// `theta_J += a sin(3 q_J + phase)`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ThirdHarmonic {
    /// Size, urad.
    pub rms_urad: f64,
    /// Joint with the error.
    #[serde(default = "two")]
    pub joint: usize,
    /// Phase at joint angle zero, deg.
    #[serde(default)]
    pub phase_deg: f64,
}

fn two() -> usize {
    2
}

struct Wave {
    joint: usize,
    amplitude: f64,
    phase: f64,
}

impl Hidden for ThirdHarmonic {
    const NAME: &'static str = "third_harmonic";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        let joint = Self::joint("joint", self.joint, 1..=cell.robot.joints())?;
        let phase = self.phase_deg * DEG;
        let amplitude = scale_to(self.rms_urad * URAD, &cell.robot, |q| (3.0 * q[joint] + phase).sin());
        Ok(Arc::new(Wave { joint, amplitude, phase }))
    }
}

impl Flaw for Wave {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        moved(theta(self.joint), self.amplitude * (3.0 * at.q[self.joint] + self.phase).sin());
    }
}
