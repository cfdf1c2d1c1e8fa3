//! The arm as it really is: injected errors of any size, at rest under gravity and whatever pushes at its tool.

use std::sync::Arc;

use calibench::effects::{Effect, Situation};
use calibench::robot::{FramePose, Loads, Payload, Pose, Posture, Robot, SiteIndex};
use nalgebra::Vector3;

/// An effect with its true size.
pub struct TrueEffect {
    /// Its shape.
    pub effect: Box<dyn Effect>,
    /// Its parameters, SI.
    pub sizes: Vec<f64>,
}

/// The true arm on its true base with its true tool.
pub struct Arm {
    /// The robot with its true masses; geometry as drawn, deviations come from `effects`.
    pub robot: Arc<Robot>,
    /// Nominal base; deviations come from `effects`.
    pub base: FramePose,
    /// True TCP in the last frame.
    pub tool: FramePose,
    /// True payload.
    pub payload: Payload,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// What is wrong with the arm.
    pub effects: Vec<TrueEffect>,
    posture: Posture,
    loads: Loads,
    deviations: Vec<f64>,
    compliance: Vec<f64>,
}

/// Equilibrium is reached when the TCP moves less than this between two evaluations, m.
const AT_REST: f64 = 1e-13;

/// Each evaluation shrinks the error by the ratio of deflection to arm length (about 1e-3); the limit is never met in practice.
const MOST_EVALUATIONS: usize = 40;

/// What the arm's surroundings are at one moment.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moment<'a> {
    /// Seconds since the session began.
    pub time_s: f64,
    /// Sign of each joint's last motion.
    pub approach: Option<&'a [i8]>,
    /// Force on the tool at the TCP, world axes, N.
    pub force: Vector3<f64>,
}

impl Arm {
    /// An arm with those errors.
    pub fn new(
        robot: Arc<Robot>,
        base: FramePose,
        tool: FramePose,
        payload: Payload,
        gravity: Vector3<f64>,
        effects: Vec<TrueEffect>,
    ) -> Self {
        let (posture, loads) = (Posture::new(&robot), Loads::new(robot.joints()));
        let deviations = vec![0.0; SiteIndex::new(robot.joints()).len()];
        let compliance = true_compliance(&robot, &effects);
        Arm { robot, base, tool, payload, gravity, effects, posture, loads, deviations, compliance }
    }

    /// `world_from_tool` with the links at joint angles `q` (rad), at static equilibrium: loads are those of the deflected arm.
    pub fn settle(&mut self, q: &[f64], moment: &Moment<'_>) -> Pose {
        self.deviations.fill(0.0);
        self.posture.set(&self.robot, &self.base, &self.tool, q, &self.deviations);
        let mut tcp = Vector3::repeat(f64::INFINITY);
        for _ in 0..MOST_EVALUATIONS {
            if (self.posture.tcp() - tcp).norm() < AT_REST {
                break;
            }
            tcp = self.posture.tcp();
            self.loads.weigh(&self.robot, &self.posture, &self.payload, &self.gravity, &moment.force);
            let situation = Situation {
                gravity: self.gravity,
                tool: self.tool,
                compliance: &self.compliance,
                time_s: Some(moment.time_s),
                approach: moment.approach,
                ..Situation::at_rest(&self.robot, q, &self.posture, &self.loads, &self.payload)
            };
            let sites = SiteIndex::new(self.robot.joints());
            self.deviations.fill(0.0);
            for TrueEffect { effect, sizes } in &self.effects {
                let deviations = &mut self.deviations;
                effect.terms(&situation, &mut |k, site, weight| deviations[sites.of(site)] += weight * sizes[k]);
            }
            self.posture.set(&self.robot, &self.base, &self.tool, q, &self.deviations);
        }
        self.posture.world_from_tool(&self.tool)
    }
}

/// The compliance that each joint truly has, rad/(N·m): what a unit of torque turns it by, through the effects that are in proportion to it.
fn true_compliance(robot: &Robot, effects: &[TrueEffect]) -> Vec<f64> {
    let size = |name: &str| {
        let of = |e: &TrueEffect| e.effect.parameters().iter().position(|p| p.name == name).map(|k| e.sizes[k]);
        effects.iter().filter_map(of).sum()
    };
    (1..=robot.joints()).map(|j| size(&format!("c{j}"))).collect()
}
