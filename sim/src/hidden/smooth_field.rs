//! A joint error that varies smoothly, but in no simple way, with two joints: a housing that yields with the posture.

use std::f64::consts::TAU;
use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::{DEG, URAD};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::StandardNormal;
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, scale_to, theta};

/// `theta_J += f(q2, q3)`, a sum of plane waves of random direction, length and phase: a draw from a Gaussian process with a
/// squared exponential covariance (Rahimi, Recht, Random features for large-scale kernel machines, 2007).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct SmoothField {
    /// Size, urad.
    pub rms_urad: f64,
    /// Joint with the error.
    #[serde(default = "two")]
    pub joint: usize,
    /// Range of joint angle over which the error changes, deg.
    #[serde(default = "fifty")]
    pub length_deg: f64,
    /// Whole number: selects the random field.
    #[serde(default)]
    pub seed: u64,
}

fn two() -> usize {
    2
}

fn fifty() -> f64 {
    50.0
}

/// Number of waves: a sum of this many is close to Gaussian.
const WAVES: usize = 24;

struct Wave {
    /// Radians per radian of joints 2 and 3.
    frequency: [f64; 2],
    phase: f64,
}

struct Field {
    joint: usize,
    size: f64,
    waves: Vec<Wave>,
}

impl Field {
    fn at(&self, q: &[f64]) -> f64 {
        let wave = |w: &Wave| (w.frequency[0] * q[1] + w.frequency[1] * q[2] + w.phase).cos();
        self.size * self.waves.iter().map(wave).sum::<f64>()
    }
}

impl Hidden for SmoothField {
    const NAME: &'static str = "smooth_field";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        Self::needs_joints(cell, 3)?;
        let joint = Self::joint("joint", self.joint, 1..=cell.robot.joints())?;
        let length = Self::positive("length_deg", self.length_deg)? * DEG;
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let waves = (0..WAVES)
            .map(|_| {
                let frequency = [0; 2].map(|_| rng.sample::<f64, _>(StandardNormal) / length);
                Wave { frequency, phase: rng.random_range(0.0..TAU) }
            })
            .collect();
        let mut field = Field { joint, size: 1.0, waves };
        field.size = scale_to(self.rms_urad * URAD, &cell.robot, |q| field.at(q));
        Ok(Arc::new(field))
    }
}

impl Flaw for Field {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        moved(theta(self.joint), self.at(at.q));
    }
}
