//! The part of an identified arm that can be written as a rigid chain of links, and the size of the remainder.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::calibrated_arm::CalibratedArm;
use crate::effects::EffectId;
use crate::robot::kinematics::Posture;
use crate::robot::sites::SiteIndex;
use crate::robot::{FramePose, Robot};

/// Effects that do not depend on the posture: base, links, TCP.
const RIGID: [&str; 3] = [EffectId::BASE_FRAME, EffectId::MDH, EffectId::TOOL_FRAME];

/// Number of postures at which the remainder is evaluated.
const POSTURES: usize = 1000;

/// Fixed seed.
const SEED: u64 = 0x0019_1d0a;

/// Distance of the TCP of the whole model from that of its rigid part, m, over postures uniform in the joint limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftOut {
    /// Mean.
    pub mean: f64,
    /// Largest.
    pub max: f64,
    /// Number of postures.
    pub postures: usize,
}

/// The rigid part of an identified arm.
#[derive(Debug, Clone)]
pub struct RigidRobot {
    /// The arm with its identified links.
    pub robot: Robot,
    /// Pose of its root in the world.
    pub base: FramePose,
    /// TCP in the last frame.
    pub tool: FramePose,
    /// Effects that a chain of links cannot represent, above all compliance.
    pub effects: Vec<String>,
    /// Their size.
    pub left_out: LeftOut,
}

impl RigidRobot {
    /// The rigid part of an arm with its payload, under its conditions.
    pub fn of(arm: &mut CalibratedArm<'_>) -> Self {
        let nominal = arm.robot();
        let middle: Vec<f64> = nominal.links.iter().map(|l| 0.5 * (l.limits[0] + l.limits[1])).collect();
        arm.settle(&middle);
        let rigid = arm.deviations_of(|id| RIGID.contains(&id));
        let sites = SiteIndex::new(nominal.joints());
        let mut robot = nominal.clone();
        for (i, link) in robot.links.iter_mut().enumerate() {
            let [alpha, a, beta, theta, d] = std::array::from_fn(|k| rigid[sites.link(i) + k]);
            link.mdh.alpha += alpha;
            link.mdh.a += a;
            link.mdh.beta += beta;
            link.mdh.theta += theta;
            link.mdh.d += d;
        }
        let mut tool = *arm.tool();
        tool.xyz.iter_mut().zip(&rigid[sites.tool()..]).for_each(|(x, dx)| *x += dx);
        let effects: Vec<String> =
            arm.needs().map(|(id, _)| id.to_owned()).filter(|id| !RIGID.contains(&id.as_str())).collect();
        let base = FramePose::from_pose(&arm.world_from_root());
        robot.name = format!("{}_calibrated", nominal.name);
        robot.source = format!("identified links of {}: {}", nominal.name, nominal.source);
        let left_out = left_out(arm, &robot, &base, &tool);
        RigidRobot { robot, base, tool, effects, left_out }
    }
}

fn left_out(arm: &mut CalibratedArm<'_>, robot: &Robot, base: &FramePose, tool: &FramePose) -> LeftOut {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut posture = Posture::new(robot);
    let none = vec![0.0; SiteIndex::new(robot.joints()).len()];
    let (mut sum, mut max) = (0.0, 0.0f64);
    for _ in 0..POSTURES {
        let q: Vec<f64> = robot.links.iter().map(|l| random.random_range(l.limits[0]..l.limits[1])).collect();
        arm.settle(&q);
        posture.set(robot, base, tool, &q, &none);
        let apart = (arm.posture().tcp() - posture.tcp()).norm();
        sum += apart;
        max = max.max(apart);
    }
    LeftOut { mean: sum / POSTURES as f64, max, postures: POSTURES }
}
