//! Forward kinematics of a deviating arm, and the exact columns of its position Jacobian, for one posture or batched.
//!
//! `T_world_tool = T(base) * prod_i [ flex_{i-1} Rx(alpha) Tx(a) Ry(beta) Rz(q + theta) Tz(d) ] * flex_n * tool`
//! (paper Eq. 1, 2, 5, 6); where joint i is prismatic, q is added to d instead of theta.
//!
//! The code here works on [`Postures`], with one number per posture in each lane; the [`Posture`] is the instance with one
//! lane, and gives the same bytes as in a batch.

pub(crate) use super::posture_view::LanePosture;
pub(crate) use super::posture_view::PostureView;

mod jacobian;
mod mdh_rows;
mod posture;

use nalgebra::Vector3;
use pulp::{Arch, Scalar, Simd, WithSimd};

use self::mdh_rows::{CachedSinCos, MdhRows};
pub use self::posture::Posture;
use super::frame::Frames;
use super::sites::SiteIndex;
use super::{Frame, FramePose, JointKind, Pose, Robot, Vectors};
use crate::math::simd::{Axes, Group, Vector, fill_registers};
use crate::math::sincos;

/// A batch of `L` postures of the arm: all its frames, the TCP, and the column of any site. Reused from sample to sample
/// without allocation.
///
/// Joints, deviations and results are lists of `[f64; L]`, one number per posture.
///
/// ```
/// use calibench::nalgebra::Vector3;
/// use calibench::robot::kinematics::Posture;
/// use calibench::robot::sites::SiteIndex;
/// use calibench::robot::{FramePose, Link, MdhLink, Robot};
///
/// // One joint that turns about z, with the TCP 0.5 m away: it moves the TCP by 0.5 m a radian.
/// let link = Link { mdh: MdhLink::default(), limits: [-1.0, 1.0], mass: 0.0, com: Vector3::zeros() };
/// let robot = Robot { links: vec![link], ..Robot::default() };
/// let tool = FramePose { xyz: [0.5, 0.0, 0.0], ..FramePose::default() };
/// let mut posture = Posture::new(&robot);
/// posture.set(&robot, &FramePose::default(), &tool, &[0.0], &vec![0.0; SiteIndex::new(1).len()]);
/// assert!((posture.tcp() - Vector3::new(0.5, 0.0, 0.0)).norm() < 1e-15);
/// assert!((posture.column(robot.joint_site(0)) - Vector3::new(0.0, 0.5, 0.0)).norm() < 1e-15);
/// ```
#[derive(Debug, Clone)]
pub struct Postures<const L: usize> {
    sites: SiteIndex,
    /// Rz, Ry, Rx of the base, cached because a base seldom rotates between samples; frame 0 keeps their axes.
    base_turned: [CachedSinCos<L>; 3],
    /// Frame k before its flex displacement; 0 is the base.
    rigid: Vec<Frames<L>>,
    /// Frame k after it; maintained only if something flexes.
    flexed: Vec<Frames<L>>,
    flexible: bool,
    /// Rz and Ry of each flex displacement.
    flex_turned: Vec<[CachedSinCos<L>; 2]>,
    lines: Vec<MdhRows<L>>,
    /// TCP in the last frame.
    tool: Vectors<L>,
    tcp: Vectors<L>,
}

/// The definition of a batch of postures, one number per posture.
#[derive(Debug, Clone, Copy)]
pub struct BatchInput<'a, const L: usize> {
    /// Nominal base in the world: x, y, z (m), rz, ry, rx (rad).
    pub base: &'a [[f64; L]; 6],
    /// TCP in the last frame, m.
    pub tool: &'a [[f64; L]; 3],
    /// Joint positions, rad, or m of prismatic joints (N).
    pub q: &'a [[f64; L]],
    /// Deviation of every site, SI (see [`SiteIndex`]).
    pub deviations: &'a [[f64; L]],
}

impl<const L: usize> Postures<L> {
    /// A workspace for this arm.
    pub fn new(robot: &Robot) -> Self {
        let n = robot.joints();
        Postures {
            sites: SiteIndex::new(n),
            base_turned: [CachedSinCos::ZERO; 3],
            rigid: vec![Frames::identity(); n + 1],
            flexed: vec![Frames::identity(); n + 1],
            flexible: false,
            flex_turned: vec![[CachedSinCos::ZERO; 2]; n + 1],
            lines: vec![MdhRows::ZERO; n],
            tool: Vectors::ZERO,
            tcp: Vectors::ZERO,
        }
    }

