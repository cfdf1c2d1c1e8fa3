//! Gravity at rest: the moment of the weight about every joint (Newton-Euler without motion).
//!
//! `M_j = sum_{k >= j} (c_k - o_j) x m_k g` and `tau_j = z_j . M_j`: the moment that the load exerts about +z_j,
//! so a gearbox that gives way turns in the direction of tau_j. It is minus the holding torque dU/dq_j.

use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::lanes::{Group, Numbers, Vector, in_lanes};
use super::{Posture, Postures, Robot};

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
        let force = (*at_tcp != Vector3::zeros()).then_some(at_tcp);
        let mut hanging = Hanging::new(Group::lane(0), robot, posture, payload, gravity, force);
        for k in (0..=robot.joints()).rev() {
            let (moment, tau) = hanging.on(k);
            self.force[k] = gravity * hanging.mass + force.unwrap_or(&Vector3::zeros());
            self.moment[k] = moment.into();
            if k > 0 {
                self.tau[k - 1] = tau.into();
            }
        }
    }
}

/// Writes the moment of links and `payload` about +z of each joint into `tau` (N, N·m), of several postures at once: the same numbers
/// that [`Loads::weigh`] finds of each.
#[inline]
pub fn torques<const L: usize>(
    robot: &Robot,
    postures: &Postures<L>,
    payload: &Payload,
    gravity: &Vector3<f64>,
    tau: &mut [[f64; L]],
) {
    in_lanes::<L, _>(Torques { robot, postures, payload, gravity, tau });
}

struct Torques<'a, const L: usize> {
    robot: &'a Robot,
    postures: &'a Postures<L>,
    payload: &'a Payload,
    gravity: &'a Vector3<f64>,
    tau: &'a mut [[f64; L]],
}

impl<const L: usize> WithSimd for Torques<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Torques { robot, postures, payload, gravity, tau } = self;
        for first in (0..L).step_by(S::F64_LANES) {
            let group = Group::new(simd, first);
            let mut hanging = Hanging::new(group, robot, postures, payload, gravity, None);
            for k in (1..=robot.joints()).rev() {
                group.put(&mut tau[k - 1], hanging.on(k).1);
            }
        }
    }
}

/// What hangs on a frame of an arm, gathered from the last frame on.
struct Hanging<'a, S: Simd, const L: usize> {
    group: Group<S>,
    robot: &'a Robot,
    postures: &'a Postures<L>,
    gravity: Vector<S>,
    at_tcp: Option<&'a Vector3<f64>>,
    /// Of all of it, kg.
    mass: f64,
    /// About the origin of the world, kg·m.
    first_moment: Vector<S>,
}

impl<'a, S: Simd, const L: usize> Hanging<'a, S, L> {
    /// The payload, and a force at the TCP (world, N).
    #[inline(always)]
    fn new(
        group: Group<S>,
        robot: &'a Robot,
        postures: &'a Postures<L>,
        payload: &Payload,
        gravity: &Vector3<f64>,
        at_tcp: Option<&'a Vector3<f64>>,
    ) -> Self {
        let gravity = group.vector(gravity);
        let mut hanging = Hanging {
            group,
            robot,
            postures,
            gravity,
            at_tcp,
            mass: payload.mass,
            first_moment: group.vector(&Vector3::zeros()),
        };
        hanging.first_moment = hanging.first_moment_of(robot.joints(), payload.mass, &payload.com);
        hanging
    }

    #[inline(always)]
    fn first_moment_of(&self, k: usize, mass: f64, com: &Vector3<f64>) -> Vector<S> {
        self.postures.frames_of(self.group, k).point(self.group.vector(com)) * self.group.splat(mass)
    }

    /// Adds link `k`, all after it being there, and finds the moment about the origin of its frame, world axes, N·m, and about +z of its
    /// joint. Frame 0 is the base, which has no link and no joint.
    #[inline(always)]
    fn on(&mut self, k: usize) -> (Vector<S>, Numbers<S>) {
        if k > 0 {
            let link = &self.robot.links[k - 1];
            self.mass += link.mass;
            self.first_moment += self.first_moment_of(k, link.mass, &link.com);
        }
        let (axis, origin) = self.postures.axes_of(self.group, k);
        let mut moment = (self.first_moment - origin * self.group.splat(self.mass)).cross(self.gravity);
        if let Some(force) = self.at_tcp {
            moment += (self.postures.tcps().of(self.group) - origin).cross(self.group.vector(force));
        }
        (moment, axis.dot(moment))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{FramePose, SiteIndex, Stances, built_in};

    /// Bits and all.
    #[test]
    fn postures_weighed_at_once_weigh_what_each_does_alone() {
        for name in ["kr6_r700", "panda"] {
            let robot = built_in(name).unwrap();
            let n = robot.joints();
            let sites = SiteIndex::new(n).len();
            let payload = Payload { name: "gauge".into(), mass: 1.3, com: Vector3::new(0.02, -0.01, -0.08) };
            let gravity = Vector3::new(0.1, -0.2, -9.8);
            let q: Vec<[f64; 8]> =
                (0..n).map(|i| [0, 1, 2, 3, 4, 5, 6, 7].map(|l| (1.0 + i as f64 * 1.7 + f64::from(l)).sin())).collect();
            let mut together = Postures::new(&robot);
            let stances = Stances { base: &[[0.3; 8]; 6], tool: &[[0.1; 8]; 3], q: &q, deviations: &vec![[0.0; 8]; sites] };
            together.set_all(&robot, &stances);
            let mut tau = vec![[f64::NAN; 8]; n];
            torques(&robot, &together, &payload, &gravity, &mut tau);
            let (mut alone, mut loads) = (Posture::new(&robot), Loads::new(n));
            for lane in 0..8 {
                let q: Vec<f64> = q.iter().map(|q| q[lane]).collect();
                let tool = FramePose { xyz: [0.1; 3], ..FramePose::default() };
                alone.set(&robot, &FramePose::from_array([0.3; 6]), &tool, &q, &vec![0.0; sites]);
                loads.weigh(&robot, &alone, &payload, &gravity, &Vector3::zeros());
                for (tau, own) in tau.iter().zip(&loads.tau) {
                    assert_eq!(tau[lane].to_bits(), own.to_bits());
                }
            }
        }
    }
}
