//! Static gravity loads: the moment of the weight about every joint (Newton-Euler without motion).
//!
//! `M_j = sum_{k >= j} (c_k - o_j) x m_k g` and `tau_j = z_j . M_j`: the moment that the load exerts about +z_j, so a
//! compliant gearbox deflects in the direction of tau_j. It is minus the holding torque dU/dq_j. Of a prismatic joint tau_j is
//! the force of the load along +z_j.

use nalgebra::Vector3;
use pulp::{Simd, WithSimd};

use super::kinematics::{Posture, Postures};
use super::{Robot, Vectors};
use crate::math::simd::{F64s, Group, Vector, in_lanes};

/// Gravity in a world whose z axis points up, unless a file states another, m/s².
pub const DEFAULT_GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);

/// The payload on the flange: mass (kg) and its centre in the last frame (m).
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
    /// No payload.
    pub fn none() -> Self {
        Payload { name: "none".into(), mass: 0.0, com: Vector3::zeros() }
    }
}

/// Static loads in one posture.
///
/// ```
/// use std::f64::consts::FRAC_PI_2;
///
/// use calibench::nalgebra::Vector3;
/// use calibench::robot::kinematics::Posture;
/// use calibench::robot::sites::SiteIndex;
/// use calibench::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
/// use calibench::robot::{FramePose, Link, MdhLink, Robot};
///
/// // A level arm of 2 kg, its centre of mass 0.5 m from a joint that turns about the world's -y: 2 kg * 9.81 m/s² * 0.5 m.
/// let mdh = MdhLink { alpha: FRAC_PI_2, ..MdhLink::default() };
/// let link = Link { mdh, limits: [-1.0, 1.0], mass: 2.0, com: Vector3::new(0.5, 0.0, 0.0) };
/// let robot = Robot { links: vec![link], ..Robot::default() };
/// let mut posture = Posture::new(&robot);
/// let nominal = vec![0.0; SiteIndex::new(1).len()];
/// posture.set(&robot, &FramePose::default(), &FramePose::default(), &[0.0], &nominal);
/// let mut loads = Loads::new(1);
/// loads.compute(&robot, &posture, &Payload::none(), &DEFAULT_GRAVITY, &Vector3::zeros());
/// assert!((loads.tau[0] + 9.81).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// Moment of the load about +z of each joint, N·m, or force along +z of a prismatic one, N (N).
    pub tau: Vec<f64>,
    /// Moment vector about the origin of frame k, world axes, N·m (N + 1; 0 is the base, which carries link 1 and all after
    /// it).
    pub moment: Vec<Vector3<f64>>,
    /// Weight (and applied force) carried by frame k, world axes, N (N + 1).
    pub force: Vec<Vector3<f64>>,
}

impl Loads {
    /// Allocates for an arm with `joints` joints.
    pub fn new(joints: usize) -> Self {
        Loads { tau: vec![0.0; joints], moment: vec![Vector3::zeros(); joints + 1], force: vec![Vector3::zeros(); joints + 1] }
    }

    /// Computes the loads of the arm in `posture`: links, `payload`, `gravity` (world, m/s²) and a force `at_tcp` (world,
    /// N).
    pub fn compute(
        &mut self,
        robot: &Robot,
        posture: &Posture,
        payload: &Payload,
        gravity: &Vector3<f64>,
        at_tcp: &Vector3<f64>,
    ) {
        in_lanes::<1, _>(WeighOne { loads: self, robot, posture, weights: &Weights::of(payload, gravity), at_tcp });
    }
}

/// [`Loads::compute`] with the processor's full instruction set.
struct WeighOne<'a> {
    loads: &'a mut Loads,
    robot: &'a Robot,
    posture: &'a Posture,
    weights: &'a Weights<1>,
    at_tcp: &'a Vector3<f64>,
}

