//! A hose from the forearm to the tool: when taut, it pulls at a wrist joint in proportion to its stretch.

use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::URAD;
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, scale_to, theta};

/// Distance of the hose's rear clamp behind the centre of the wrist, m.
const BEHIND: f64 = 0.15;
/// Distance of the rear clamp from the forearm's axis, m.
const BESIDE: f64 = 0.06;
/// Distance of the front clamp from the centre of the wrist, m.
const BEFORE: f64 = 0.10;

/// Slack length of the hose, m: the straight wrist stretches it by a fifth, the bent wrist lets it hang.
const SLACK: f64 = 0.21;

/// `theta_J -= c k (L - L0) dL/dq_J` while the hose is longer than its slack length, `L(q4, q5)` being the distance
/// between its clamps.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct CableSpring {
    /// Size, urad.
    pub rms_urad: f64,
    /// Joint on which it acts, 4 or 5.
    #[serde(default = "five")]
    pub joint: usize,
}

fn five() -> usize {
    5
}

/// `(L - L0) dL/dq_J`, m²/rad, for J = 4 (index 3) or 5.
fn pull(q: &[f64], joint: usize) -> f64 {
    let ((sin4, cos4), (sin5, cos5)) = (q[3].sin_cos(), q[4].sin_cos());
    let squared = BEFORE * BEFORE + BESIDE * BESIDE + BEHIND * BEHIND - 2.0 * BEFORE * (BESIDE * cos4 * sin5 - BEHIND * cos5);
    let length = squared.sqrt();
    let slope = if joint == 3 { BESIDE * sin4 * sin5 } else { -(BESIDE * cos4 * cos5 + BEHIND * sin5) } * BEFORE / length;
    (length - SLACK).max(0.0) * slope
}

struct Hose {
    joint: usize,
    size: f64,
}

impl Hidden for CableSpring {
    const NAME: &'static str = "cable_spring";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        Self::needs_joints(cell, 5)?;
        let joint = Self::joint("joint", self.joint, 4..=5)?;
        let size = -scale_to(self.rms_urad * URAD, &cell.robot, |q| pull(q, joint));
        Ok(Arc::new(Hose { joint, size }))
    }
}

impl Flaw for Hose {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        moved(theta(self.joint), self.size * pull(at.q, self.joint));
    }
}
