//! A gear cut with a worn hob: within each pitch the error climbs slowly and falls at once.

use std::f64::consts::TAU;
use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::URAD;
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, scale_to, theta};

/// A sawtooth with `teeth` periods per turn that climbs from -1 to 1 over a share `climb` of each pitch and falls over the
/// rest. Its first harmonic holds some 60 % of its mean square, the rest is spread over the others.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct AsymmetricTooth {
    /// Size, urad.
    pub rms_urad: f64,
    /// Joint with the error.
    #[serde(default = "three")]
    pub joint: usize,
    /// Pitches per turn.
    #[serde(default = "nine")]
    pub teeth: u32,
    /// Share of a pitch over which the error rises, 0.01 to 0.99.
    #[serde(default = "mostly")]
    pub climb: f64,
}

fn three() -> usize {
    3
}

fn nine() -> u32 {
    9
}

fn mostly() -> f64 {
    0.95
}

struct Saw {
    joint: usize,
    size: f64,
    teeth: f64,
    climb: f64,
}

impl Saw {
    fn at(&self, q: &[f64]) -> f64 {
        let share = (self.teeth * q[self.joint] / TAU).rem_euclid(1.0);
        let height = if share < self.climb { share / self.climb } else { (1.0 - share) / (1.0 - self.climb) };
        self.size * (2.0 * height - 1.0)
    }
}

impl Hidden for AsymmetricTooth {
    const NAME: &'static str = "asymmetric_tooth";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        let joint = Self::joint("joint", self.joint, 1..=cell.robot.joints())?;
        if self.teeth == 0 {
            return Err(Self::misfit("teeth", "is 0".into(), "give a whole number from 1".into()));
        }
        // At 0 or 1 a flank would be vertical, and an arm on it would find no equilibrium.
        if !(0.01..=0.99).contains(&self.climb) {
            return Err(Self::misfit("climb", format!("is {}", self.climb), "give a share from 0.01 to 0.99".into()));
        }
        let mut saw = Saw { joint, size: 1.0, teeth: f64::from(self.teeth), climb: self.climb };
        saw.size = scale_to(self.rms_urad * URAD, &cell.robot, |q| saw.at(q));
        Ok(Arc::new(saw))
    }
}

impl Flaw for Saw {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        moved(theta(self.joint), self.at(at.q));
    }
}