    /// Moves the arm to all postures.
    #[inline]
    pub fn set_all(&mut self, robot: &Robot, stances: &BatchInput<'_, L>) {
        let BatchInput { base, tool, q, deviations } = *stances;
        if fill_registers::<L>() {
            Arch::new().dispatch(Shaped { postures: self, robot, stances });
        } else {
            // A single lane needs no vectors, but the compiler would vectorise it anyway.
            self.shape(robot, base, tool, deviations);
        }
        self.turn_all(robot, q, deviations);
    }

    /// Moves the joints to `q` (rad or m, N) with base, tool and links as last set: only the deviations of the joints' angles
    /// may differ from those given then.
    #[inline]
    pub fn turn_all(&mut self, robot: &Robot, q: &[[f64; L]], deviations: &[[f64; L]]) {
        Arch::new().dispatch(Turned { postures: self, robot, q, deviations });
    }

    /// Sets base, tool and links.
    #[inline(always)]
    fn shape(&mut self, robot: &Robot, base: &[[f64; L]; 6], tool: &[[f64; L]; 3], deviations: &[[f64; L]]) {
        let n = robot.joints();
        assert!(deviations.len() == self.sites.len() && self.lines.len() == n);
        self.place_base(base, deviations);
        for (i, lines) in self.lines.iter_mut().enumerate() {
            let dev = &deviations[self.sites.link(i)..][..5];
            let mdh = &robot.links[i].mdh;
            lines.alpha.turn(&sum(mdh.alpha, &dev[0]));
            lines.a = sum(mdh.a, &dev[1]);
            lines.beta.turn(&sum(mdh.beta, &dev[2]));
            lines.skewed = (0..L).fold(0, |bits, l| bits | lines.beta.angle[l].to_bits()) << 1 != 0;
            lines.d = sum(mdh.d, &dev[4]);
            lines.slides = mdh.kind == JointKind::Prismatic;
        }
        self.flexible = (0..=n).fold(false, |any, k| any | flexes(&deviations[self.sites.flex(k)..][..6]));
        let tip = self.sites.tool();
        let plus = |k: usize| std::array::from_fn(|l| tool[k][l] + deviations[tip + k][l]);
        self.tool = Vectors { x: plus(0), y: plus(1), z: plus(2) };
    }

    /// Turns the joints, in the lanes of `simd`; several joints of one posture may fill the registers of the processor's
    /// `widest` instruction set.
    #[inline(always)]
    fn turn<S: Simd>(&mut self, simd: S, widest: impl Simd, robot: &Robot, q: &[[f64; L]], deviations: &[[f64; L]]) {
        let n = robot.joints();
        assert!(deviations.len() == self.sites.len() && q.len() == n && self.lines.len() == n);
        for (i, lines) in self.lines.iter_mut().enumerate() {
            if lines.slides {
                lines.slide(&robot.links[i].mdh, &q[i], &deviations[self.sites.link(i)..][..5]);
                continue;
            }
            for first in (0..L).step_by(S::F64_LANES) {
                let group = Group::new(simd, first);
                let nominal = group.splat(robot.links[i].mdh.theta);
                let angle = group.of(&q[i]) + nominal + group.of(&deviations[self.sites.link(i) + 3]);
                group.put(&mut lines.theta.angle, angle);
            }
        }
        // All sines and cosines first: calls to them would force the frames out of the registers.
        self.find_sines(widest);
        self.lay_out(simd, deviations);
    }