impl WithSimd for WeighOne<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let WeighOne { loads, robot, posture, weights, at_tcp } = self;
        let force = (*at_tcp != Vector3::zeros()).then_some(at_tcp);
        let gravity = weights.gravity.at(0);
        let mut outboard = OutboardMass::new(Group::lane(0), robot, posture, weights, force);
        for k in (0..=robot.joints()).rev() {
            let (moment, tau) = outboard.on(k);
            loads.force[k] = gravity * f64::from(outboard.mass) + at_tcp;
            loads.moment[k] = moment.into();
            if k > 0 {
                loads.tau[k - 1] = tau.into();
            }
        }
    }
}

/// Static loads of a batch of postures.
#[derive(Debug, Clone)]
pub struct LoadsBatch<const L: usize> {
    /// On each frame (N + 1).
    on: Vec<BatchLoad<L>>,
}

/// Loads carried by one frame.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))] // So that a register of eight numbers does not straddle two cache lines.
struct BatchLoad<const L: usize> {
    /// Moment vector about its origin, world axes, N·m.
    moment: Vectors<L>,
    /// Its component about +z of the joint, N·m, or the force along +z of a prismatic one, N.
    tau: [f64; L],
    /// Mass, kg.
    mass: [f64; L],
}

/// Payload and gravity of each posture of a batch.
#[derive(Debug, Clone, Copy)]
pub struct Weights<const L: usize> {
    /// Mass of the payload, kg.
    pub mass: [f64; L],
    /// Its centre in the last frame, m.
    pub com: Vectors<L>,
    /// Gravity in the world, m/s².
    pub gravity: Vectors<L>,
}

impl<const L: usize> Weights<L> {
    /// The same in all postures.
    pub fn of(payload: &Payload, gravity: &Vector3<f64>) -> Self {
        let mut weights = Weights { mass: [0.0; L], com: Vectors::ZERO, gravity: Vectors::ZERO };
        (0..L).for_each(|lane| weights.put(lane, payload, gravity));
        weights
    }

    /// Replaces those of one posture.
    #[inline]
    pub fn put(&mut self, lane: usize, payload: &Payload, gravity: &Vector3<f64>) {
        self.mass[lane] = payload.mass;
        self.com.put(lane, &payload.com);
        self.gravity.put(lane, gravity);
    }
}

impl<const L: usize> LoadsBatch<L> {
    /// Allocates for arms with `joints` joints.
    pub fn new(joints: usize) -> Self {
        LoadsBatch { on: vec![BatchLoad { moment: Vectors::ZERO, tau: [0.0; L], mass: [0.0; L] }; joints + 1] }
    }

    /// Moments of the loads about +z of joint `i` (counted from 0), N·m; of a prismatic one forces along it, N.
    #[inline]
    pub fn tau(&self, i: usize) -> &[f64; L] {
        &self.on[i + 1].tau
    }

    /// Computes the loads in all postures: the same values as [`Loads::compute`] for each, without a force at the TCP.
    #[inline]
    pub fn compute(&mut self, robot: &Robot, postures: &Postures<L>, weights: &Weights<L>) {
        in_lanes::<L, _>(Weigh { loads: self, robot, postures, weights });
    }

    /// Writes the loads of one posture, computed with these weights.
    #[inline]
    pub fn put_into(&self, lane: usize, weights: &Weights<L>, loads: &mut Loads) {
        let gravity = weights.gravity.at(lane);
        for (k, on) in self.on.iter().enumerate() {
            loads.moment[k] = on.moment.at(lane);
            loads.force[k] = gravity * on.mass[lane];
            if k > 0 {
                loads.tau[k - 1] = on.tau[lane];
            }
        }
    }
}

struct Weigh<'a, const L: usize> {
    loads: &'a mut LoadsBatch<L>,
    robot: &'a Robot,
    postures: &'a Postures<L>,
    weights: &'a Weights<L>,
}

