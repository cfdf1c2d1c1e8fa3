//! A dent in a gear: a joint error near one angle only.

use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::{DEG, URAD};
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, scale_to, theta};

/// `theta_J += a exp(-((q_J - centre) / width)² / 2)`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct GearDefect {
    /// Size; the bump itself is several times higher, urad.
    pub rms_urad: f64,
    /// Joint with the error.
    #[serde(default = "three")]
    pub joint: usize,
    /// Joint angle of the bump, deg.
    #[serde(default = "sixty")]
    pub centre_deg: f64,
    /// Standard deviation of the bump, deg.
    #[serde(default = "ten")]
    pub width_deg: f64,
}

fn three() -> usize {
    3
}

fn sixty() -> f64 {
    60.0
}

fn ten() -> f64 {
    10.0
}

#[derive(Clone, Copy)]
struct Bump {
    joint: usize,
    height: f64,
    centre: f64,
    width: f64,
}

impl Bump {
    fn at(&self, q: &[f64]) -> f64 {
        self.height * (-0.5 * ((q[self.joint] - self.centre) / self.width).powi(2)).exp()
    }
}

impl Hidden for GearDefect {
    const NAME: &'static str = "gear_defect";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        let joint = Self::joint("joint", self.joint, 1..=cell.robot.joints())?;
        let width = Self::positive("width_deg", self.width_deg)? * DEG;
        let unit = Bump { joint, height: 1.0, centre: self.centre_deg * DEG, width };
        let height = scale_to(self.rms_urad * URAD, &cell.robot, |q| unit.at(q));
        Ok(Arc::new(Bump { height, ..unit }))
    }
}

impl Flaw for Bump {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        moved(theta(self.joint), self.at(at.q));
    }
}
