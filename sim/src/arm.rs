//! The arm as it really is: injected errors of any size, at rest under gravity and whatever pushes at its tool.

use std::sync::Arc;

use calibench::effects::{ArtifactShape, Kind, Situation};
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
    /// Balls of the cell as certified, world, m.
    pub balls: Vec<Vector3<f64>>,
    /// Length of a session, s: what builds up over one is there as stated after that time.
    pub session_s: f64,
    compliance: Vec<f64>,
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
    /// Sign of each plunger's last motion.
    pub plungers: Option<[i8; 3]>,
    /// Where the joints were sent, rad.
    pub commanded: Option<&'a [f64]>,
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
        let compliance = compliance(&robot, &flaws);
        let (balls, session_s) = (Vec::new(), 0.0);
        Arm { robot, base, tool, payload, gravity, flaws, balls, session_s, compliance, posture, loads, deviations }
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
            compliance: &self.compliance,
            // Where no ball is, a tracker may be looking.
            kind: Some(moment.ball.map_or(Kind::Point, Kind::Ball)),
            target: Some(moment.ball.and_then(|k| self.balls.get(k)).copied().unwrap_or(self.posture.tcp())),
            artifact: Some(ArtifactShape::of(&self.balls)),
            plungers: moment.plungers,
            q_commanded: moment.commanded,
            approach: moment.approach,
            time_s: Some(moment.time_s),
            duration_s: Some(self.session_s),
            temp_c: Some(moment.temp_c),
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

/// The compliance that each joint truly has, rad/(N·m): of the effects of the catalogue, that in proportion to its torque.
fn compliance(robot: &Robot, flaws: &[Arc<dyn Flaw>]) -> Vec<f64> {
    (1..=robot.joints()).map(|j| flaws.iter().filter_map(|flaw| flaw.size(&format!("c{j}"))).sum()).collect()
}
