//! The arm as it really is: injected errors of any size, at rest under gravity and whatever pushes at its tool.

use std::sync::Arc;

use calibench::effects::Situation;
use calibench::robot::{FramePose, Loads, Payload, Pose, Posture, Robot, Site, SiteIndex};
use nalgebra::Vector3;

use crate::flaw::Flaw;

/// The true arm on its true base with its true tool.
pub struct Arm {
    /// The robot with its true masses; geometry as drawn, deviations come from `flaws`.
    pub robot: Arc<Robot>,
    /// Nominal base; deviations come from `flaws`.
    pub base: FramePose,
    /// True TCP in the last frame.
    pub tool: FramePose,
    /// True payload.
    pub payload: Payload,
    /// Gravity in the world, m/s².
    pub gravity: Vector3<f64>,
    /// What is wrong with the cell.
    pub flaws: Vec<Arc<dyn Flaw>>,
    posture: Posture,
    loads: Loads,
    deviations: Vec<f64>,
}

/// Equilibrium is reached when the TCP moves less than this between two evaluations, m.
const AT_REST: f64 = 1e-13;

/// Each evaluation shrinks the error by the ratio of deflection to arm length (about 1e-3); the limit is never met in practice.
const MOST_EVALUATIONS: usize = 40;

/// What the arm's surroundings are at one moment.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moment<'a> {
    /// Ball being probed, by its place in the artifact.
    pub ball: Option<usize>,
    /// Seconds since the session began.
    pub time_s: f64,
    /// Temperature of the robot, °C.
    pub temp_c: f64,
    /// Sign of each joint's last motion.
    pub approach: Option<&'a [i8]>,
    /// Force on the tool at the TCP, world axes, N.
    pub force: Vector3<f64>,
}

impl Arm {
    /// An arm in a cell with those flaws.
    pub fn new(
        robot: Arc<Robot>,
        base: FramePose,
        tool: FramePose,
        payload: Payload,
        gravity: Vector3<f64>,
        flaws: Vec<Arc<dyn Flaw>>,
    ) -> Self {
        let (posture, loads) = (Posture::new(&robot), Loads::new(robot.joints()));
        let deviations = vec![0.0; SiteIndex::new(robot.joints()).len()];
        Arm { robot, base, tool, payload, gravity, flaws, posture, loads, deviations }
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
            self.deviate(q, moment);
            self.posture.set(&self.robot, &self.base, &self.tool, q, &self.deviations);
        }
        self.posture.world_from_tool(&self.tool)
    }

    /// How far the ball, or where a point is measured, stands from its place, world, m; of the moment at which the arm settled last.
    pub fn target_moved(&self) -> Vector3<f64> {
        let sites = SiteIndex::new(self.robot.joints());
        Vector3::from_fn(|k, _| self.deviations[sites.of(Site::Target(k))])
    }

    /// Finds the deviations of all sites in the present posture.
    fn deviate(&mut self, q: &[f64], moment: &Moment<'_>) {
        let situation = Situation {
            gravity: self.gravity,
            tool: self.tool,
            compliance: &[],
            kind: moment.ball.map(calibench::effects::Kind::Ball),
            time_s: Some(moment.time_s),
            duration_s: Some(1000.0),
            temp_c: Some(moment.temp_c),
            approach: moment.approach,
            ..Situation::at_rest(&self.robot, q, &self.posture, &self.loads, &self.payload)
        };
        let sites = SiteIndex::new(self.robot.joints());
        self.deviations.fill(0.0);
        let deviations = &mut self.deviations;
        for flaw in &self.flaws {
            flaw.moves(&situation, &mut |site, by| deviations[sites.of(site)] += by);
        }
    }
}
