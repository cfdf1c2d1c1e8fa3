//! A joint error proportional to the product of two joint angles: a casting that yields where two loads act on it together.

use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::Robot;
use calibench::robot::sites::Site;
use calibench::units::URAD;
use serde::Deserialize;

use super::{Flaw, Hidden, Misfit, middle, scale_to, theta};

/// `theta_J += k (q_A - middle of A) (q_B - middle of B)`, the middles being those of the joint limits: not a wave, but a
/// saddle over two angles, which no function of one angle resembles.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct BilinearCoupling {
    /// Size, urad.
    pub rms_urad: f64,
    /// Joint with the error.
    #[serde(default = "three")]
    pub joint: usize,
    /// The two joints.
    #[serde(default = "two_and_five")]
    pub of: [usize; 2],
}

fn three() -> usize {
    3
}

fn two_and_five() -> [usize; 2] {
    [2, 5]
}

struct Saddle {
    joint: usize,
    size: f64,
    of: [usize; 2],
    middle: [f64; 2],
}

impl Saddle {
    fn at(&self, q: &[f64]) -> f64 {
        self.size * (q[self.of[0]] - self.middle[0]) * (q[self.of[1]] - self.middle[1])
    }
}

impl Hidden for BilinearCoupling {
    const NAME: &'static str = "bilinear_coupling";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        let robot: &Robot = &cell.robot;
        let all = || 1..=robot.joints();
        let joint = Self::joint("joint", self.joint, all())?;
        let of = [Self::joint("of[0]", self.of[0], all())?, Self::joint("of[1]", self.of[1], all())?];
        if of[0] == of[1] {
            return Err(Self::misfit("of", format!("names joint {} twice", self.of[0]), "name two joints".into()));
        }
        let mut saddle = Saddle { joint, size: 1.0, of, middle: of.map(|j| middle(robot, j)) };
        saddle.size = scale_to(self.rms_urad * URAD, robot, |q| saddle.at(q));
        Ok(Arc::new(saddle))
    }
}

impl Flaw for Saddle {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        moved(theta(self.joint), self.at(at.q));
    }
}
