//! A ball that was knocked during the campaign, and is displaced from then on.

use std::sync::Arc;

use calibench::effects::situation::Situation;
use calibench::measure::dataset::Dataset;
use calibench::robot::sites::Site;
use calibench::units::MM;
use serde::Deserialize;

use super::{Flaw, Hidden, HiddenFlaw, Misfit};

/// `ball += (x, y, z)` after a share of the session.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct MovedBall {
    /// Its name.
    pub ball: String,
    /// Time of the knock, as a share of the session, 0 to 1.
    #[serde(default = "half")]
    pub at_share: f64,
    /// Displacement, world frame, mm.
    #[serde(default)]
    pub x_mm: f64,
    /// The same along y, mm.
    #[serde(default)]
    pub y_mm: f64,
    /// The same along z, mm.
    #[serde(default)]
    pub z_mm: f64,
}

fn half() -> f64 {
    0.5
}

impl MovedBall {
    /// Description of the flaw.
    pub(super) fn listed(&self) -> HiddenFlaw {
        let length = (self.x_mm.powi(2) + self.y_mm.powi(2) + self.z_mm.powi(2)).sqrt();
        let size = format!("ball {} by {length:.3} mm at {:.0} % of the session", self.ball, 100.0 * self.at_share);
        HiddenFlaw { name: Self::NAME, size, joints: Vec::new() }
    }
}

struct Knocked {
    ball: usize,
    at_share: f64,
    by: [f64; 3],
}

impl Hidden for MovedBall {
    const NAME: &'static str = "moved_ball";

    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit> {
        let balls = cell.ball_ids();
        let Some(ball) = balls.iter().position(|b| *b == self.ball) else {
            let remedy = format!("name one of: {}", balls.join(", "));
            return Err(Self::misfit("ball", format!("'{}' is not a ball", self.ball), remedy));
        };
        if !(0.0..=1.0).contains(&self.at_share) {
            let problem = format!("is {}", self.at_share);
            return Err(Self::misfit("at_share", problem, "give a share of the session from 0 to 1".into()));
        }
        Ok(Arc::new(Knocked { ball, at_share: self.at_share, by: [self.x_mm, self.y_mm, self.z_mm].map(|v| v * MM) }))
    }
}

impl Flaw for Knocked {
    fn moves(&self, at: &Situation<'_>, moved: &mut dyn FnMut(Site, f64)) {
        if at.ball() == Some(self.ball) && at.share_of_session().is_some_and(|share| share > self.at_share) {
            self.by.iter().enumerate().for_each(|(k, by)| moved(Site::target(k), *by));
        }
    }
}
