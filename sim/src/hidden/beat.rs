//! Two waves of almost equal pitch in a joint, neither with a whole number of periods per turn: a timing belt and the
//! gear behind it.

use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::URAD;
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, scale_to, theta};

/// `theta_J += a (sin(n1 q_J) + sin(n2 q_J))`, with n1 and n2 periods per turn.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Beat {
    /// Size, urad.
    pub rms_urad: f64,
    /// Joint with the error.
    #[serde(default = "two")]
    pub joint: usize,
    /// Periods per turn of the two waves.
    #[serde(default = "pitches")]
    pub per_turn: [f64; 2],
}

fn two() -> usize {
    2
}

/// Not whole numbers: a scan over whole orders finds neither.
fn pitches() -> [f64; 2] {
    [5.37, 5.79]
}

struct Waves {
    joint: usize,
    size: f64,
    per_turn: [f64; 2],
}

impl Waves {
    fn at(&self, q: &[f64]) -> f64 {
        self.size * self.per_turn.iter().map(|n| (n * q[self.joint]).sin()).sum::<f64>()
    }
}

impl Hidden for Beat {
    const NAME: &'static str = "beat";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        let joint = Self::joint("joint", self.joint, 1..=cell.robot.joints())?;
        for n in self.per_turn {
            Self::positive("per_turn", n)?;
        }
        let mut waves = Waves { joint, size: 1.0, per_turn: self.per_turn };
        waves.size = scale_to(self.rms_urad * URAD, &cell.robot, |q| waves.at(q));
        Ok(Arc::new(waves))
    }
}

impl Flaw for Waves {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        moved(theta(self.joint), self.at(at.q));
    }
}