    /// Computes the frames, from base to flange.
    #[inline(always)]
    fn lay_out<S: Simd>(&mut self, simd: S, deviations: &[[f64; L]]) {
        let n = self.lines.len();
        if self.flexible {
            self.bend(0, deviations);
            for i in 0..n {
                for first in (0..L).step_by(S::F64_LANES) {
                    let group = Group::new(simd, first);
                    let next = self.lines[i].next(group, &self.flexed[i].of(group));
                    self.rigid[i + 1].put_all(group, &next);
                }
                self.bend(i + 1, deviations);
            }
            for first in (0..L).step_by(S::F64_LANES) {
                let group = Group::new(simd, first);
                self.tcp.put_all(group, self.flexed[n].of(group).point(self.tool.of(group)));
            }
        } else {
            for first in (0..L).step_by(S::F64_LANES) {
                let group = Group::new(simd, first);
                let mut frame = self.rigid[0].of(group);
                for (lines, rigid) in self.lines.iter().zip(&mut self.rigid[1..]) {
                    frame = lines.next(group, &frame);
                    rigid.put_all(group, &frame);
                }
                self.tcp.put_all(group, frame.point(self.tool.of(group)));
            }
        }
    }

    /// Sets the base, which is frame 0 before its flex displacement.
    #[inline(always)]
    fn place_base(&mut self, base: &[[f64; L]; 6], deviations: &[[f64; L]]) {
        let mut chi = *base;
        for (chi, dev) in chi.iter_mut().zip(deviations) {
            (0..L).for_each(|l| chi[l] += dev[l]);
        }
        if self.base_turned.iter().zip(&chi[3..]).any(|(turned, angle)| turned.differ(angle)) {
            self.turn_base(&chi);
        }
        let [x, y, z, ..] = chi;
        self.rigid[0].o = Vectors { x, y, z };
    }

    #[cold]
    fn turn_base(&mut self, chi: &[[f64; L]; 6]) {
        for l in 0..L {
            self.rigid[0].put(l, &Frame::from_pose(&FramePose::from_array(chi.map(|x| x[l])).pose()));
        }
        self.base_turned.iter_mut().zip(&chi[3..]).for_each(|(turned, angle)| turned.turn(angle));
    }

    /// Computes the sines and cosines of all joints.
    #[inline(always)]
    fn find_sines<S: Simd>(&mut self, simd: S) {
        let mut far = false;
        if fill_registers::<L>() {
            // Registers filled with a joint of several postures,
            for MdhRows { theta, .. } in &mut self.lines {
                far |= sincos::any_far(&theta.angle);
                for first in (0..L).step_by(S::F64_LANES) {
                    let group = Group::new(simd, first);
                    let (sin, cos) = sincos::sincos(group.of(&theta.angle));
                    group.put(&mut theta.sin, sin);
                    group.put(&mut theta.cos, cos);
                }
            }
        } else {
            // or with several joints of a posture.
            for lines in self.lines.chunks_mut(sincos::BATCH / L) {
                let mut angles = [0.0; sincos::BATCH];
                for (k, MdhRows { theta, .. }) in lines.iter().enumerate() {
                    angles[k * L..][..L].copy_from_slice(&theta.angle);
                }
                let of = sincos::sincos_batch(simd, &angles);
                far |= of.far;
                for (k, MdhRows { theta, .. }) in lines.iter_mut().enumerate() {
                    theta.sin.copy_from_slice(&of.sin[k * L..][..L]);
                    theta.cos.copy_from_slice(&of.cos[k * L..][..L]);
                }
            }
        }
        if far {
            self.turn_far_joints();
        }
    }

    #[cold]
    fn turn_far_joints(&mut self) {
        for MdhRows { theta, .. } in &mut self.lines {
            for l in (0..L).filter(|&l| sincos::is_far(theta.angle[l])) {
                (theta.sin[l], theta.cos[l]) = theta.angle[l].sin_cos();
            }
        }
    }

    /// Applies the flex displacement of frame k.
    fn bend(&mut self, k: usize, deviations: &[[f64; L]]) {
        self.flexed[k] = self.rigid[k];
        let v = &deviations[self.sites.flex(k)..][..6];
        if flexes(v) {
            for l in 0..L {
                let v = [0, 1, 2, 3, 4, 5].map(|axis| v[axis][l]);
                if v != [0.0; 6] {
                    self.flexed[k].put(l, &self.rigid[k].at(l).displaced(&v));
                }
            }
        }
        self.flex_turned[k][0].turn(&v[3]);
        self.flex_turned[k][1].turn(&v[4]);
    }

    /// Frames after their flex displacements.
    #[inline(always)]
    fn frames(&self) -> &[Frames<L>] {
        if self.flexible { &self.flexed } else { &self.rigid }
    }