impl<const L: usize> WithSimd for Weigh<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Weigh { loads, robot, postures, weights } = self;
        for first in (0..L).step_by(S::F64_LANES) {
            let group = Group::new(simd, first);
            let mut outboard = OutboardMass::new(group, robot, postures, weights, None);
            for k in (0..=robot.joints()).rev() {
                let (moment, tau) = outboard.on(k);
                let on = &mut loads.on[k];
                on.moment.put_all(group, moment);
                group.put(&mut on.tau, tau);
                group.put(&mut on.mass, outboard.mass);
            }
        }
    }
}

/// Everything carried by a frame of an arm, accumulated from the last frame on.
struct OutboardMass<'a, S: Simd, const L: usize> {
    group: Group<S>,
    robot: &'a Robot,
    postures: &'a Postures<L>,
    gravity: Vector<S>,
    at_tcp: Option<&'a Vector3<f64>>,
    /// Total mass, kg.
    mass: F64s<S>,
    /// First moment about the origin of the world, kg·m.
    first_moment: Vector<S>,
}

impl<'a, S: Simd, const L: usize> OutboardMass<'a, S, L> {
    /// The payload, and a force at the TCP (world, N).
    #[inline(always)]
    fn new(
        group: Group<S>,
        robot: &'a Robot,
        postures: &'a Postures<L>,
        weights: &Weights<L>,
        at_tcp: Option<&'a Vector3<f64>>,
    ) -> Self {
        let mass = group.of(&weights.mass);
        let first_moment = postures.frames_of(group, robot.joints()).point(weights.com.of(group)) * mass;
        OutboardMass { group, robot, postures, gravity: weights.gravity.of(group), at_tcp, mass, first_moment }
    }

    /// Adds link `k`, with all after it already included, and computes the moment about the origin of its frame, world
    /// axes, N·m, and the joint's component of it, or of the force. Frame 0 is the base, which has no link and no joint.
    #[inline(always)]
    fn on(&mut self, k: usize) -> (Vector<S>, F64s<S>) {
        let group = self.group;
        if k > 0 {
            let link = &self.robot.links[k - 1];
            let mass = group.splat(link.mass);
            self.mass = self.mass + mass;
            let com = self.postures.frames_of(group, k).point(group.vector(&link.com));
            self.first_moment = self.first_moment.add_mul(com, mass);
        }
        let (axis, origin) = self.postures.axes_of(group, k);
        let mut moment = self.first_moment.sub_mul(origin, self.mass).cross_fused(self.gravity);
        if let Some(force) = self.at_tcp {
            moment += (self.postures.tcps().of(group) - origin).cross_fused(group.vector(force));
        }
        if k > 0 && self.postures.slides(k - 1) {
            let mut force = self.gravity * self.mass;
            if let Some(at_tcp) = self.at_tcp {
                force += group.vector(at_tcp);
            }
            return (moment, axis.dot(force));
        }
        (moment, axis.dot(moment))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::kinematics::BatchInput;
    use crate::robot::sites::SiteIndex;
    use crate::robot::{FramePose, built_in};

    /// Bit for bit.
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
            let stances = BatchInput { base: &[[0.3; 8]; 6], tool: &[[0.1; 8]; 3], q: &q, deviations: &vec![[0.0; 8]; sites] };
            together.set_all(&robot, &stances);
            let mut batch = LoadsBatch::new(n);
            let weights = Weights::of(&payload, &gravity);
            batch.compute(&robot, &together, &weights);
            let (mut alone, mut loads) = (Posture::new(&robot), Loads::new(n));
            for lane in 0..8 {
                let q: Vec<f64> = q.iter().map(|q| q[lane]).collect();
                let tool = FramePose { xyz: [0.1; 3], ..FramePose::default() };
                alone.set(&robot, &FramePose::from_array([0.3; 6]), &tool, &q, &vec![0.0; sites]);
                loads.compute(&robot, &alone, &payload, &gravity, &Vector3::zeros());
                let mut of_lane = Loads::new(n);
                batch.put_into(lane, &weights, &mut of_lane);
                assert_eq!(of_lane, loads);
            }
        }
    }
}
