//! Gravity at rest: the moment of the weight about every joint (Newton-Euler without motion).
//!
//! `M_j = sum_{k >= j} (c_k - o_j) x m_k g` and `tau_j = z_j . M_j`: the moment that the load exerts about +z_j,
//! so a gearbox that gives way turns in the direction of tau_j. It is minus the holding torque dU/dq_j.

use nalgebra::Vector3;

use super::{Posture, Robot};

/// Gravity in a world whose z axis points up, where a file does not say, m/s².
pub const DEFAULT_GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// What the flange carries: mass (kg) and its centre in the last frame (m).
#[derive(Debug, Clone, PartialEq)]
pub struct Payload {
    /// Name by which samples refer to it.
    pub name: String,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the last MDH frame, m.
    pub com: Vector3<f64>,
}

impl Payload {
    /// Nothing on the flange.
    pub fn none() -> Self {
        Payload { name: "none".into(), mass: 0.0, com: Vector3::zeros() }
    }
}

/// Loads of one posture at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// Moment of the load about +z of each joint, N·m (N).
    pub tau: Vec<f64>,
    /// Moment vector about the origin of frame k, world axes, N·m (N + 1; 0 is the base, where link 1 and all after it hang).
    pub moment: Vec<Vector3<f64>>,
    /// Weight (and applied force) carried by frame k, world axes, N (N + 1).
    pub force: Vec<Vector3<f64>>,
}

impl Loads {
    /// Room for an arm of `joints` joints.
    pub fn new(joints: usize) -> Self {
        Loads { tau: vec![0.0; joints], moment: vec![Vector3::zeros(); joints + 1], force: vec![Vector3::zeros(); joints + 1] }
    }

    /// Weighs the arm in `posture`: links, `payload`, `gravity` (world, m/s²) and a force `at_tcp` (world, N).
    pub fn weigh(
        &mut self,
        robot: &Robot,
        posture: &Posture,
        payload: &Payload,
        gravity: &Vector3<f64>,
        at_tcp: &Vector3<f64>,
    ) {
        let n = robot.joints();
        let mut mass = payload.mass;
        let mut first_moment = posture.flange().point(&payload.com) * payload.mass;
        let pushed = *at_tcp != Vector3::zeros();
        for k in (1..=n).rev() {
            let frame = posture.frame(k);
            let link = &robot.links[k - 1];
            mass += link.mass;
            first_moment += frame.point(&link.com) * link.mass;
            let (axis, origin) = posture.joint_axis(k - 1);
            let mut moment = (first_moment - origin * mass).cross(gravity);
            self.force[k] = gravity * mass;
            if pushed {
                moment += (posture.tcp() - origin).cross(at_tcp);
                self.force[k] += at_tcp;
            }
            self.moment[k] = moment;
            self.tau[k - 1] = axis.dot(&moment);
        }
        let origin = posture.frame(0).o;
        self.moment[0] = (first_moment - origin * mass).cross(gravity) + (posture.tcp() - origin).cross(at_tcp);
        self.force[0] = gravity * mass + at_tcp;
    }
}