    /// Number of joints.
    #[inline(always)]
    pub fn joints(&self) -> usize {
        self.lines.len()
    }

    /// World positions of the TCP, m.
    #[inline]
    pub fn tcps(&self) -> &Vectors<L> {
        &self.tcp
    }

    /// `world_from_frame` k of one posture: 0 is the base, k the frame of link k (counted from 1).
    #[inline(always)]
    pub fn frame_at(&self, lane: usize, k: usize) -> Frame {
        self.frames()[k].at(lane)
    }

    /// Axis and origin of joint `i` (counted from 0) in the world, of one posture.
    #[inline(always)]
    pub fn joint_axis_at(&self, lane: usize, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        let frame = self.rigid[i + 1].at(lane);
        (frame.z, frame.o)
    }

    /// Frames k of a group of postures.
    #[inline(always)]
    pub(super) fn frames_of<S: Simd>(&self, group: Group<S>, k: usize) -> Axes<S> {
        self.frames()[k].of(group)
    }

    /// Axis and origin of joint `k` (counted from 1), or of the base's z axis where `k` is 0, of a group of postures.
    #[inline(always)]
    pub(super) fn axes_of<S: Simd>(&self, group: Group<S>, k: usize) -> (Vector<S>, Vector<S>) {
        let frames = if k == 0 { self.frames() } else { &self.rigid };
        (frames[k].z.of(group), frames[k].o.of(group))
    }
}

/// Base, tool and links of [`Postures::set_all`], with the processor's full instruction set.
struct Shaped<'a, const L: usize> {
    postures: &'a mut Postures<L>,
    robot: &'a Robot,
    stances: &'a BatchInput<'a, L>,
}

impl<const L: usize> WithSimd for Shaped<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let BatchInput { base, tool, deviations, .. } = *self.stances;
        self.postures.shape(self.robot, base, tool, deviations);
    }
}

/// [`Postures::turn_all`] with the processor's full instruction set. A closure would be compiled for the baseline one.
struct Turned<'a, const L: usize> {
    postures: &'a mut Postures<L>,
    robot: &'a Robot,
    q: &'a [[f64; L]],
    deviations: &'a [[f64; L]],
}

impl<const L: usize> WithSimd for Turned<'_, L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Turned { postures, robot, q, deviations } = self;
        if fill_registers::<L>() {
            postures.turn(simd, simd, robot, q, deviations);
        } else {
            postures.turn(Scalar::new(), simd, robot, q, deviations);
        }
    }
}

/// Adds a number to that of each posture.
#[inline(always)]
fn sum<const L: usize>(a: f64, b: &[f64; L]) -> [f64; L] {
    let mut sum = *b;
    (0..L).for_each(|l| sum[l] = a + b[l]);
    sum
}

/// True if the displacement is non-zero in any posture.
#[inline(always)]
fn flexes<const L: usize>(displacement: &[[f64; L]]) -> bool {
    // All bits except the sign at once: separate comparisons would be separate branches.
    displacement.iter().flatten().fold(0, |bits, x| bits | x.to_bits()) << 1 != 0
}

/// World position and orientation of the tool of a nominal arm.
///
/// ```
/// use calibench::nalgebra::Vector3;
/// use calibench::robot::kinematics::world_from_tool;
/// use calibench::robot::{FramePose, built_in};
/// use calibench::units::{DEG, MM};
///
/// // The KR 6 R700 with its forearm level: KUKA's controller shows X 470, Y 0, Z 750 mm.
/// let robot = built_in("kr6_r700").ok_or("built in")?;
/// let q = [0.0, -90.0, 90.0, 0.0, 0.0, 0.0].map(|q| q * DEG);
/// let pose = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &q);
/// assert!((pose.translation.vector - Vector3::new(470.0, 0.0, 750.0) * MM).norm() < 1e-4 * MM);
/// # Ok::<(), &str>(())
/// ```
pub fn world_from_tool(robot: &Robot, base: &FramePose, tool: &FramePose, q: &[f64]) -> Pose {
    robot.links.iter().zip(q).fold(base.pose(), |pose, (link, &q)| pose * link.mdh.transform(q)) * tool.pose()
}

#[cfg(test)]
mod tests;
